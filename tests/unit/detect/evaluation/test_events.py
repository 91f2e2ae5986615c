from __future__ import annotations

import pytest

from fingerslip.detect.evaluation.scores import event_scores_of
from fingerslip.detect.labels import Onsets

LABELS = {"a": Onsets(2.0, 4.0), "b": Onsets(2.0, 4.0), "c": Onsets(2.0, 4.0), "held": Onsets(None, None)}
REST = dict.fromkeys(LABELS, 1.0)


def test_events_are_scored() -> None:
    found = {"a": Onsets(2.5, 4.5), "b": Onsets(1.7, 3.0), "c": Onsets(None, None), "held": Onsets(None, None)}
    scores = event_scores_of(found, LABELS, REST, frame=0.1)
    assert (scores.trials, scores.missed) == (3, 1)
    assert scores.error.value == pytest.approx(0.1)
    assert scores.absolute_error.value == pytest.approx(0.4)
    assert scores.error_spread == pytest.approx(0.8 / 2**0.5)
    assert scores.delay_frames == pytest.approx(1.0)
    assert scores.early.value == pytest.approx(1 / 3)
    assert scores.before_gross.value == pytest.approx(2 / 3)
    assert scores.lead.value == pytest.approx((1.5 + 2.3) / 2)
    assert scores.at_rest.value == 0.0
    assert scores.gross_error.value == pytest.approx(-0.25)
    assert scores.bound is None


def test_alarms_at_rest_and_where_nothing_slips_are_false() -> None:
    found = {"a": Onsets(0.5, None), "b": Onsets(2.0, None), "c": Onsets(2.0, None), "held": Onsets(3.0, None)}
    assert event_scores_of(found, LABELS, REST).at_rest.value == 0.5


def test_the_bound_needs_19_trials() -> None:
    labels = {f"t{number}": Onsets(1.0, 3.0) for number in range(19)}
    found = {name: Onsets(1.0 + 0.1 * number, None) for number, name in enumerate(labels)}
    assert event_scores_of(found, labels, dict.fromkeys(labels, 0.5)).bound == pytest.approx(0.2)


def test_gross_slip_that_is_found_first_counts_as_slip() -> None:
    scores = event_scores_of({"a": Onsets(None, 2.2)}, LABELS, REST)
    assert scores.error.value == pytest.approx(0.2)
    assert scores.missed == 0
