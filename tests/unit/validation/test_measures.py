"""Numbers read from histories whose slip is known, and Cordova Bulens et al. (2023) beside ours."""

import dataclasses
import functools
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from fingerslip.detect.evaluation.crossval import READINGS, Unseen
from fingerslip.detect.evaluation.scores import event_scores_of, frame_scores_of
from fingerslip.detect.features import MotionSettings
from fingerslip.detect.labels import Onsets
from fingerslip.detect.samples import Sampling
from fingerslip.detect.synthetic import SyntheticSensor, synthetic_slides
from fingerslip.detect.trials import Trial, write_trials
from fingerslip.errors import InputError
from fingerslip.published import published_set
from fingerslip.results import RunResult
from fingerslip.slip import EventSettings, find_events, slide_window
from fingerslip.validation import measures, sensor
from fingerslip.validation.evidence import Work
from fingerslip.vision.tracks import make_tracks
from places import ROOT
from unit import synthetic
from unit.filmed import filmed_history

SETTINGS = EventSettings()


def prepared(**process):
    history = synthetic.make(synthetic.Process(**process))
    return history, slide_window(history)


def measured(history):
    return measures.measure(RunResult("run", {}, find_events(history)), history)


def reversed_slip(history):
    """Let slip begin in the centre: the nodes in contact swap their motion from the edge inwards."""
    inside = np.abs(history["contact_position"].values[:, 0]) <= synthetic.HALF_WIDTH + 1e-9
    count = int(inside.sum())
    half = count // 2
    order = np.concatenate((np.arange(half)[::-1], np.arange(half, count)[::-1], np.arange(count, inside.size)))
    swapped = history["contact_displacement"].values[:, order]
    return history.assign(contact_displacement=(history["contact_displacement"].dims, swapped))


def test_centre_leaves_after_the_edges_by_the_travel_of_slip_and_before_them_where_slip_begins_there():
    history, window = prepared(jump=False)
    # The medians of the inner and outer quarters lie at 1/8 and 7/8 of the half width.
    assert measures.centre_after_edge(history, window, SETTINGS) == pytest.approx(0.75 * (1.71 - 1.30), rel=0.05)
    assert measures.centre_after_edge(reversed_slip(history), window, SETTINGS) < -0.2
    assert measures.centre_after_edge(*prepared(nodes=3), SETTINGS) is None, "too few for quarters"


def test_largest_acceleration_falls_with_depth_leaves_the_transition_out_and_vibration_counts_within_its_time():
    largest = measures.largest_accelerations(*prepared(), 1.1)
    assert largest["FA-I"] > largest["SA-I"] > largest["SA-II"] > largest["FA-II"] > 0.0
    # The synthetic signal decays with depth over 2 mm, from 0.5 mm to 3 mm.
    assert largest["FA-I"] / largest["FA-II"] == pytest.approx(np.exp(2.5 / 2.0))
    early, late = (
        measures.largest_accelerations(*prepared(peaks={1.53: 0.054, 1.71: 0.1}), start) for start in (1.0, 1.1)
    )
    assert early["FA-I"] > 3.0 * late["FA-I"]
    during, later = (measures.rms_after(*prepared(peaks={1.80: 0.2}), start) for start in (1.75, 1.85))
    assert during > 100.0 * later


def test_density_grows_to_overall_slip_and_travel_is_counted_in_friction_times_indentation_either_way():
    history, window = prepared()
    steady = measures.densities(history, window, 1.71)
    assert steady.growth["FA-I", "A"] == pytest.approx(1.71**2, rel=1e-6)
    assert max(steady.range_after.values()) < 1e-9
    assert steady.mean_after["FA-II", "B"] / steady.mean_after["FA-II", "A"] == pytest.approx(1.2 / 0.8)
    fading = history["strain_energy_density"] * np.where(history["time"] > 1.8, 0.5, 1.0)[:, None]
    falling = measures.densities(history.assign(strain_energy_density=fading), window, 1.71)
    assert min(falling.range_after.values()) > 0.5
    way = history["counterface_displacement"] * xr.DataArray([-1.0, 1.0], dims="component")
    back = history.assign(counterface_displacement=way.transpose(*history["counterface_displacement"].dims))
    for slide in (history, back):
        assert measures.travel_over_friction_depth(slide, window, 1.71) == pytest.approx(0.71 * 3.0 / (0.6 * 1.5))


