"""The answer: plain sentences with the numbers of what was run, beside what is published; what may be quoted of it."""

import dataclasses
from pathlib import Path

import pytest

from fingerslip.history import phase_times
from fingerslip.published import PublishedSet, PublishedValue, published_set
from fingerslip.report.page.answer import answer, definitions, published_rows_beside, quotable
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.results import RunResult, StudyResult
from fingerslip.slip import Events, EventSettings, PeakSettings, SlipEvents
from fingerslip.slip.front import EdgeContact
from fingerslip.slip.windows import READINGS
from fingerslip.uncertainty import Convergence, Series
from unit.report.page.contents import content_of
from unit.report.scenes import block_history

TABLE2 = published_set("wang2014-table2")
CALIBRATED = {"fingertip.section": "sagittal", "fingertip.sagittal.half_height": "0.007 m", "kinematics": "small"}


def run(name, overall, incipient=1.1, **more):
    events = Events(slip=SlipEvents(incipient=incipient, overall=overall))
    return RunResult(name, more.pop("swept", {}), events, **more)


def study(*runs, **more):
    return StudyResult(Path("s"), (), runs, **more)


def test_a_single_run_says_when_it_slips_and_how_long_there_is_to_react():
    said = answer(study(run("a", 1.71, uncertainty={"slip.overall": 0.004})), {"a": 1.0})
    first, second = said  # and no word about error bars, which are there
    assert first.startswith("The whole contact slips 0.710 s after the slide begins, 1.710 s after the start of the ")
    assert first.endswith("run (± 4 ms, numerical).")
    assert second == "From incipient slip on, 610 ms are left to react."
    doubted = dataclasses.replace(run("a", 1.71, uncertainty={"slip.overall": 0.004}), doubts=("contacts.0: coarse",))
    assert answer(study(doubted), {"a": 1.0})[0].endswith("run (± 4 ms, numerical, doubtful).")
    bars, values = {"slip.latency": 0.03, "slip.overall": 1e-4}, {"programme.2.slide.speed": "0.01 m/s"}
    first, second = answer(study(run("a", 1.71, uncertainty=bars, values=values)), {"a": 1.0})
    assert first.endswith("(± <1 ms, numerical).")
    assert second == "From incipient slip on, 610 ± 30 ms are left to react at 10 mm/s."
    numbers = {"overall_travel_m": 2.13e-3, "latency_travel_m": 1.1e-3}
    values = {"time.scheme": "quasi_static"}
    said = answer(study(run("a", 1.71, numbers=numbers, values=values)), {"a": 1.0})
    assert said[0].startswith("The whole contact slips after 2.13 mm of travel, 0.710 s after the slide begins")
    assert said[1] == "From incipient slip on, the plate travels 1.10 mm, 610 ms at the speed of this slide."
    assert not any("react" in sentence for sentence in said)
    round_face = {**values, "contact.counterface.cylinder.radius": "15 mm"}
    said = answer(study(run("a", 1.71, numbers=numbers, values=round_face)), {"a": 1.0})
    assert said[1].startswith("From incipient slip on, the cylinder travels 1.10 mm")


def test_a_sweep_says_where_it_slips_first_and_last_and_the_trend():
    times = {0.2: 1.2, 0.4: 1.4, 0.8: 1.9}
    runs = [run(str(mu), time, swept={"contact.friction_coefficient": mu}) for mu, time in times.items()]
    first, second, third = answer(study(*runs), dict.fromkeys(map(str, times), 1.0))
    assert first == (
        "Over 3 runs that differ in friction coefficient, the whole contact slips between 0.200 s (friction "
        "coefficient 0.2) and 0.900 s (friction coefficient 0.8) after the slide begins, the later the larger the "
        "friction coefficient."
    )
    assert second == "From incipient slip on, 100 to 800 ms are left to react."
    assert third == "These times have no error bars yet: fingerslip converge finds them."
    runs[0] = dataclasses.replace(runs[0], doubts=("contacts.0: coarse",))
    runs[2] = dataclasses.replace(runs[2], uncertainty={"slip.overall": 0.004, "slip.latency": 0.2})
    first, second, _, third = answer(study(*runs), dict.fromkeys(map(str, times), 1.0))
    assert "(friction coefficient 0.2, doubtful) and 0.900 s (friction coefficient 0.8, ± 4 ms)" in first
    assert second == "From incipient slip on, 100 to 800 ± 200 ms are left to react."
    lacking = "friction coefficient 0.2, friction coefficient 0.4"
    assert third == f"The times of {lacking} have no error bars yet: fingerslip converge finds them."


@pytest.mark.parametrize(
    ("step", "since", "latency"), [(0.5, "0.7 s", "600 ms"), (0.02, "0.71 s", "610 ms"), (1e-4, "0.712 s", "612 ms")]
)
def test_times_have_the_digits_that_the_step_allows(step, since, latency):
    first, second, *_ = answer(study(run("a", 1.7118, numbers={"slide_step_s": step})), {"a": 1.0})
    assert first.startswith(f"The whole contact slips {since} after")
    assert f", {latency} are left" in second


