"""Table 2 of Wang, Chathuranga & Hirai (2014) from the shipped study, and what has to be true of any such slide.

Tolerances: the published times are printed to two decimals; over meshes, steps, contact stiffness and damping our times
of overall and three-quarter slip are known to less than 10 ms, and the smaller step of overall slip from one phalanx to
the next moves by 1.2 ms (results/reference/convergence.md and validation.json, of `fingerslip converge` and
`fingerslip validate`).
"""

import dataclasses
import json

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.history import read_history
from fingerslip.study.definition.runs import plan_study
from fingerslip.study.running.build import build_model
from fingerslip.study.running.runner import run_study
from fingerslip.validation.measures import measure
from places import ROOT

pytestmark = pytest.mark.slow

STUDIES = ROOT / "studies"
RESOLUTION = 0.010
SPREAD = 0.010
STEP_SPREAD = 0.0012
VARIANTS = ("original", "flattened", "scaled")
FRICTIONS = (0.2, 0.4, 0.6, 0.8)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return tmp_path_factory.mktemp("results")


@pytest.fixture(scope="module")
def table2(results):
    return run_study(STUDIES / "wang2014_table2.yaml", results_dir=results, workers=2)


@pytest.fixture(scope="module")
def friction(results):
    return run_study(STUDIES / "wang2014_friction.yaml", results_dir=results, workers=2)


@pytest.fixture(scope="module")
def phalanges(table2):
    return {run.swept["fingertip.phalanx.variant"]: measure(run, history_of(table2, run)) for run in table2.runs}


def history_of(result, run):
    return read_history(result.folder / run.name / "history.nc")


def stored_numbers(result, run):
    stored = json.loads((result.folder / run.name / "events.json").read_text())
    return stored["numbers"]


def events(phalanges, variant):
    return phalanges[variant].run.events


def test_overall_slip_of_the_original_phalanx_is_where_it_was_calibrated(phalanges):
    assert events(phalanges, "original").overall == pytest.approx(1.71, abs=RESOLUTION + SPREAD)
    # Not calibrated, and 11 ms later than the published 1.63 to 1.65 s: what the reference run gives.
    assert events(phalanges, "original").three_quarter == pytest.approx(1.661, abs=SPREAD)


@pytest.mark.parametrize("time", [fs.TimeStepping(20e-3, -0.41421), fs.Adaptive(50e-3, alpha=-0.41421)])
def test_slip_times_hardly_depend_on_the_records(phalanges, time):
    """Interpolated as a fraction, overall slip came 10 and 39 ms later with these records."""
    run = plan_study(STUDIES / "wang2014_table2.yaml", "none").runs[0]
    coarse = fs.find_events(fs.simulate(dataclasses.replace(build_model(run), time=time, basis=None)))
    for name, allowed in (("noticed", 3e-3), ("three_quarter", 2e-3), ("overall", 1e-3)):
        assert coarse.slip.time(name) == pytest.approx(events(phalanges, "original").slip.time(name), abs=allowed)


def test_overall_slip_comes_later_with_flattened_and_latest_with_scaled_from_the_edges(phalanges):
    moments = [events(phalanges, variant).overall for variant in VARIANTS]
    assert None not in moments
    # Both steps have to be clear of their own spread.
    assert np.diff(np.array(moments, dtype=float)).min() > STEP_SPREAD
    for one in phalanges.values():
        # The tolerance of accumulated slip delays it by up to 7 ms, the peak stands on a step of 5 ms.
        assert one.run.events.acceleration.overall == pytest.approx(one.run.events.overall, abs=0.012)
        assert one.centre_after_edge > 0.1
        assert one.largest_acceleration["FA-I"] > one.largest_acceleration["FA-II"], "felt at the surface"


def test_energy_is_accounted_for(table2):
    for run in table2.runs:
        history = history_of(table2, run)
        work = float(np.abs(history["external_work"]).max())
        assert float(np.abs(history["energy_imbalance"]).max()) < 1e-9 * work
        dissipated = history["friction_dissipation"].values
        assert np.diff(dissipated).min() >= -1e-12 * dissipated[-1]


def test_slip_moments_are_linear_in_friction(friction):
    read = {run.swept["contact.friction_coefficient"]: run.events for run in friction.runs}
    for event in ("incipient", "overall"):
        times = [getattr(read[friction], event) for friction in FRICTIONS]
        assert np.corrcoef(FRICTIONS, times)[0, 1] ** 2 > 0.99


def test_sliding_force_is_friction_times_normal_force(table2, friction):
    for result in (table2, friction):
        for run in result.runs:
            ratio = stored_numbers(result, run)["friction_force_ratio_end_of_slide"]
            assert ratio == pytest.approx(run.swept.get("contact.friction_coefficient", 0.6), rel=1e-9)