def test_run_in_3d_is_read_at_the_eight_reference_nodes():
    history, _ = prepared(jump=False)
    names = [f"skin-{line}{number}" for line in "hv" for number in range(1, 8)]
    # Sites of the synthetic history from the 6th of FA-I on; the reference nodes 2 to 5 of both lines follow the plate
    # up to a time of their own, the others never do.
    sites = [*history["site"].values[:5], *names, *history["site"].values[19:]]
    displacement = history["displacement"].values.copy()
    plate = history["counterface_displacement"].values[:, 0, 0]
    for number, name in enumerate(names):
        until = 1.2 + 0.05 * number if name in measures.REFERENCE_NODES else 1.0
        displacement[:, 5 + number, 0] = np.minimum(plate, 3e-3 * (until - 1.0))
    named = history.assign_coords(site=sites).assign(displacement=(history["displacement"].dims, displacement))
    found = measures.measure_3d(RunResult("run", {}, find_events(history)), named)
    first, last = 1.2 + 0.05, 1.2 + 0.05 * 11
    assert found.run.events.displacement.incipient == pytest.approx(first + 50e-6 / 3e-3, abs=1e-3)
    assert found.run.events.displacement.overall == pytest.approx(last + 50e-6 / 3e-3, abs=1e-3)
    assert found.node_range("incipient") == pytest.approx(50e-6 / 3e-3, abs=1e-3)
    assert found.run.events.acceleration.recorded


def test_run_is_measured_with_its_peaks_and_without_overall_slip_or_slide_has_no_number_that_needs_it():
    found = measured(prepared()[0])
    assert found.overall_peak.time == pytest.approx(1.71, abs=6e-3)
    assert found.incipient_peak.time == pytest.approx(1.53, abs=6e-3)
    assert found.middle_peaks == 1
    assert found.travel == pytest.approx(0.71 * 3.0 / 0.9, abs=0.05)
    found = measured(prepared(edge=1.3, centre=9.0, peaks={})[0])
    assert (found.densities, found.rms_after, found.travel, found.overall_peak) == (None,) * 4
    assert found.middle_peaks == 0
    found = measured(prepared(phases=(("press", 0.0, 1.0), ("hold", 1.0, 2.0)))[0])
    assert (found.largest_acceleration, found.centre_after_edge) == ({}, None)


GOOD = (
    sensor.SensorMeasures(True, "2 mm", 1.0, 5, 1.2, 1e-3),
    sensor.SensorMeasures(True, "3 mm", 1.0, 3, 1.1, 2e-3),
    sensor.SensorMeasures(False, "2 mm", 0.5, 9, 1.0, 0.1e-3),
    sensor.SensorMeasures(False, "3 mm", 0.5, 9, 1.0, 0.4e-3),
)


def test_all_statements_hold_where_the_numbers_are_those_of_the_paper():
    rows = sensor.rows_of_sensor(GOOD)
    assert [row.verdict for row in rows] == ["holds"] * 4 + ["agrees"]
    assert [row.ours for row in rows] == pytest.approx([1.0, 3.0, 1.1, 0.2, 5.0])
    assert all(row.source.startswith("bulens2023") for row in rows)
    none = tuple(dataclasses.replace(one, spread=None, ahead=None, before_centre=None, cycles=None) for one in GOOD)
    rows = sensor.rows_of_sensor(none, "large strain")
    assert {row.verdict for row in rows} == {"not found"}
    assert {row.basis for row in rows} == {"large strain"}


@pytest.mark.parametrize(
    ("run", "change", "row", "verdict"),
    [
        (0, {"before_centre": 0.9}, 0, "fails"),
        (0, {"cycles": 1}, 1, "fails"),
        (0, {"ahead": 0.9}, 2, "fails"),
        (0, {"spread": 0.5e-3}, 3, "holds"),
        (3, {"spread": 1.5e-3}, 3, "fails"),
    ],
)
def test_one_indentation_that_differs_makes_a_statement_fail(run, change, row, verdict):
    worse = [dataclasses.replace(one, **change) if number == run else one for number, one in enumerate(GOOD)]
    assert sensor.rows_of_sensor(worse)[row].verdict == verdict


def test_a_run_is_measured_from_its_history_and_without_the_study_the_error_names_it(tmp_path):
    history = filmed_history()
    swept = {"tactip.skin.ridges.enabled": True, "programme.0.press.depth": "2 mm"}
    found = sensor.measure_sensor(SimpleNamespace(events=find_events(history), swept=swept), history)
    assert (found.ridged, found.depth, found.before_centre) == (True, "2 mm", 1.0)
    assert (found.ahead, found.spread) == (pytest.approx(1.0), pytest.approx(0.0))
    with pytest.raises(InputError, match=r"ridged_vs_smooth.yaml: is not there, validate needs the study"):
        sensor.sensor_rows(Work(tmp_path, tmp_path))


