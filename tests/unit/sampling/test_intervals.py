"""Intervals over samples, and where published times lie in them."""

from __future__ import annotations

import dataclasses

import pytest

from fingerslip.published import published_set
from fingerslip.sampling.sensitivity import Interval, interval_of, position, published_intervals
from fingerslip.slip import SlipEvents
from unit.sampled import study_of

UNIFORM = Interval(tuple(1.0 + 0.01 * number for number in range(101)))


def test_percentiles_are_those_of_the_samples() -> None:
    assert (UNIFORM.smallest, UNIFORM.largest) == (1.0, 2.0)
    assert UNIFORM.percentile(5) == pytest.approx(1.05)


def test_events_that_did_not_happen_are_counted() -> None:
    assert interval_of([None, 2.0, 1.0, None]) == Interval((1.0, 2.0), 2)
    assert interval_of([None]) is None


@pytest.mark.parametrize(
    ("span", "where"),
    [
        ((1.345, 1.345), "within, at 35 %"),
        ((0.99, 0.99), "below all"),
        ((2.01, 2.01), "above all"),
        ((0.8, 1.0), "within, at 0 %"),
        ((1.0, 1.0), "within, at 0 %"),
        ((1.99, 2.5), "within, at 100 %"),
    ],
)
def test_a_published_time_is_placed(span: tuple[float, float], where: str) -> None:
    assert position(span, UNIFORM) == where


def test_every_published_time_has_the_interval_of_the_runs_that_meet_its_conditions() -> None:
    study = study_of(12, ("original", "scaled"))
    found = published_intervals(study.runs, [published_set("wang2014-table2"), published_set("wang2014-peaks")])
    assert [(one.value.quantity, one.value.conditions["fingertip.phalanx.variant"]) for one in found] == [
        *((time, variant) for variant in ("original", "scaled") for time in ("incipient", "overall", "latency")),
        ("three_quarter", "original"),
    ], "a time that is printed twice stands once"
    assert {one.reading for one in found} == {"slip"}, "nothing else is recorded"
    assert {one.samples for one in found} == {12}
    original = found[1]
    assert original.interval is not None
    assert original.where == position((1.71, 1.71), original.interval)
    assert found[-1].interval is None
    assert found[-1].where == ""


def test_both_readings_are_shown_where_the_paper_names_none() -> None:
    study = study_of()
    runs = [
        dataclasses.replace(run, events=dataclasses.replace(run.events, acceleration=SlipEvents(overall=1.0)))
        for run in study.runs
    ]
    found = published_intervals(runs, [published_set("wang2014-table2")])
    assert [(one.reading, one.where) for one in found if one.value.quantity == "overall"] == [
        ("slip", found[2].where),
        ("acceleration", "above all"),
    ]


def test_a_condition_on_a_sampled_value_is_what_the_samples_leave_open() -> None:
    study = study_of()
    swept = [
        dataclasses.replace(run, sampled={**run.sampled, "contact.friction_coefficient": 0.5}) for run in study.runs
    ]
    assert published_intervals(swept, [published_set("wang2014-table2")])
    other = [dataclasses.replace(run, values={**run.values, "contact.friction_coefficient": 0.5}) for run in study.runs]
    assert published_intervals(other, [published_set("wang2014-table2")]) == ()