def test_what_is_too_coarse_is_said():
    numbers = {"slide_records": 4, "slipped_share_of_one_step": 0.53, "nodes_across_contact": 6.0}
    steps, share, nodes = answer(study(run("a", 1.71, numbers=numbers)), {"a": 1.0})[2:5]
    assert steps == "Too coarse for the times of slip: a (4 steps in the slide): take a smaller step."
    assert "a (53 % of the contact slips in one step)" in share
    assert "a (6 nodes across the contact): take smaller elements" in nodes


def test_no_time_is_told_of_a_run_whose_cells_are_turned_inside_out():
    torn = run("a", 1.71, numbers={"inverted_cells": 1859})
    said = answer(study(torn), {"a": 1.0})
    assert said[0] == "No time of slip is a result here."
    assert said[1].startswith("Small strain does not hold")
    assert "a (1859 cells turned inside out): write kinematics: finite" in said[1]
    said = answer(study(torn, run("b", 1.5)), {"a": 1.0, "b": 1.0})
    assert said[0] == "In one of 2 runs, the whole contact slips 0.500 s (b) after the slide begins."
    assert "1.71" not in " ".join(said)
    assert "a (1859 cells" in " ".join(said)
    box = quotable(content(RunResult("a", {}, SLIPPED, numbers={"inverted_cells": 1859})))
    assert "Quote" not in box
    assert box["Do not quote"].startswith("forces and times of slip of runs whose cells are turned inside out")
    assert "too coarse" not in box["Do not quote"]
    assert "Quote" in quotable(content(RunResult("a", {}, SLIPPED, numbers={"largest_strain": 0.5})))


def test_where_there_is_no_trend_or_no_slip_none_is_claimed_and_samples_have_no_names():
    runs = [run(v, t, swept={"mesh.contact_size": v}) for v, t in (("1 mm", 1.2), ("2 mm", 1.1), ("3 mm", 1.3))]
    assert "the later" not in answer(study(*runs), {one.name: 1.0 for one in runs})[0]
    runs = [run(f"sample-{n}", 1.5 + 0.1 * n) for n in range(3)]
    said = answer(study(*runs, ranges={"a": (0, 1), "b": (0, 1)}), {one.name: 1.0 for one in runs})[0]
    assert said.startswith("Over 3 samples of 2 uncertain values, the whole contact slips between 0.500 s and 0.700 s")
    assert "sample-" not in said
    assert "overall slip is not reached" in answer(study(run("a", None)), {"a": 1.0})[0]
    mixed = answer(study(run("a", None), run("b", 1.5)), {"a": 1.0, "b": 1.0})
    assert mixed[-2] == "In 1 of 2 runs overall slip is not reached."
    held = run("a", None, numbers={"normal_force_max": 2.0, "normal_force_end": 1.5})
    said = ("Nothing slides in this study. Of the largest normal force, 2 N, 75 % is left at the end.",)
    assert answer(study(held), {}) == said
    assert answer(study(run("a", None)), {})[0].startswith("Nothing slides")


def published_run(variant, overall, incipient=None, **more):
    value = next(one for one in TABLE2.values if one.conditions["fingertip.phalanx.variant"] == variant)
    values = {**value.conditions, **value.programme, **more}
    return RunResult(variant, {}, Events(slip=SlipEvents(incipient=incipient, overall=overall)), values=values)


def test_all_that_misses_is_said_beside_what_agrees_and_what_is_comparable_has_no_excuse():
    runs = [published_run("original", 1.71, 1.155, **CALIBRATED), published_run("scaled", 1.785, 1.23, **CALIBRATED)]
    assert published_rows_beside(runs, [TABLE2]) == (
        "Beside 2 published times, overall slip comes 0 to 15 ms later; the model was calibrated on 1 of them.",
        (
            "Incipient slip comes 250 to 375 ms earlier than published, and 555 ms are left to react, "
            "against 180 to 290 ms published."
        ),
        (
            "These do not compare like with like: the paper reads incipient slip from acceleration peaks, here it is a "
            "share of the contact that has slipped."
        ),
    )
    values = tuple(
        PublishedValue(name, name, "published", "paper", "s", time, reading="slip")
        for name, time in (("incipient", 0.9), ("overall", 1.1), ("latency", 0.2))
    )
    own = RunResult("a", {}, Events(slip=SlipEvents(incipient=0.565, overall=1.1)))
    assert published_rows_beside([own], [PublishedSet("p", "", "", "", values)]) == (
        "Beside the published time, overall slip agrees to the millisecond.",
        "Incipient slip comes 335 ms earlier than published, and 535 ms are left to react, against 200 ms published.",
    )


ALL = "Beside 3 published times, overall slip comes 10 ms earlier to 30 ms later; it is not reached in 1 of these runs."


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ({"flattened": 1.72}, "Beside the published time, overall slip agrees to the millisecond."),
        ({"flattened": 1.70}, "Beside the published time, overall slip comes 20 ms earlier."),
        ({"flattened": None}, "Overall slip, for which a time is published, is not reached."),
        ({"original": 1.70, "flattened": 1.75, "scaled": None}, ALL),
    ],
)
def test_overall_slip_beside_published_times(times, words):
    runs = [published_run(variant, overall) for variant, overall in times.items()]
    assert published_rows_beside(runs, [TABLE2])[0] == words
    assert words in answer(study(*runs), {run.name: 1.0 for run in runs}, [TABLE2])


