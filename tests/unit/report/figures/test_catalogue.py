"""Figures by name: which runs they can show, and that all of them can be drawn."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.report.figures.catalogue import RUN_FIGURES, STUDY_DRAWERS, draw_of_run, draw_of_study
from fingerslip.report.figures.kinds import OF_RUNS, OF_STUDIES, STYLES, RunSubject, StudySubject
from fingerslip.report.figures.style import LOOKS
from fingerslip.slip import Events
from unit.report.page.contents import two_runs
from unit.report.scenes import block_history
from unit.synthetic import Process, make

PLANE = block_history("Q4")

CONTENT = two_runs()


@pytest.mark.parametrize("kind", ["deformed", "slip-map", "forces", "energy", "displacement", "strain-energy-density"])
def test_figures_of_a_section_are_drawn(kind: str) -> None:
    history = PLANE if kind == "deformed" else make(Process())
    assert draw_of_run(kind, RunSubject(history, Events())).axes


@pytest.mark.parametrize("kind", ["latency", "events", "slip-maps", "force-ratios"])
def test_figures_of_a_study_are_drawn(kind: str) -> None:
    subject = StudySubject(
        CONTENT.study.runs,
        CONTENT.titled_histories(),
        CONTENT.titled_events(),
        starts={"0.4": 1.0, "0.6": 1.0},
        path="contact.friction_coefficient",
    )
    assert draw_of_study(kind, subject).axes


def test_figures_of_the_other_dimension_are_refused_with_those_that_fit() -> None:
    with pytest.raises(InputError, match="'cut' shows runs of three, this one has two dimensions, needs one of"):
        draw_of_run("cut", RunSubject(PLANE, Events()))
    with pytest.raises(InputError, match="'slip-map' shows runs of two, this one has three dimensions"):
        draw_of_run("slip-map", RunSubject(block_history("T4"), Events()))


def test_without_a_sweep_there_is_no_axis() -> None:
    with pytest.raises(InputError, match="'latency' has nothing on its axis, needs a study with a sweep"):
        draw_of_study("latency", StudySubject((), {}, {}))


def test_kinds_are_those_that_can_be_drawn() -> None:
    assert OF_RUNS.keys() <= RUN_FIGURES.keys()
    assert list(OF_STUDIES) == list(STUDY_DRAWERS)
    assert not OF_RUNS.keys() & OF_STUDIES.keys()
    assert all((*OF_RUNS.values(), *OF_STUDIES.values()))


def test_styles_are_the_looks() -> None:
    assert list(LOOKS) == list(STYLES)
