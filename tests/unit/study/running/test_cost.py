"""What a run costs, and how far it is: time, memory, compiling, progress."""

import io
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest
from rich.console import Console

from fingerslip.errors import InputError
from fingerslip.study.definition.runs import plan_studies
from fingerslip.study.inspection.check import check_plans
from fingerslip.study.running import cost
from fingerslip.study.running import progress as progress_module
from fingerslip.study.running.cost import basis_saves, estimated_bytes, estimated_seconds, require_mesh_memory
from fingerslip.study.running.progress import BarProgress, LineProgress, StudyProgress, progress_on_screen
from fingerslip.study.running.runner import run_study
from places import ROOT
from problems.pushed import push_and_slide
from unit.study.block import Told, block_values


def test_estimates_of_time_and_memory_grow_with_unknowns_steps_and_cells():
    small, large = estimated_seconds(10_000, 600), estimated_seconds(20_000, 600)
    assert small == pytest.approx(2.5)
    assert large - small == pytest.approx(2.5e-7 * 10_000 * 600)
    assert estimated_seconds(20_000, 600) == estimated_seconds(10_000, 1200)
    # Measured on two cores: the paper's fingertip in 3D took 57 s, a coarse one 16 s.
    assert estimated_seconds(72_840, 300, dim=3) == pytest.approx(57.0, rel=0.15)
    assert estimated_seconds(19_080, 300, dim=3) == pytest.approx(16.0, rel=0.15)
    # Measured in a reduced basis: a run of a sweep, and one of the motions of a map of reactions.
    assert estimated_seconds(11_000, 600, in_basis=True) == pytest.approx(0.41, rel=0.15)
    assert estimated_seconds(11_000, 925, in_basis=True) == pytest.approx(0.58, rel=0.15)
    assert estimated_seconds(11_000, 600, 3, in_basis=True) == estimated_seconds(11_000, 600, 3)
    # Measured at large strain without inertia: a section of the ridged sensor took 33 s, a half in 3D 261 s.
    assert estimated_seconds(7078, 488, 2, "finite", is_static=True) == pytest.approx(33.0, rel=0.15)
    assert estimated_seconds(61_661, 9, 3, "finite", is_static=True) == pytest.approx(261.0, rel=0.15)
    # Measured: assembly of 131,712 linear tetrahedra with nodal integration takes 0.79 GB at its peak.
    assert estimated_bytes(131_712, "T4") == pytest.approx(0.79e9, rel=0.05)
    assert estimated_bytes(2e4, "T4") == 2 * estimated_bytes(1e4, "T4")
    assert estimated_bytes(1e4, "T10") == pytest.approx(2.5**2 * estimated_bytes(1e4, "T4"))


def test_a_mesh_that_will_not_fit_is_refused_with_its_size_and_one_of_unknown_size_let_through(monkeypatch):
    def source(cells, element):
        return SimpleNamespace(estimated_cells=lambda _: cells, element=element)

    monkeypatch.setattr("fingerslip.linear.resources.available_memory", lambda: 10**8)
    with pytest.raises(InputError, match=r"memory: .* about 0.6 GB \(assembly of about 1e\+05 tetrahedra 0.6 GB\)"):
        require_mesh_memory(source(1e5, "T4"), None)
    with pytest.raises(InputError, match=r"assembly of about 1e\+06 cells"):
        require_mesh_memory(source(1e6, "Q4"), None)
    require_mesh_memory(source(1e4, "T4"), None)
    monkeypatch.setattr("fingerslip.linear.resources.available_memory", lambda: 1)
    require_mesh_memory(source(None, None), None)


@pytest.mark.parametrize(
    ("case", "saves"),
    [
        ((11_858, 606, 4 * 600, 2), True),  # four runs of the paper's section
        ((11_858, 606, 600, 2), False),  # one of them
        ((70_197, 4_089, 300, 3), False),  # a run of the paper's fingertip in 3D
        ((70_197, 4_089, 64 * 300, 3), True),  # a large sweep of it
        ((70_197, 13_000, 64 * 300, 3), False),  # with a contact three times as fine
    ],
)
def test_a_basis_saves_time_where_many_steps_share_it(case, saves):
    assert basis_saves(*case) is saves


COLD = """
import dataclasses
import logging
logging.disable()
from numba.core import event
import fingerslip as fs
from fingerslip.model.model import ReducedBasis
from fingerslip.study.running.cost import compile_ahead, kinds_to_compile
from fingerslip.study.running.progress import StudyProgress
from physics.pressed_and_slid import models
named = models()
named["in a basis"] = dataclasses.replace(named["fingertip"], basis=ReducedBasis())
for name in ("in a basis", "quasi-static", "solid", "large strain"):
    model = named[name]
    assert bool(kinds_to_compile([model])) == (name != "solid")
    compile_ahead([model], StudyProgress())
    assert not kinds_to_compile([model])
    with event.install_recorder("numba:compile") as recorder:
        fs.simulate(model)
    assert len(recorder.buffer) < 10, recorder.buffer
"""