LABELS = {name: Onsets(2.0, 6.0) for name in ("a", "b", "c")}


def unseen(*, gross):
    """Return findings that are 0.4 s early on average."""
    found = {"a": Onsets(1.5, gross), "b": Onsets(1.6, gross), "c": Onsets(1.7, gross)}
    scores = event_scores_of(found, LABELS, dict.fromkeys(LABELS, 1.0))
    return Unseen(dict.fromkeys(READINGS, found), dict.fromkeys(READINGS, scores), np.zeros((3, 3, 3), dtype=np.intp))


def test_every_published_number_and_statement_has_a_row_in_both_readings():
    rows = sensor.rows_of_pouring(unseen(gross=None), "section")
    assert len(rows) == 12
    error, spread, lead, _, before, statement = rows[:6]
    assert error.quantity == "onset error while pouring, section, forest (single frames)"
    assert (error.ours, error.published, error.unit) == (pytest.approx(-0.4), -0.418, "s")
    interval = unseen(gross=None).scores[READINGS[0]].error
    assert error.uncertainty == pytest.approx((interval.high - interval.low) / 2.0) != 0.0
    assert error.verdict == "agrees"
    assert (spread.ours, spread.verdict) == (pytest.approx(0.1), "not judged")
    assert (lead.ours, lead.verdict) == (pytest.approx(4.4), "misses")
    assert (before.ours, before.verdict) == (1.0, "agrees")
    assert (statement.ours, statement.verdict) == (0.0, "holds")
    assert rows[6].quantity.endswith("(detector)")
    statement = sensor.rows_of_pouring(unseen(gross=3.0), "in 3D")[5]
    assert (statement.ours, statement.verdict) == (1.0, "fails")


def test_shipped_rows_are_those_of_the_studies_and_have_every_split():
    for rows, count in ((sensor.pouring_rows, 24), (sensor.detection_rows, 3 * len(NAMES) + 2 * SPLIT + 2)):
        stored = rows(Work(ROOT / "studies", ROOT / "results"))
        assert "the studies are the same" in stored.origin
        assert len(stored.rows) == count


def test_rows_are_computed_stored_and_read_back(tmp_path, monkeypatch):
    assert sensor.pouring_rows(Work(tmp_path, tmp_path)).rows == ()
    monkeypatch.setattr(Work, "run", lambda *_: ())
    for name in ("filmed_trials", "trials_of"):
        monkeypatch.setattr(sensor, name, lambda study, _: study)
    found = {sensor.POURING: unseen(gross=None), sensor.POURING_3D: unseen(gross=3.0)}
    monkeypatch.setattr(sensor, "pouring_of", lambda *names, **_: found[names])
    made = sensor.pouring_rows(Work(tmp_path, tmp_path), compute=True)
    assert sensor.pouring_rows(Work(tmp_path, tmp_path)).rows == made.rows
    section, space = (
        sensor.rows_of_pouring(unseen(gross=None), "section"),
        sensor.rows_of_pouring(unseen(gross=3.0), "in 3D"),
    )
    assert made.rows == section + space


NAMES = ("forest", "svm", "boosting", "logistic")


# A row for each number; a statement; two classifiers that are not judged.
SPLIT = len(published_set("bulens2023_detection-numbers").values) + 1 + 2
MATRICES = np.tile([[90, 10, 0], [0, 95, 5], [0, 5, 45]], (20, 1, 1))


def scores(matrices):
    return dict.fromkeys(NAMES, frame_scores_of(matrices))


@functools.cache
def right():
    return scores(MATRICES)