def test_only_a_run_with_the_calibrated_values_is_calibrated_and_each_value_counts_once():
    other = published_run("original", 1.71, **{**CALIBRATED, "fingertip.sagittal.half_height": "6.5 mm"})
    rows = published_rows_beside([other], [TABLE2])
    assert "calibrated" not in rows[0]
    assert "calibrated on it" in published_rows_beside([published_run("original", 1.71, **CALIBRATED)], [TABLE2])[0]
    assert published_rows_beside([other], [TABLE2, published_set("wang2014-peaks")]) == rows
    assert published_rows_beside([RunResult("a", {}, other.events)], [TABLE2]) == ()


def test_definitions_say_the_constants():
    assert list(definitions(EventSettings())) == [*READINGS, "latency"]
    peaks = PeakSettings(kinds=("SA-II",), over_noise=9.0, followed=0.25)
    settings = EventSettings(
        slip_tolerance=35e-6, incipient_fraction=0.05, sustained=0.08, displacement_tolerance=70e-6, peaks=peaks
    )
    for reading, words in {
        "slip": ("35 µm", "5 %, 48 %, 75 % and 99.5 %", "for 80 ms or up to the end of the slide"),
        "displacement": ("lag the plate by more than 70 µm",),
        "acceleration": ("SA-II", "by 9 spreads", "less than 25 % of the plate's travel"),
    }.items():
        assert all(said in definitions(settings)[reading] for said in words)


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
        "section is 1 mm deep; spikes, which hang on rough thresholds."
    )
    assert box["How sure"] == (
        "Numerical uncertainty is not known yet. The preset's own study (1.5 mm, 3 mm/s) slips after 0.7 s; at "
        "large strain 0.2 to 0.5 s later, in plane strain 0.8 s. 2 values are assumed."
    )
    assert len(" ".join((*box, *box.values())).split()) <= 90


def test_error_bars_without_the_mesh_say_so_where_they_are_quoted_and_what_to_do():
    bars = {"uncertainty": {"slip.overall": 0.004}, "convergence": {"slip.overall": SETTLED}}
    said = "± leaves out element sizes at the contact: run a finer mesh as a second study and compare both with "
    assert answer(study(run("a", 1.71, **bars)), {"a": 1.0})[-1] == f"{said}fingerslip report."
    box = quotable(content(RunResult("a", {}, SLIPPED, **bars)))
    assert box["How sure"].startswith("± is numerical error alone (time steps, not element sizes).")
    mesh = dataclasses.replace(SETTLED, sources={"mesh": Series("mesh", (1.0, 0.5, 0.25), (1.0, 1.0, 1.0))})
    bars["convergence"] = {"slip.overall": mesh}
    assert answer(study(run("a", 1.71, **bars)), {"a": 1.0})[-1].startswith("From incipient slip")


def test_times_of_a_run_that_is_too_coarse_are_not_quoted():
    box = quotable(content(RunResult("a", {}, SLIPPED, numbers={"slide_records": 10})))
    assert "Quote" not in box
    assert box["Do not quote"].startswith("times of slip, for which step or mesh is too coarse, as said above")
    doubtful = content(RunResult("a", {}, SLIPPED, doubts=("contacts.0: too coarse",)), RunResult("b", {}, SLIPPED))
    assert "Quote" not in quotable(doubtful)
    assert quotable(doubtful)["Do not quote"].startswith("times of slip of the runs said to be doubtful above")
    cut_off = RunResult("a", {}, SLIPPED, edge=EdgeContact("skin", 0.02, 0.0))
    assert quotable(content(cut_off))["Do not quote"].startswith(
        "forces and times of slip: contact reaches a free edge"
    )
    for run_of_box, only in ((cut_off, ""), (RunResult("a", {}, SLIPPED), ", quote it only with its ±")):
        studied = dataclasses.replace(run_of_box, uncertainty={"slip.latency": 0.1}, convergence={"slip.latency": AWAY})
        box = quotable(content(studied))
        assert f"Not converged in some run{only}: latency." in box["How sure"]
        assert ("Quote" in box) == bool(only)


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
        == "± is numerical error alone (time steps, not element sizes; 1 of 2 runs). Not converged in some run, "
        "quote it only with its ±: latency."
    )
    again = quotable(content(dataclasses.replace(studied, convergence={"acceleration.incipient": AWAY})))
    assert "acceleration peaks" in again["Do not quote"]


@pytest.mark.parametrize("events", [Events(), Events(SlipEvents(incipient=0.06))])
def test_where_nothing_slips_there_is_nothing_to_quote(events):
    assert quotable(content(RunResult("a", {}, events))) == {}
    assert quotable(dataclasses.replace(content(RunResult("a", {}, SLIPPED)), starts={})) == {}
