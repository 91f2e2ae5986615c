"""What the answer says of published values."""

from __future__ import annotations

from typing import Any

import pytest

from fingerslip.published import PublishedSet, PublishedValue, published_set
from fingerslip.report.page.beside import published_rows_beside
from fingerslip.results import RunResult
from fingerslip.slip import Events, SlipEvents

TABLE2 = published_set("wang2014-table2")
CALIBRATED = {"fingertip.section": "sagittal", "fingertip.sagittal.half_height": "0.007 m", "kinematics": "small"}


def run(variant: str, overall: float | None, incipient: float | None = None, **more: Any) -> RunResult:
    value = next(one for one in TABLE2.values if one.conditions["fingertip.phalanx.variant"] == variant)
    values = {**value.conditions, **value.programme, **more}
    return RunResult(variant, {}, Events(slip=SlipEvents(incipient=incipient, overall=overall)), values=values)


def test_all_that_misses_is_said_beside_what_agrees() -> None:
    runs = [run("original", 1.71, 1.155, **CALIBRATED), run("scaled", 1.785, 1.23, **CALIBRATED)]
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
    ("variant", "overall", "words"),
    [
        ("flattened", 1.72, "Beside the published time, overall slip agrees to the millisecond."),
        ("flattened", 1.70, "Beside the published time, overall slip comes 20 ms earlier."),
        ("flattened", None, "Overall slip, for which a time is published, is not reached."),
    ],
)
def test_overall_slip_alone(variant: str, overall: float | None, words: str) -> None:
    assert published_rows_beside([run(variant, overall)], [TABLE2])[0] == words


def test_times_on_both_sides_and_those_not_reached() -> None:
    runs = [run("original", 1.70), run("flattened", 1.75), run("scaled", None)]
    assert published_rows_beside(runs, [TABLE2])[0] == (
        "Beside 3 published times, overall slip comes 10 ms earlier to 30 ms later; "
        "it is not reached in 1 of these runs."
    )


def test_only_a_run_with_the_calibrated_values_is_calibrated() -> None:
    other = run("original", 1.71, **{**CALIBRATED, "fingertip.sagittal.half_height": "6.5 mm"})
    assert "calibrated" not in published_rows_beside([other], [TABLE2])[0]
    assert "calibrated on it" in published_rows_beside([run("original", 1.71, **CALIBRATED)], [TABLE2])[0]


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
    own = run("original", 1.72)
    assert published_rows_beside([own], [TABLE2, published_set("wang2014-peaks")]) == published_rows_beside(
        [own], [TABLE2]
    )
    assert published_rows_beside([RunResult("a", {}, own.events)], [TABLE2]) == ()
