"""Runs are drawn as the report would draw them, or left to the report."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fingerslip.report.figures import style as figures
from fingerslip.report.page import pictures as page
from fingerslip.report.page.content import MOST_RUNS
from fingerslip.study.running import runner
from fingerslip.study.running.pictures import Drawing, draw_runs, drawings_of
from fingerslip.study.running.plan import plan_study
from fingerslip.study.running.prepare import prepare
from fingerslip.study.running.progress import SilentProgress
from fingerslip.study.running.runner import compute_jobs, write_up
from fingerslip.study.storage.reporting import report_again
from unit.study.block import FRICTIONS, block_values

Write = Callable[..., Path]
NAMES = [f"friction_coefficient-{friction}" for friction in FRICTIONS]


def planned(path: Path) -> tuple[Any, Any]:
    plan = plan_study(path, path.parent / "results")
    return plan, prepare(plan, plan.runs)


def contents(folder: Path) -> dict[str, bytes]:
    files = [folder / "report.html", *(folder / "figures").iterdir()]
    return {path.name: path.read_bytes() for path in files}


def test_runs_in_detail_are_drawn_and_the_first_model_of_each_mesh(write_study: Write) -> None:
    plan, jobs = planned(write_study())
    drawings = drawings_of(plan, jobs)
    assert list(drawings) == NAMES
    assert all(one.contact for one in drawings.values())
    assert [one.model for one in drawings.values()] == [True] + [False] * (len(NAMES) - 1)
    resumed = drawings_of(plan, jobs[1:])
    assert resumed[jobs[1].run.name] == Drawing("Block on a plate", contact=True, model=True)


def test_of_many_runs_only_those_are_drawn_that_a_report_shows(write_study: Write) -> None:
    frictions = [0.1 + 0.01 * number for number in range(MOST_RUNS + 2)]
    plan, jobs = planned(write_study(block_values() | {"sweep": {"contact.friction_coefficient": frictions}}))
    first, later = jobs[0].run.name, jobs[MOST_RUNS].run.name
    assert drawings_of(plan, jobs) == {first: Drawing("Block on a plate", contact=True, model=True)}
    late = drawings_of(plan, jobs[MOST_RUNS:])
    assert late == {later: Drawing("Block on a plate", contact=False, model=True)}


def test_nothing_is_drawn_of_samples(write_study: Write) -> None:
    plan, jobs = planned(write_study())
    sampled = dataclasses.replace(plan, study=SimpleNamespace(sample=object()))
    assert drawings_of(sampled, jobs) == {}


@pytest.mark.slow
def test_report_and_figures_are_the_same_whether_runs_are_drawn_beside_or_at_the_end(
    write_study: Write, simulated: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figures, "_DOTS_PER_INCH", 20)
    plan, jobs = planned(write_study())
    compute_jobs(plan, jobs, 1, SilentProgress())
    pictures = draw_runs(jobs, drawings_of(plan, jobs), lambda: False)
    assert sorted(pictures) == NAMES
    monkeypatch.setattr(runner, "write_report", only_drawn(runner.write_report))
    folder = write_up(plan, (), pictures).folder
    beside = contents(folder)
    report_again(folder)
    assert contents(folder) == beside
    assert f"section-{NAMES[0]}.png" in beside
    assert f"{NAMES[2]}-slip-map.png" in beside


def only_drawn(write: Callable[..., None]) -> Callable[..., None]:
    """Return the writer of reports; it fails where it draws a run that is drawn already."""

    def write_report(study: Any, pictures: Any) -> None:
        def again(*_: Any) -> None:
            raise AssertionError

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("fingerslip.report.page.assemble.run_pictures", again)
            patch.setattr("fingerslip.study.running.build.build_mesh", again)
            write(study, pictures)

    return write_report


def test_what_cannot_be_drawn_is_left_to_the_report(
    write_study: Write, simulated: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    plan, jobs = planned(write_study())
    compute_jobs(plan, jobs, 1, SilentProgress())

    def failing(run: Any, *_: Any, **__: Any) -> None:
        if run.name == NAMES[1]:
            raise ZeroDivisionError

    monkeypatch.setattr(page, "draw_ahead", failing)
    assert list(draw_runs(jobs, drawings_of(plan, jobs), lambda: False)) == [NAMES[0], NAMES[2]]


def test_a_study_that_is_being_ended_draws_no_more(write_study: Write) -> None:
    plan, jobs = planned(write_study())
    assert draw_runs(jobs, drawings_of(plan, jobs), lambda: True) == {}