@pytest.mark.usefixtures("reports")
def test_compiling_comes_before_the_runs_with_an_estimate_and_where_all_is_compiled_nothing_is_said(
    write_study, tmp_path, monkeypatch
):
    monkeypatch.setattr(cost, "_has_cache", lambda _: True)
    heard = Told()
    cost.compile_ahead([push_and_slide()], heard)
    assert heard.told == []
    assert cost.compiling_words(cost.kinds_to_compile([push_and_slide()])) == ""
    study = write_study(block_values() | {"sweep": {}})
    monkeypatch.setattr(cost, "_has_cache", lambda _: False)
    heard, name = Told(), "compiling, once for each kind of model"
    takes = f"{name} (small strain): takes about 21 s"
    assert f"on top. Before the first run: {takes}." in check_plans(plan_studies([study])).note
    at_large_strain = cost.compiling_words([(2, "small"), (3, "finite")])
    assert at_large_strain == f"{name} (small strain, large strain in 3D): takes about 24 s"
    run_study(study, results_dir=tmp_path / "results", workers=1, progress=heard)
    assert heard.messages[0] == takes
    assert [entry for entry in heard.told if entry[0] in ("begin", name)][:2] == [("begin", name), (name, 0.0)]
    for file, name in cost._SAMPLES.values():
        assert f"\ndef {name}(" in (ROOT / "src" / "fingerslip" / file).read_text(), "it tells of caches"


@pytest.mark.slow
def test_a_small_block_compiles_nearly_all_that_a_model_of_its_kind_needs(tmp_path):
    paths = os.pathsep.join([str(ROOT / "tests"), *sys.path])
    environment = {**os.environ, "PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", COLD], env=environment, check=True)


def console(terminal, width=120):
    return Console(file=io.StringIO(), force_terminal=terminal, width=width)


def test_lines_come_at_the_start_then_every_half_minute_and_at_the_end(monkeypatch):
    now, log = [1000.0], console(terminal=False)
    monkeypatch.setattr(progress_module.time, "monotonic", lambda: now[0])
    with LineProgress(log) as shown:
        shown.begin(["a", "b"])
        for seconds, fraction in ((0, 0.004), (10, 0.1), (29.9, 0.2), (30, 0.25), (59, 0.5), (61, 0.6)):
            now[0] = 1000.0 + seconds
            shown.advance("a", fraction)
        shown.advance("b", 0.5)
        shown.finish("a", "done")
    assert log.file.getvalue().splitlines() == ["a: 0 %", "a: 25 %", "a: 60 %", "b: 50 %", "a: done"]


def test_a_terminal_gets_bars_anything_else_lines_and_both_messages_as_they_are():
    assert isinstance(progress_on_screen(console(terminal=True)), BarProgress)
    assert isinstance(progress_on_screen(console(terminal=False)), LineProgress)
    message = "block/[red]friction_coefficient-0.2[/red]: unchanged, and longer than the log is wide"
    for make in (LineProgress, BarProgress):
        log = console(terminal=False, width=40)
        make(log).say(message)
        assert log.file.getvalue() == f"{message}\n"


def state(bars):
    return {task.description: task.completed for task in bars._bars.tasks}


def test_bars_show_each_run_and_the_sum_of_all_of_each_study():
    with BarProgress(console(terminal=True)) as bars:
        bars.begin(["a", "b", "c"])
        assert state(bars) == {"all runs": 0.0}
        for name, fraction in (("a", 0.5), ("b", 0.25), ("a", 0.75)):
            bars.advance(name, fraction)
        assert state(bars) == {"all runs": 1.0, "a": 0.75, "b": 0.25}
        bars.finish("a", "done")
        bars.finish("c", "failed")
        assert state(bars) == {"all runs": 2.25, "a: done": 1.0, "b": 0.25, "c: failed": 1.0}
        assert next(task for task in bars._bars.tasks if task.description == "all runs").total == 3.0
        bars.begin(["a", "b"])
        bars.advance("a", 0.5)
        newest = [task.completed for task in bars._bars.tasks][-2:]
        assert newest == [0.5, 0.5], "the sum of the second study, and its first run"


def test_bars_of_a_single_run_need_no_sum_are_drawn_and_stopped_and_silence_is_silent(capfd):
    screen = console(terminal=True)
    with BarProgress(screen) as bars:
        bars.begin(["a"])
        bars.advance("a", 0.5)
        assert state(bars) == {"a": 0.5}
        assert bars._bars.live.is_started
    assert not bars._bars.live.is_started
    assert "50 %" in screen.file.getvalue()
    with StudyProgress() as shown:
        shown.begin(["a"])
        shown.advance("a", 0.5)
        shown.finish("a", "done")
        shown.say("anything")
    assert capfd.readouterr() == ("", "")
