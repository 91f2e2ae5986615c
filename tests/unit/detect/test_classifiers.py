"""Classifiers, and how their chances become events and alarms."""

import dataclasses
import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.detect.classifiers import CLASSIFIERS, Candidate, fit, optional, probabilities, union_of_sets
from fingerslip.detect.labels import Onsets
from fingerslip.detect.samples import columns_of
from fingerslip.detect.training import (
    ForwardFilter,
    Thresholds,
    false_alarm_threshold,
    lead_bound,
    least_trials,
    onsets_from,
    single_frame_scores,
)
from fingerslip.errors import InputError

DRAW = np.random.default_rng(0)
CLASSES = np.tile([0, 1, 2], 80).astype(np.int8)
VALUES = (CLASSES[:, None] * 2.0 + DRAW.normal(size=(240, 6))).astype(np.float32)


@functools.cache
def fitted(name):
    return fit(CLASSIFIERS[name], VALUES[:, :1] if name.endswith("threshold") else VALUES, CLASSES)


@pytest.mark.parametrize("name", CLASSIFIERS)
def test_every_classifier_learns_what_is_plain(name):
    values = VALUES[:, :1] if name.endswith("threshold") else VALUES
    found = probabilities(fitted(name), values)
    assert found.shape == (240, 3)
    assert found.sum(axis=1) == pytest.approx(1.0)
    assert (found.argmax(axis=1) == CLASSES).mean() > 0.7
    assert found[:5] == pytest.approx(probabilities(fitted(name), values[:5]), abs=1e-6)


def test_classifiers_are_those_published():
    forest = fitted("forest")
    assert (forest.max_depth, forest.min_samples_leaf, forest.n_estimators) == (20, 5, 50)
    assert CLASSIFIERS["forest"].sets == ("displacement", "speed")
    assert probabilities(forest, VALUES) == pytest.approx(forest.predict_proba(VALUES), abs=1e-12)
    machine = fitted("svm").get_params()
    assert (machine["linearsvc__C"], machine["nystroem__kernel"], machine["nystroem__gamma"]) == (10.0, "rbf", None)
    assert fitted("time_threshold").get_n_leaves() == 3


def test_columns_of_sets_and_sets_of_several_classifiers():
    assert columns_of(("mean/a", "time/seconds", "mean/b"), ("time", "mean")).tolist() == [1, 0, 2]
    two = [Candidate(name, sets, lambda seed: seed) for name, sets in (("a", ("x", "y")), ("b", ("y", "z")))]
    assert union_of_sets(two) == ("x", "y", "z")


FILTER = ForwardFilter((3.0, 1.0), (0.25, 0.5, 0.25), 0.2)
TIME = np.arange(100) / 30.0
STEP = np.diff(TIME, prepend=0.0)


def phases(flicker=False):
    chances = np.tile([0.9, 0.08, 0.02], (100, 1))
    chances[50:] = [0.1, 0.8, 0.1]
    chances[80:] = [0.02, 0.08, 0.9]
    if flicker:
        chances[20] = [0.1, 0.8, 0.1]
    return chances


def test_one_odd_frame_is_no_event_but_where_frames_stand_alone():
    scores, _ = FILTER.scores(FILTER.start(), STEP, phases(flicker=True))
    found = onsets_from(TIME, scores)
    assert TIME[50] <= found.incipient < TIME[65]
    assert TIME[80] <= found.gross < TIME[90]
    assert onsets_from(TIME, single_frame_scores(phases(flicker=True))) == Onsets(TIME[20], TIME[80])
    assert (single_frame_scores(np.full((2, 3), np.nan)) == -np.inf).all()


@given(seed=st.integers(0, 1000), cut=st.integers(0, 60))
@settings(max_examples=20)
def test_frame_by_frame_is_the_same_as_all_at_once(seed, cut):
    draw = np.random.default_rng(seed)
    chances = draw.dirichlet(np.ones(3), 60)
    chances[draw.random(60) < 0.2] = np.nan
    whole, _ = FILTER.scores(FILTER.start(), STEP[:60], chances)
    first, state = FILTER.scores(FILTER.start(), STEP[:cut], chances[:cut])
    rest, _ = FILTER.scores(state, STEP[cut:60], chances[cut:])
    assert np.array_equal(np.concatenate([first, rest]), whole)
    assert not np.isnan(whole).any()


