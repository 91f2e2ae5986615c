"""Scores of frames, events and submissions to the benchmark, with intervals over trials."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.alarms import lead_bound, least_trials
from fingerslip.detect.labels import CLASSES, Onsets, read_onsets
from fingerslip.detect.samples import benchmark_test_trials
from fingerslip.detect.trial_set import TrialSet, check_labels
from fingerslip.errors import InputError, Mistakes

__all__ = [
    "Estimate",
    "EventScores",
    "FrameScores",
    "Reliability",
    "bootstrap_estimate",
    "check_submission",
    "confusion_by_trial",
    "event_scores_of",
    "frame_scores_of",
    "precision_recall_f1",
    "reliability_of",
    "rest_ends",
    "score_submission",
]


@dataclass(frozen=True)
class Estimate:
    """A number and the middle 95 % of what it is for resampled trials."""

    value: float | None  # the number
    low: float | None = None  # ends of the interval
    high: float | None = None  # ends of the interval


def bootstrap_estimate(
    statistic: Callable[[NDArray[np.intp]], float], trials: int, *, draws: int = 1000, seed: int = 0
) -> Estimate:
    """Return a statistic of trials with its interval (percentile bootstrap, Efron & Tibshirani 1993)."""
    if trials == 0:
        return Estimate(None)
    value = statistic(np.arange(trials))
    if not np.isfinite(value):
        return Estimate(None)
    if trials < 2:
        return Estimate(float(value))
    draw = np.random.default_rng(seed)
    values = np.array([statistic(draw.integers(trials, size=trials)) for _ in range(draws)])
    values = values[np.isfinite(values)]
    if len(values) < draws / 2:
        return Estimate(float(value))
    low, high = np.quantile(values, (0.025, 0.975))
    return Estimate(float(value), float(low), float(high))


_COUNT = len(CLASSES)


@dataclass(frozen=True)
class FrameScores:
    """How well frames are classified."""

    matrix: NDArray[np.intp]  # (3, 3), frames by true class (rows) and found class (columns)
    accuracy: Estimate  # share of the frames that are right
    precision: tuple[Estimate, ...]  # for each class
    recall: tuple[Estimate, ...]  # for each class
    f1: tuple[Estimate, ...]  # for each class


def confusion_by_trial(
    true: NDArray[np.int8], predicted: NDArray[np.int8], trial: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return a confusion matrix for each trial, shape (n_trials, 3, 3), rows the true class.

    Arrays: true, found (n_samples,); trial (n_samples,).
    """
    _, number = np.unique(trial, return_inverse=True)
    trials = int(number.max()) + 1 if number.size else 0
    index = (number * _COUNT + true) * _COUNT + predicted
    counts = np.bincount(index, minlength=trials * _COUNT**2)
    return counts.reshape(trials, _COUNT, _COUNT)


