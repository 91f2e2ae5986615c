"""What of a page may be quoted, and how sure it is: only what holds for the study."""

import dataclasses

import pytest

from fingerslip.history import phase_times
from fingerslip.report.page.answer import quotable
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.results import RunResult
from fingerslip.slip import Events, SlipEvents
from fingerslip.uncertainty import Convergence, Series
from unit.report.page.contents import content_of
from unit.report.scenes import block_history

SLIPPED = Events(SlipEvents(incipient=0.06, overall=0.1), acceleration=SlipEvents(incipient=0.07, overall=0.1))
SETTLED, AWAY = (
    Convergence("time", "s", 1.0, {"step": Series("step", (1.0, 0.5, 0.25), values)})
    for values in ((1.0, 1.0, 1.0), (1.0, 1.2, 1.1))
)
FINGER = tuple(
    ShownValue(path, value, source)
    for path, value, source in (
        ("fingertip.preset", "wang2014-2d", "study file"),
        ("fingertip.formulation", "plane_stress", "assumed"),
        ("fingertip.depth", "1 mm", "assumed"),
        ("kinematics", "small", "default"),
    )
)


def content(*runs, element="Q4", values=FINGER, **more):
    history = block_history(element)
    start = phase_times(history, "slide")[0][0]
    names = [run.name for run in runs]
    return content_of(runs, dict.fromkeys(names, history), values=values, starts=dict.fromkeys(names, start), **more)


def test_a_section_of_a_finger_without_error_bars_says_all_that_is_no_result():
    box = quotable(content(RunResult("a", {}, SLIPPED)))
    assert box["Quote"].endswith("State friction, speed.")
    assert box["Do not quote"] == (
        "incipient slip from acceleration peaks, which moves with mesh and step; forces as those of a whole body: the "
        "section is 1 mm deep; counts of spikes: thresholds are assumed."
    )
    assert box["How sure"] == (
        "Numerical uncertainty is not known yet. Large strain or plane strain move overall slip of this finger by 0.2 "
        "to 0.8 s of 0.7 s at 1.5 mm and 3 mm/s. 2 values are assumed."
    )
    assert len(" ".join((*box, *box.values())).split()) <= 90


def test_times_of_a_run_that_is_too_coarse_are_not_quoted():
    box = quotable(content(RunResult("a", {}, SLIPPED, numbers={"slide_records": 10})))
    assert "Quote" not in box
    assert box["Do not quote"].startswith("times of slip, for which step or mesh is too coarse")


def test_peaks_are_quoted_only_where_they_have_converged_in_all_runs():
    settled, away = ({"acceleration.incipient": each} for each in (SETTLED, AWAY))
    runs = [RunResult(name, {}, SLIPPED, convergence=known) for name, known in (("a", settled), ("b", away))]
    assert "acceleration peaks" in quotable(content(*runs))["Do not quote"]
    assert "acceleration peaks" not in quotable(content(runs[0], values=()))["Do not quote"]


def test_what_was_studied_and_what_has_not_converged_is_named():
    known = {"slip.overall": SETTLED, "slip.latency": AWAY, "acceleration.incipient": SETTLED}
    studied = RunResult("a", {}, SLIPPED, uncertainty={"slip.latency": 0.1}, convergence=known)
    box = quotable(content(studied, RunResult("b", {}, Events(SLIPPED.slip)), values=()))
    assert box["Quote"].endswith("State friction, speed, ±.")
    assert "acceleration peaks" not in box["Do not quote"], "it has converged"
    assert (
        box["How sure"]
        == "± is numerical error alone (time steps; 1 of 2 runs). Not converged in some run, quote it only "
        "with its ±: latency."
    )
    again = quotable(content(dataclasses.replace(studied, convergence={"acceleration.incipient": AWAY})))
    assert "acceleration peaks" in again["Do not quote"]


@pytest.mark.parametrize("events", [Events(), Events(SlipEvents(incipient=0.06))])
def test_where_nothing_slips_there_is_nothing_to_quote(events):
    assert quotable(content(RunResult("a", {}, events))) == {}
    assert quotable(dataclasses.replace(content(RunResult("a", {}, SLIPPED)), starts={})) == {}