def test_the_filter_is_that_of_the_textbook():
    chances = np.random.default_rng(0).dirichlet(np.ones(3), 30)
    one = ForwardFilter((2.0, 1.5), (0.3, 0.4, 0.3), 1.0)
    scores, _ = one.scores(one.start(), STEP[:30], chances)
    belief, found = np.array([0.998, 0.001, 0.001]), []
    for interval, chance in zip(STEP[:30], np.maximum(chances, 1e-3), strict=True):
        first, second = -np.expm1(-interval / np.array([2.0, 1.5]))
        belief = np.array([[1 - first, first, 0], [0, 1 - second, second], [0, 0, 1]]).T @ belief
        belief *= chance / np.array([0.3, 0.4, 0.3])
        belief /= belief.sum()
        found.append([np.log((1 - belief[0]) / belief[0]), np.log(belief[2] / (1 - belief[2]))])
    assert scores == pytest.approx(np.array(found), rel=1e-6, abs=1e-6)


def test_frames_that_could_not_be_classified_change_little_and_thresholds_delay_events_or_prevent_them():
    chances = phases()
    chances[60:64] = np.nan
    scores, _ = FILTER.scores(FILTER.start(), STEP, chances)
    assert abs(scores[63, 0] - scores[59, 0]) < 0.6
    scores, _ = FILTER.scores(FILTER.start(), STEP, phases())
    early, late = onsets_from(TIME, scores), onsets_from(TIME, scores, Thresholds(slip=5.0, gross=1e9))
    assert early.incipient < late.incipient
    assert late.gross is None
    assert onsets_from(TIME[:10], scores[:10]) == Onsets(None, None)
    # Else an alarm of gross slip would go round the threshold that bounds false alarms.
    scores = np.array([[1.0, 0.5], [2.0, -1.0], [5.0, -1.0], [4.0, 2.0]])
    assert onsets_from(np.arange(4.0), scores, Thresholds(slip=3.0)) == Onsets(2.0, 3.0)


def hurried(seed):
    return CLASSIFIERS["logistic"].make(seed).set_params(logisticregression__max_iter=1)


FOREST, HURRIED = CLASSIFIERS["forest"], dataclasses.replace(CLASSIFIERS["logistic"], make=hurried)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fit(FOREST, VALUES, np.minimum(CLASSES, 1)), r"has the classes \[0, 1\], needs 0, 1 and 2"),
        (lambda: fit(HURRIED, VALUES, CLASSES), "classifier logistic: does not converge"),
        (lambda: columns_of(("mean/a",), ("polar",)), "features: have no 'polar'"),
        (lambda: optional("no_such_module"), r'no_such_module is missing .*pip install "fingerslip\[detect\]"'),
        (lambda: ForwardFilter((0.0, 1.0), (0.25, 0.5, 0.25), 0.2), "ForwardFilter.dwell.*: got 0.0, needs a number >"),
        (lambda: ForwardFilter((1.0, 1.0), (0.0, 0.5, 0.5), 0.2), "ForwardFilter.prior.*: got 0.0, needs a number > 0"),
        (lambda: ForwardFilter((1.0, 1.0), (0.2, 0.4, 0.4), float("nan")), "ForwardFilter.weight: got nan"),
        (lambda: false_alarm_threshold([0.0] * 18), "got 18 trials for a guarantee of 0.95, needs at least 19"),
        (lambda: lead_bound([1.0]), "needs at least 19"),
        (lambda: least_trials(0.0), "share: got 0"),
    ],
)
def test_what_cannot_be_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()


@given(st.lists(st.floats(-10, 10), min_size=20, max_size=80, unique=True))
def test_each_trial_in_turn_raises_an_alarm_in_at_most_5_percent_and_has_the_lead_in_at_least_95(values):
    """With every order equally likely, leaving each out in turn is the whole distribution: the bounds are exact."""
    others = [values[:i] + values[i + 1 :] for i in range(len(values))]
    pairs = list(zip(values, others, strict=True))
    assert np.mean([value > false_alarm_threshold(rest) for value, rest in pairs]) <= 0.05 + 1e-12
    bounds = [(value, lead_bound(rest)) for value, rest in pairs]
    assert np.mean([bound is not None and lead >= bound for lead, bound in bounds]) >= 0.95 - 1e-12


def test_the_ranks_and_how_many_trials_they_need():
    assert [least_trials(share) for share in (0.5, 0.1, 0.05, 0.01)] == [1, 9, 19, 99]
    assert false_alarm_threshold(list(range(19))) == 18
    assert false_alarm_threshold(list(range(39))) == 37
    assert lead_bound([float(one) for one in range(39)]) == 1.0
    assert lead_bound([None, *map(float, range(1, 39))]) == 1.0
    assert lead_bound([None, None, *map(float, range(37))]) is None