def precision_recall_f1(matrix: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return precision, recall and F1 of each class, shape (3, n_classes); NaN where not defined.

    Examples
    --------
    >>> precision_recall_f1(np.array([[8, 2, 0], [0, 10, 0], [0, 0, 10]])).round(3).tolist()
    [[1.0, 0.833, 1.0], [0.8, 1.0, 1.0], [0.889, 0.909, 1.0]]
    """
    right = np.diagonal(matrix).astype(float)
    columns, rows = matrix.sum(axis=0), matrix.sum(axis=1)
    ratios = ((right, columns), (right, rows), (2.0 * right, columns + rows))
    return np.array([_ratio(part, whole) for part, whole in ratios])


def _ratio(part: NDArray[np.float64], whole: NDArray[np.intp]) -> NDArray[np.float64]:
    ratio: NDArray[np.float64] = np.divide(part, whole, out=np.full(part.shape, np.nan), where=whole > 0)
    return ratio


def frame_scores_of(matrices: NDArray[np.intp], *, seed: int = 0) -> FrameScores:
    """Return the scores of confusion matrices, with intervals from trials that are drawn anew.

    Arrays: matrices (n_trials, 3, 3).
    """

    def estimate(score: int, number: int) -> Estimate:
        def value(drawn: NDArray[np.intp]) -> float:
            return float(precision_recall_f1(matrices[drawn].sum(axis=0))[score, number])

        return bootstrap_estimate(value, len(matrices), seed=seed)

    precision, recall, f1 = (tuple(estimate(score, number) for number in range(_COUNT)) for score in range(3))
    accuracy = bootstrap_estimate(lambda drawn: _accuracy(matrices[drawn].sum(axis=0)), len(matrices), seed=seed)
    return FrameScores(matrices.sum(axis=0), accuracy, precision, recall, f1)


def _accuracy(matrix: NDArray[np.intp]) -> float:
    return float(np.trace(matrix) / matrix.sum())


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Reliability:
    """How often frames slip that are said to slip with some probability."""

    said: Floats  # (n_bins,), mean probability of slip in each bin, and the share of its frames that do slip
    seen: Floats  # (n_bins,), mean probability of slip in each bin, and the share of its frames that do slip
    count: NDArray[np.intp]  # (n_bins,), frames in each bin
    error: float  # expected calibration error: mean of the difference, weighted by frames (Guo et al
    brier: float  # brier score over all classes (Brier 1950): 0 is perfect, 2 the worst


def reliability_of(chances: Floats, classes: NDArray[np.int8], bins: int = 10) -> Reliability:
    """Return the reliability of probabilities of slip, incipient or gross.

    Arrays: chances (n_samples, 3); classes (n_samples,).
    """
    slip, slips = 1.0 - chances[:, 0], classes > 0
    bin_number = np.clip((slip * bins).astype(np.intp), 0, bins - 1)
    count = np.bincount(bin_number, minlength=bins)
    sums = [np.bincount(bin_number, weights=weights, minlength=bins) for weights in (slip, slips.astype(float))]
    said, seen = (np.divide(weights, count, out=np.full(bins, np.nan), where=count > 0) for weights in sums)
    gap = np.abs(np.nan_to_num(said - seen))
    truth = classes[:, None] == np.arange(chances.shape[1])
    brier = float(((chances - truth) ** 2).sum(axis=1).mean())
    return Reliability(said, seen, count, float((gap * count).sum() / max(count.sum(), 1)), brier)


@dataclass(frozen=True)
class EventScores:
    """How well events are found."""

    trials: int  # trials with incipient slip
    missed: int  # trials in which no slip was found
    before_gross: Estimate  # share of the trials with gross slip in which slip was found before it
    error: Estimate  # mean of the time found less the label, and of its size [s]
    absolute_error: Estimate  # mean of the time found less the label, and of its size [s]
    error_spread: float | None  # standard deviation of the error [s]
    delay_frames: float | None  # median error in frames
    early: Estimate  # share of the trials in which slip was found before its label
    # share of all trials in which slip was found while the sensor was at rest, or where there is none
    at_rest: Estimate
    lead: Estimate  # mean time from the slip found to the label of gross slip [s]
    lead_spread: float | None  # its standard deviation [s]
    bound: float | None  # lead that a new trial has with 95 % [s]
    gross_error: Estimate  # mean of the time of gross slip found less its label [s]
    gross_found: Estimate  # share of the trials with gross slip in which gross slip was found at all


def event_scores_of(
    predicted: Mapping[str, Onsets],
    labels: Mapping[str, Onsets],
    rest_end: Mapping[str, float],
    *,
    frame: float = np.nan,
    share: float = 0.05,
    seed: int = 0,
) -> EventScores:
    """Return the scores of the onsets found in trials.

    Units: rest_end [s]; frame [s].
    """
    names = list(predicted)
    slips = [name for name in names if labels[name].incipient is not None]
    error = _times([(predicted[name].first, labels[name].incipient) for name in slips])
    lead = _times([(labels[name].gross, predicted[name].first) for name in names if labels[name].gross is not None])
    gross = _times([(predicted[name].gross, labels[name].gross) for name in names if labels[name].gross is not None])
    alarms = np.array([_is_false(predicted[name], labels[name], rest_end[name]) for name in names], dtype=float)
    early = np.where(np.isnan(error), 0.0, error < 0.0)
    before = np.where(np.isnan(lead), 0.0, lead > 0.0)
    leads = [None if np.isnan(lead_time) else float(lead_time) for lead_time in lead]
    return EventScores(
        trials=len(slips),
        missed=int(np.isnan(error).sum()),
        before_gross=_mean(before, seed),
        error=_mean(error, seed),
        absolute_error=_mean(np.abs(error), seed),
        error_spread=_spread(error),
        delay_frames=_middle(error / frame),
        early=_mean(early, seed),
        at_rest=_mean(alarms, seed),
        lead=_mean(lead, seed),
        lead_spread=_spread(lead),
        bound=lead_bound(leads, share) if len(leads) >= least_trials(share) else None,
        gross_error=_mean(gross, seed),
        gross_found=_mean((~np.isnan(gross)).astype(float), seed),
    )


def _times(pairs: list[tuple[float | None, float | None]]) -> Floats:
    """Return differences of times; NaN where one of them is missing."""
    return np.array(
        [np.nan if onset is None or other is None else onset - other for onset, other in pairs], dtype=float
    )


def _is_false(predicted: Onsets, label: Onsets, rest_end: float) -> bool:
    return predicted.first is not None and (label.first is None or predicted.first <= rest_end)


def _mean(values: Floats, seed: int) -> Estimate:
    """Return the mean of what is there, with its interval over all trials."""
    return bootstrap_estimate(lambda drawn: _known_mean(values[drawn]), len(values), seed=seed)


def _known_mean(values: Floats) -> float:
    finite = values[~np.isnan(values)]
    return float(finite.mean()) if finite.size else float("nan")


def _spread(values: Floats) -> float | None:
    finite = values[~np.isnan(values)]
    return float(finite.std(ddof=1)) if finite.size > 1 else None


def _middle(values: Floats) -> float | None:
    finite = values[~np.isnan(values)]
    return float(np.median(finite)) if finite.size else None


def score_submission(
    trials: TrialSet,
    submission: str | Path,
    *,
    labels: Mapping[str, Onsets] | None = None,
    seed: int = 0,
    rest_frames: int = 100,
) -> EventScores:
    """Return the scores of a submission on the test trials of a data set.

    Parameters
    ----------
    trials : TrialSet
        The data set.
    submission : path
        CSV file with the columns ``trial``, ``incipient_s`` and ``gross_s``, a row for each test trial; a cell is empty
        where no such slip was found.
    labels : mapping of str to Onsets, optional
        What is true; the labels from external markers without it.
    seed : int, optional
        Seed of the split: :func:`fingerslip.detect.samples.benchmark_test_trials`.
    rest_frames : int, optional
        Frames at rest at the start of each trial.

    Raises
    ------
    InputError
        Where the file is no such table, its trials are not the test trials, or one of these has no label.
    """
    tests = benchmark_test_trials(trials.names, seed)
    onsets_submitted = check_submission(read_onsets(submission), tests, str(submission))
    true = trials.onsets() if labels is None else labels
    check_labels(true, tests, needed=())
    ends, frame = rest_ends(trials, tests, rest_frames)
    return event_scores_of(onsets_submitted, true, ends, frame=frame, seed=seed)


def check_submission(submission: Mapping[str, Onsets], tests: tuple[str, ...], where: str) -> dict[str, Onsets]:
    """Return a submission in the order of the test trials."""
    mistakes = Mistakes()
    for name in sorted(set(tests) ^ set(submission)):
        problem = f"has no row for the test trial {name}" if name in tests else f"has a row for {name}, no test trial"
        mistakes.found.append(InputError(where, problem, f"needs the {len(tests)} test trials, each once"))
    for name in sorted(set(tests) & set(submission)):
        incipient, gross = submission[name].incipient, submission[name].gross
        if incipient is not None and gross is not None and gross < incipient:
            problem = f"has gross slip of {name} at {gross:g} s, incipient slip at {incipient:g} s"
            mistakes.found.append(InputError(where, problem, "needs gross slip last", "look for swapped columns"))
    mistakes.raise_all()
    return {name: submission[name] for name in tests}


def rest_ends(trials: TrialSet, names: tuple[str, ...], rest_frames: int) -> tuple[dict[str, float], float]:
    """Return until when each trial is at rest [s], and the median time between frames [s]."""
    ends, intervals = {}, []
    for name in names:
        time = trials.tracks(name)["time"].values
        if len(time) <= rest_frames:
            raise InputError(f"trial {name}", f"has {len(time)} frames", f"needs more than the {rest_frames} at rest")
        ends[name] = float(time[rest_frames - 1])
        intervals.append(np.median(np.diff(time)))
    return ends, float(np.median(intervals))
