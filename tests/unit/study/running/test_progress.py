"""How far a study is, shown as bars on a terminal, as lines in a log, or not at all."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from fingerslip.study.running import progress as progress_module
from fingerslip.study.running.progress import BarProgress, LineProgress, StudyProgress, progress_for


def terminal() -> Console:
    return Console(file=io.StringIO(), force_terminal=True, width=120)


def log() -> Console:
    return Console(file=io.StringIO(), force_terminal=False, width=40)


def said(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Replace the clock; the only item of the list is the time."""
    now = [1000.0]
    monkeypatch.setattr(progress_module.time, "monotonic", lambda: now[0])
    return now


def test_a_terminal_gets_bars_and_anything_else_lines() -> None:
    assert isinstance(progress_for(terminal()), BarProgress)
    assert isinstance(progress_for(log()), LineProgress)


def test_lines_come_at_the_start_then_every_half_minute_and_at_the_end(clock: list[float]) -> None:
    console = log()
    with LineProgress(console) as shown:
        shown.begin(["a", "b"])
        for seconds, fraction in ((0, 0.004), (10, 0.1), (29.9, 0.2), (30, 0.25), (59, 0.5), (61, 0.6)):
            clock[0] = 1000.0 + seconds
            shown.advance("a", fraction)
        shown.advance("b", 0.5)
        shown.finish("a", "done")
    assert said(console).splitlines() == ["a: 0 %", "a: 25 %", "a: 60 %", "b: 50 %", "a: done"]


@pytest.mark.parametrize("make", [LineProgress, BarProgress])
def test_messages_are_whole_and_taken_as_they_are(make: object) -> None:
    console = log()
    message = "block/[red]friction_coefficient-0.2[/red]: unchanged, and longer than the log is wide"
    make(console).say(message)
    assert said(console) == f"{message}\n"


def state(bars: BarProgress) -> dict[str, float]:
    return {task.description: task.completed for task in bars._bars.tasks}


def test_bars_show_each_run_and_the_sum_of_all() -> None:
    with BarProgress(terminal()) as bars:
        bars.begin(["a", "b", "c"])
        assert state(bars) == {"all runs": 0.0}
        bars.advance("a", 0.5)
        bars.advance("b", 0.25)
        bars.advance("a", 0.75)
        assert state(bars) == {"all runs": 1.0, "a": 0.75, "b": 0.25}
        bars.finish("a", "done")
        bars.finish("c", "failed")
        assert state(bars) == {"all runs": 2.25, "a: done": 1.0, "b": 0.25, "c: failed": 1.0}
        total = next(task for task in bars._bars.tasks if task.description == "all runs")
        assert total.total == 3.0


def test_a_single_run_needs_no_sum() -> None:
    with BarProgress(terminal()) as bars:
        bars.begin(["a"])
        bars.advance("a", 0.5)
        assert state(bars) == {"a": 0.5}


def test_a_second_study_starts_from_nothing() -> None:
    with BarProgress(terminal()) as bars:
        bars.begin(["a", "b"])
        bars.finish("a", "done")
        bars.finish("b", "done")
        bars.begin(["a", "b"])
        bars.advance("a", 0.5)
        newest = [task.completed for task in bars._bars.tasks][-2:]
        assert newest == [0.5, 0.5], "the sum of the second study, and its first run"


def test_bars_are_drawn_and_stopped() -> None:
    console = terminal()
    bars = BarProgress(console)
    with bars:
        bars.begin(["a"])
        bars.advance("a", 0.5)
        assert bars._bars.live.is_started
    assert not bars._bars.live.is_started
    assert "50 %" in said(console)


def test_silence(capfd: pytest.CaptureFixture[str]) -> None:
    with StudyProgress() as shown:
        shown.begin(["a"])
        shown.advance("a", 0.5)
        shown.finish("a", "done")
        shown.say("anything")
    assert capfd.readouterr() == ("", "")
