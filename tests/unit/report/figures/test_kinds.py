"""Every kind of figure that is named is drawn by something, and every look that is named is there."""

from __future__ import annotations

from fingerslip.report.figures.catalogue import RUN_DRAWERS, STUDY_DRAWERS
from fingerslip.report.figures.kinds import OF_RUNS, OF_STUDIES, STYLES
from fingerslip.report.figures.style import LOOKS


def test_kinds_are_those_that_can_be_drawn() -> None:
    assert list(OF_RUNS) == list(RUN_DRAWERS)
    assert list(OF_STUDIES) == list(STUDY_DRAWERS)
    assert not OF_RUNS.keys() & OF_STUDIES.keys()
    assert all((*OF_RUNS.values(), *OF_STUDIES.values()))


def test_styles_are_the_looks() -> None:
    assert list(LOOKS) == list(STYLES)
