from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.detect.evaluation.scores import check_submission, rest_ends, score_submission
from fingerslip.detect.labels import Onsets, write_onsets
from fingerslip.detect.samples import benchmark_test_trials
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError


def test_the_labels_themselves_are_a_perfect_submission(trials: TrialSet, tmp_path: Path) -> None:
    tests, onsets = benchmark_test_trials(trials.names), trials.onsets()
    write_onsets({name: onsets[name] for name in tests}, tmp_path / "mine.csv")
    scores = score_submission(trials, tmp_path / "mine.csv", rest_frames=20)
    assert scores.trials == len(tests) == 5
    assert (scores.error.value, scores.missed, scores.before_gross.value) == (0.0, 0, 1.0)


def test_other_trials_are_refused_each_by_its_name(trials: TrialSet) -> None:
    tests = ("a", "b")
    with pytest.raises(InputError) as caught:
        check_submission({"a": Onsets(1.0, None), "c": Onsets(1.0, None)}, tests, "mine.csv")
    assert [one.found for one in caught.value.all] == [
        "has no row for the test trial b",
        "has a row for c, no test trial",
    ]


def test_gross_slip_before_incipient_slip_is_refused() -> None:
    with pytest.raises(InputError, match=r"has gross slip of a at 2 s, incipient slip at 3 s, needs gross slip last"):
        check_submission({"a": Onsets(3.0, 2.0)}, ("a",), "mine.csv")
    both = {"a": Onsets(2.0, 2.0), "b": Onsets(None, 2.0)}
    assert check_submission(both, ("a", "b"), "mine.csv") == both


def test_labels_of_a_users_own_that_lack_a_test_trial_are_told(trials: TrialSet, tmp_path: Path) -> None:
    tests, onsets = benchmark_test_trials(trials.names), trials.onsets()
    write_onsets({name: onsets[name] for name in tests}, tmp_path / "mine.csv")
    few = {name: onsets[name] for name in tests[1:]}
    with pytest.raises(InputError, match=f"labels: have no trial {tests[0]}"):
        score_submission(trials, tmp_path / "mine.csv", labels=few, rest_frames=20)


def test_rest_ends_with_its_last_frame(trials: TrialSet) -> None:
    ends, frame = rest_ends(trials, trials.names[:2], 20)
    assert ends[trials.names[0]] == pytest.approx(19 / 30)
    assert frame == pytest.approx(1 / 30)
    with pytest.raises(InputError, match="has 260 frames, needs more than the 300 at rest"):
        rest_ends(trials, trials.names[:1], 300)
