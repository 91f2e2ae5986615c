"""The answer: plain sentences with the numbers of what was run, beside what is published; what its words mean."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fingerslip.published import PublishedSet, PublishedValue, published_set
from fingerslip.report.page.answer import answer, definitions, published_rows_beside
from fingerslip.results import RunResult, StudyResult
from fingerslip.slip import Events, EventSettings, PeakSettings, SlipEvents
from fingerslip.slip.windows import READINGS

TABLE2 = published_set("wang2014-table2")
CALIBRATED = {"fingertip.section": "sagittal", "fingertip.sagittal.half_height": "0.007 m", "kinematics": "small"}


def run(name: str, overall: float | None, incipient: float | None = 1.1, **more: Any) -> RunResult:
    events = Events(slip=SlipEvents(incipient=incipient, overall=overall))
    return RunResult(name, more.pop("swept", {}), events, **more)


def study(*runs: RunResult, **more: Any) -> StudyResult:
    return StudyResult(Path("s"), (), runs, **more)


NO_BARS = "These times have no error bars yet: fingerslip converge finds them."
FRICTIONS = {0.2: 1.2, 0.4: 1.4, 0.8: 1.9}
SIZES = {"1 mm": 1.2, "2 mm": 1.1, "3 mm": 1.3}
TRAVELS = {"overall_travel_m": 2.13e-3, "latency_travel_m": 1.1e-3}
ANSWERS: dict[str, tuple[StudyResult, list[str]]] = {
    "a run with an error bar": (
        study(run("a", 1.71, uncertainty={"slip.overall": 0.004})),
        [
            "The whole contact slips 0.710 s after the slide begins, 1.710 s after the start of the run (± 4 ms, "
            "numerical).",
            "From incipient slip on, 610 ms are left to react.",
        ],
    ),
    "a sweep with a trend": (
        study(*(run(str(mu), time, swept={"contact.friction_coefficient": mu}) for mu, time in FRICTIONS.items())),
        [
            "Over 3 runs that differ in friction coefficient, the whole contact slips between 0.200 s (friction "
            "coefficient 0.2) and 0.900 s (friction coefficient 0.8) after the slide begins, the later the larger the "
            "friction coefficient.",
            "From incipient slip on, 100 to 800 ms are left to react.",
            NO_BARS,
        ],
    ),
    "a sweep without a trend": (
        study(*(run(size, time, swept={"mesh.contact_size": size}) for size, time in SIZES.items())),
        [
            "Over 3 runs that differ in contact size, the whole contact slips between 0.100 s (contact size 2 mm) and "
            "0.300 s (contact size 3 mm) after the slide begins."
        ],
    ),
    **{
        f"digits of steps of {step} s": (
            study(run("a", 1.7118, numbers={"slide_step_s": step})),
            [
                f"The whole contact slips 0.{time} s after the slide begins, 1.{time} s after the start of the run.",
                f"From incipient slip on, {latency} ms are left to react.",
            ],
        )
        for step, time, latency in ((0.5, 7, 600), (0.02, 71, 610), (1e-4, 712, 612))
    },
    "without inertia millimetres come first and nobody reacts": (
        study(run("a", 1.71, numbers=TRAVELS, values={"time.scheme": "quasi_static"})),
        [
            "The whole contact slips after 2.13 mm of travel, 0.710 s after the slide begins, 1.710 s after the start "
            "of the run.",
            "From incipient slip on, the plate travels 1.10 mm, 610 ms at the speed of this slide.",
            NO_BARS,
        ],
    ),
    "no overall slip": (
        study(run("a", None)),
        ["The whole contact does not slip in this run: overall slip is not reached by the end of the slide.", NO_BARS],
    ),
    "overall slip in one of two runs": (
        study(run("a", None), run("b", 1.5)),
        [
            "Over 1 runs, the whole contact slips between 0.500 s (b) and 0.500 s (b) after the slide begins.",
            "From incipient slip on, 400 ms are left to react.",
            "In 1 of 2 runs overall slip is not reached.",
            NO_BARS,
        ],
    ),
    "samples without names": (
        study(*(run(f"sample-{n}", 1.5 + 0.1 * n) for n in range(3)), ranges={"a": (0, 1), "b": (0, 1)}),
        [
            "Over 3 samples of 2 uncertain values, the whole contact slips between 0.500 s and 0.700 s after the slide "
            "begins.",
            "From incipient slip on, 400 to 600 ms are left to react.",
        ],
    ),
}


@pytest.mark.parametrize("name", list(ANSWERS))
def test_an_answer_says_what_was_found_and_how_long_there_is_to_react(name: str) -> None:
    of_study, sentences = ANSWERS[name]
    said = answer(of_study, {one.name: 1.0 for one in of_study.runs})
    assert list(said[: len(sentences)]) == sentences
    assert (NO_BARS in said) == (not of_study.ranges and not of_study.runs[0].uncertainty)


def test_what_does_not_slide_is_said() -> None:
    held = run("a", None, numbers={"normal_force_max": 2.0, "normal_force_end": 1.5})
    assert answer(study(held), {}) == (
        "Nothing slides in this study. Of the largest normal force, 2 N, 75 % is left at the end.",
    )
    assert answer(study(run("a", None)), {})[0].startswith("Nothing slides")


def test_what_is_too_coarse_is_said() -> None:
    numbers = {"slide_records": 4, "slipped_share_of_one_step": 0.53, "nodes_across_contact": 6.0}
    steps, share, nodes = answer(study(run("a", 1.71, numbers=numbers)), {"a": 1.0})[2:5]
    assert steps == "Too coarse for the times of slip: a (4 steps in the slide): take a smaller step."
    assert "a (53 % of the contact slips in one step)" in share
    assert "a (6 nodes across the contact): take smaller elements" in nodes


def published_run(variant: str, overall: float | None, incipient: float | None = None, **more: Any) -> RunResult:
    value = next(one for one in TABLE2.values if one.conditions["fingertip.phalanx.variant"] == variant)
    values = {**value.conditions, **value.programme, **more}
    return RunResult(variant, {}, Events(slip=SlipEvents(incipient=incipient, overall=overall)), values=values)


def test_all_that_misses_is_said_beside_what_agrees() -> None:
    runs = [published_run("original", 1.71, 1.155, **CALIBRATED), published_run("scaled", 1.785, 1.23, **CALIBRATED)]
    first, second, third = published_rows_beside(runs, [TABLE2])
    assert first == (
        "Beside 2 published times, overall slip comes 0 to 15 ms later; the model was calibrated on 1 of them."
    )
    assert second == (
        "Incipient slip comes 250 to 375 ms earlier than published, and 555 ms are left to react, "
        "against 180 to 290 ms published."
    )
    assert third == (
        "These do not compare like with like: the paper reads incipient slip from acceleration peaks, here it is a "
        "share of the contact that has slipped."
    )


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ({"flattened": 1.72}, "Beside the published time, overall slip agrees to the millisecond."),
        ({"flattened": 1.70}, "Beside the published time, overall slip comes 20 ms earlier."),
        ({"flattened": None}, "Overall slip, for which a time is published, is not reached."),
        (
            {"original": 1.70, "flattened": 1.75, "scaled": None},
            (
                "Beside 3 published times, overall slip comes 10 ms earlier to 30 ms later; "
                "it is not reached in 1 of these runs."
            ),
        ),
    ],
)
def test_overall_slip_beside_published_times(times: dict[str, float | None], words: str) -> None:
    runs = [published_run(variant, overall) for variant, overall in times.items()]
    assert published_rows_beside(runs, [TABLE2])[0] == words
    study_of_runs, starts = study(*runs), {run.name: 1.0 for run in runs}
    assert words in answer(study_of_runs, starts, [TABLE2])


def test_only_a_run_with_the_calibrated_values_is_calibrated() -> None:
    other = published_run("original", 1.71, **{**CALIBRATED, "fingertip.sagittal.half_height": "6.5 mm"})
    assert "calibrated" not in published_rows_beside([other], [TABLE2])[0]
    assert "calibrated on it" in published_rows_beside([published_run("original", 1.71, **CALIBRATED)], [TABLE2])[0]


def test_what_is_comparable_has_no_excuse() -> None:
    values = tuple(
        PublishedValue(name, name, "published", "paper", "s", time, reading="slip")
        for name, time in (("incipient", 0.9), ("overall", 1.1), ("latency", 0.2))
    )
    own = RunResult("a", {}, Events(slip=SlipEvents(incipient=0.565, overall=1.1)))
    assert published_rows_beside([own], [PublishedSet("p", "", "", "", values)]) == (
        "Beside the published time, overall slip agrees to the millisecond.",
        "Incipient slip comes 335 ms earlier than published, and 535 ms are left to react, against 200 ms published.",
    )


def test_a_value_in_two_sets_counts_once_and_other_conditions_not_at_all() -> None:
    own = published_run("original", 1.72)
    assert published_rows_beside([own], [TABLE2, published_set("wang2014-peaks")]) == published_rows_beside(
        [own], [TABLE2]
    )
    assert published_rows_beside([RunResult("a", {}, own.events)], [TABLE2]) == ()


def test_definitions_say_the_constants() -> None:
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