def test_every_published_number_and_statement_has_rows_in_both_splits():
    rows = sensor.rows_of_detection(sensor.Detection(right(), right()))
    assert len(rows) == 2 * SPLIT
    accuracy = rows[0]
    assert accuracy.quantity == "accuracy, forest, simulated slides, frames split 90 to 10"
    assert (accuracy.ours, accuracy.verdict) == (pytest.approx(230 / 250), "misses")
    recall = next(row for row in rows if row.quantity.startswith("recall of no-slip"))
    assert (recall.ours, recall.published) == (pytest.approx(0.9), 1.0)
    assert [row.verdict for row in rows if row.statement] == ["holds", "holds"]
    wrong = MATRICES.copy()
    wrong[0, 2, 0] = 1  # slip that is taken for rest
    rows = sensor.rows_of_detection(sensor.Detection(scores(wrong), right()))
    assert [row.verdict for row in rows if row.statement] == ["fails", "holds"]
    rows = sensor.rows_of_detection(sensor.Detection(right(), right(), {"a direction not seen": right()}))
    own = [row for row in rows if row.quantity.endswith("a direction not seen")]
    assert [row.quantity.split(",")[1].split()[0] for row in own] == ["forest", "boosting", "logistic", "svm"]
    assert [row.published for row in own] == [0.9746] * 3 + [0.843]
    # The paper has neither boosting nor logistic regression: they are not judged by its forest.
    assert [row.verdict for row in own] == ["misses", "not comparable", "not comparable", "misses"]


def slide_seen(slips, ahead):
    """Return tracks of a middle marker and two rings inside and outside; `slips` are frames at which the skin slips."""
    frames = np.arange(300)[:, None]
    inside = np.clip(frames - 100, 0, None) * np.array([[ahead, 1.0, 1.0]])
    outside = np.where(frames >= np.array([slips]), 5.0, 0.0)
    along = np.concatenate([inside, outside], axis=1)
    position = np.stack([along, np.zeros_like(along)], axis=2)
    kinds = ["internal"] * 3 + ["external"] * 3
    return make_tracks(position, frames[:, 0] / 100.0, units="px", kind=kinds, ring=[0, 1, 2] * 2, angle=[0.0] * 6)


def test_statements_on_markers_are_judged_in_slides_in_3d_by_the_worst_indentation(tmp_path):
    label = {"external_markers": Onsets(1.2, 2.5)}
    deep, flat = {"indentation": 3e-3}, {"indentation": 2e-3}
    slides = [
        Trial("a", slide_seen((250, 180, 120), 1.5), label, deep),
        Trial("b", slide_seen((250, 260, 120), 0.9), label, flat),
        Trial("c", slide_seen((250, 240, np.inf), 1.0), label, flat),
    ]
    measured = sensor.measure_trials(write_trials(slides, tmp_path / "slides", "Slides"))
    assert measured == {"centre-last": pytest.approx(0.5), "central-marker-ahead": pytest.approx(0.95)}
    rows = sensor.rows_of_detection(sensor.Detection(right(), right(), {}, measured))
    judged = {row.quantity: row.verdict for row in rows if row.quantity.endswith("in 3D")}
    assert list(judged.values()) == ["fails", "fails"]
    assert len(rows) == 2 * SPLIT + 2


@pytest.mark.slow
def test_rows_of_detectors_are_computed_stored_and_read_back(tmp_path, monkeypatch):
    slides = synthetic_slides((3e-3, 4e-3), directions=1, repeats=5, travel=5e-3)
    trials = write_trials(slides, tmp_path / "slides", "Analytic")
    monkeypatch.setattr("fingerslip.study.trials.simulate.simulate_trials", lambda *_, **__: trials)
    monkeypatch.setattr("fingerslip.detect.samples.Sampling", lambda: Sampling(least=0.0))
    monkeypatch.setattr("fingerslip.detect.features.MotionSettings", lambda: MotionSettings(20, 5))

    def found(begun):
        begun.parts.write("forest", 1, {"rows": np.arange(3)})
        return sensor.Detection(right(), right())

    monkeypatch.setattr(sensor, "detection_of", found)
    work = Work(ROOT / "studies", tmp_path)
    assert sensor.detection_rows(work).rows == ()
    made = sensor.detection_rows(work, compute=True)
    assert sensor.detection_rows(work).rows == made.rows
    assert {path.name for path in tmp_path.iterdir()} == {"slides", "detection.json"}


@pytest.mark.slow
def test_every_condition_of_the_paper_is_left_out_once(tmp_path, monkeypatch):
    filmed = SyntheticSensor(frame_rate=67.0, rest_frames=100)
    slides = synthetic_slides((3e-3, 4e-3), directions=2, repeats=5, sensor=filmed, travel=14e-3)
    monkeypatch.setattr("fingerslip.detect.samples.Sampling", lambda: Sampling(least=0.0))
    trials = write_trials(slides, tmp_path / "slides", "Analytic")
    found = sensor.detection_of(sensor.begun_detection(trials, 1))
    assert len(found.left_out) == 3
    for by_name in found.left_out.values():
        assert {name: one.matrix.sum() for name, one in by_name.items()} == dict.fromkeys(
            NAMES, found.by_trial["forest"].matrix.sum()
        )
