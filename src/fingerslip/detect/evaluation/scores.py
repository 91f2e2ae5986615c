"""Scores of frames, events and submissions to the benchmark, with intervals over trials."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.detect.labels import CLASSES, Onsets, read_onsets, times_of
from fingerslip.detect.samples import benchmark_test_trials
from fingerslip.detect.training import lead_bound, least_trials
from fingerslip.detect.trials import TrialSet, check_labels
from fingerslip.errors import InputError, Mistakes
from fingerslip.storage.files import write_text, writing
from fingerslip.tables.table import Cell, Column, Interval, Missing, Table, to_csv, to_page

_COUNT = len(CLASSES)
_DRAWS, _BINS = 1000, 10  # of the bootstrap, and of the calibration error


@dataclass(frozen=True)
class Estimate:
    """A number and the middle 95 % of what it is for resampled trials."""

    value: float | None
    low: float | None = None
    high: float | None = None


def bootstrap_estimates(
    statistics: Callable[[NDArray[np.intp]], Floats], trials: int, *, seed: int = 0
) -> tuple[Estimate, ...]:
    """Return statistics of trials with their intervals (percentile bootstrap, Efron & Tibshirani 1993).

    `statistics` gets numbers of trials, (n_draws, n_trials), and returns (n_draws, n_statistics), NaN where there is
    none. An interval needs half of the draws.
    """
    values = np.atleast_2d(statistics(np.arange(trials)[None]))[0]
    drawn = np.full((1, len(values)), np.nan)
    if trials > 1:
        drawn = statistics(np.random.default_rng(seed).integers(trials, size=(_DRAWS, trials)))
    estimates = []
    for value, column in zip(values, drawn.T, strict=True):
        finite = column[np.isfinite(column)]
        ends = np.quantile(finite, (0.025, 0.975)).tolist() if len(finite) >= _DRAWS / 2 else ()
        estimates.append(Estimate(float(value), *ends) if np.isfinite(value) else Estimate(None))
    return tuple(estimates)


def ratio_estimate(part: Floats, whole: Floats, seed: int = 0) -> Estimate:
    """Return the sum of `part` over that of `whole`, (n_trials,) both, with its interval."""

    def ratios(drawn: NDArray[np.intp]) -> Floats:
        return _ratio(part[drawn].sum(axis=1), whole[drawn].sum(axis=1))[:, None]

    return bootstrap_estimates(ratios, len(part), seed=seed)[0]


def _ratio(part: NDArray[np.number], whole: NDArray[np.number]) -> Floats:
    ratio: Floats = np.divide(part, whole, out=np.full(np.shape(part), np.nan), where=whole > 0)
    return ratio


@dataclass(frozen=True)
class FrameScores:
    """How well frames are classified: the confusion matrix, and scores of each class."""

    matrix: NDArray[np.intp]  # (3, 3), frames by true class (rows) and predicted class (columns)
    accuracy: Estimate
    f1_mean: Estimate
    two_class: Estimate  # share of the frames for which it is told rightly whether all slips
    precision: tuple[Estimate, ...]
    recall: tuple[Estimate, ...]
    f1: tuple[Estimate, ...]


def confusion_by_trial(
    true: NDArray[np.int8], predicted: NDArray[np.int8], trial: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return a confusion matrix for each trial, (n_trials, 3, 3), rows the true class; arguments are (n_samples,)."""
    _, number = np.unique(trial, return_inverse=True)
    trials = int(number.max()) + 1 if number.size else 0
    index = (number * _COUNT + true) * _COUNT + predicted
    return np.bincount(index, minlength=trials * _COUNT**2).reshape(trials, _COUNT, _COUNT)


def frame_scores_of(matrices: NDArray[np.intp], *, seed: int = 0) -> FrameScores:
    """Return the scores of confusion matrices (n_trials, 3, 3), with intervals from trials that are drawn anew."""

    def scores(drawn: NDArray[np.intp]) -> Floats:
        total = matrices[drawn].sum(axis=1)
        right, columns, rows = np.diagonal(total, axis1=1, axis2=2).astype(float), total.sum(axis=1), total.sum(axis=2)
        # Precision, recall and F1 of each class.
        of_classes = [_ratio(right, columns), _ratio(right, rows), _ratio(2.0 * right, columns + rows)]
        accuracy = _ratio(np.trace(total, axis1=1, axis2=2), total.sum(axis=(1, 2)))
        f1_mean = _ratio(np.nansum(of_classes[2], axis=1), np.isfinite(of_classes[2]).sum(axis=1))
        mistaken = total[:, -1, :-1].sum(axis=1) + total[:, :-1, -1].sum(axis=1)
        two_class = 1.0 - _ratio(mistaken, total.sum(axis=(1, 2)))
        return np.column_stack([accuracy, f1_mean, two_class, *of_classes])

    accuracy, f1_mean, two_class, *classes = bootstrap_estimates(scores, len(matrices), seed=seed)
    of_classes = (tuple(classes[first : first + _COUNT]) for first in range(0, 3 * _COUNT, _COUNT))
    return FrameScores(matrices.sum(axis=0), accuracy, f1_mean, two_class, *of_classes)


def reliability_of(chances: Floats, classes: NDArray[np.int8]) -> tuple[float, float]:
    """Return how far probabilities (n_samples, 3) of classes (n_samples,) are from how often frames slip.

    First the expected calibration error, the mean difference weighted by frames (Guo et al. 2017), then the Brier score
    over all classes (Brier 1950): 0 is perfect, 2 the worst.
    """
    slip, slips = 1.0 - chances[:, 0], classes > 0
    number = np.clip((slip * _BINS).astype(np.intp), 0, _BINS - 1)
    excess = np.bincount(number, weights=slip - slips, minlength=_BINS)
    truth = classes[:, None] == np.arange(chances.shape[1])
    brier = ((chances - truth) ** 2).sum(axis=1).mean()
    return float(np.abs(excess).sum() / max(len(classes), 1)), float(brier)


@dataclass(frozen=True)
class EventScores:
    """How well events are found; errors are the time found less the label [s]."""

    trials: int  # trials with incipient slip
    missed: int  # of them, those in which no slip was found
    before_gross: Estimate  # share of the trials with gross slip that had an alarm before it, early or not
    error: Estimate
    absolute_error: Estimate
    error_spread: float | None  # standard deviation [s]
    delay_frames: float | None  # median error in frames
    later_delay_frames: float | None  # the same of alarms that are not early
    early: Estimate  # share of the trials with an alarm before the label of slip: a false one
    at_rest: Estimate  # share of all trials in which slip was found at rest, or where there is none
    lead: Estimate  # mean time from alarms that are neither early nor at rest to the label of gross slip [s]
    lead_spread: float | None  # its standard deviation [s]
    bound: float | None  # lead that a new trial has with 95 % [s]; an early alarm has none
    lead_of_all: Estimate  # the same mean over all alarms, as papers count it [s]
    lead_of_all_spread: float | None  # its standard deviation [s]
    gross_error: Estimate
    gross_found: Estimate  # share of the trials with gross slip in which gross slip was found at all


def event_scores_of(
    predicted: Mapping[str, Onsets],
    labels: Mapping[str, Onsets],
    rest_end: Mapping[str, float],
    *,
    frame: float = np.nan,
    seed: int = 0,
) -> EventScores:
    """Return the scores of the onsets found in trials; `rest_end` and `frame` are in seconds."""

    def mean(values: Floats) -> Estimate:
        return ratio_estimate(np.nan_to_num(values), np.isfinite(values).astype(float), seed)

    def spread(values: Floats) -> float | None:
        finite = values[np.isfinite(values)]
        return float(finite.std(ddof=1)) if len(finite) > 1 else None

    found, true = times_of(predicted.values()), times_of(labels[name] for name in predicted)
    # The earlier of both onsets; NaN where there is none.
    first, first_true = np.fmin(*found.T), np.fmin(*true.T)
    is_false = np.isfinite(first) & (np.isnan(first_true) | (first <= [rest_end[name] for name in predicted]))
    slips, gross_slips = np.isfinite(true).T
    error, lead_of_all = (first - true[:, 0])[slips], (true[:, 1] - first)[gross_slips]
    lead = np.where((is_false | (first < true[:, 0]))[gross_slips], np.nan, lead_of_all)
    gross = (found[:, 1] - true[:, 1])[gross_slips]
    delays = error[np.isfinite(error)]
    medians = [
        float(np.median(values / frame)) if len(values) and np.isfinite(frame) else None
        for values in (delays, delays[delays >= 0.0])
    ]
    return EventScores(
        trials=len(error),
        missed=len(error) - len(delays),
        before_gross=mean((lead_of_all > 0.0).astype(float)),
        error=mean(error),
        absolute_error=mean(np.abs(error)),
        error_spread=spread(error),
        delay_frames=medians[0],
        later_delay_frames=medians[1],
        early=mean((error < 0.0).astype(float)),
        at_rest=mean(is_false.astype(float)),
        lead=mean(lead),
        lead_spread=spread(lead),
        bound=lead_bound(np.where(np.isnan(lead), -np.inf, lead).tolist()) if len(lead) >= least_trials() else None,
        lead_of_all=mean(lead_of_all),
        lead_of_all_spread=spread(lead_of_all),
        gross_error=mean(gross),
        gross_found=mean(np.isfinite(gross).astype(float)),
    )


def score_submission(
    trials: TrialSet,
    submission: str | Path,
    *,
    labels: Mapping[str, Onsets] | None = None,
    seed: int = 0,
    rest_frames: int = 100,
) -> EventScores:
    """Return the scores of a submission, a CSV file of onsets, on the test trials of a data set.

    What is true are the labels given, or those from external markers. The seed is that of the split,
    :func:`fingerslip.detect.samples.benchmark_test_trials`.
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


INTERVALS = "Brackets: the middle 95 % over trials drawn anew."
_THREE_DIGITS = ("leakage", "calibration error", "Brier score", "unusable")


def table_of(
    title: str, names: Sequence[str | Column], rows: Sequence[Sequence[object]], note: str = INTERVALS
) -> Table:
    """Return a table of estimates with their intervals, and other values."""

    def cell(value: object) -> Cell:
        if isinstance(value, Estimate) and value.value is not None:
            return Interval(value.value, value.low, value.high)
        return Missing.NOT_DEFINED if value is None or isinstance(value, Estimate) else value  # type: ignore[return-value]

    columns = tuple(
        name if isinstance(name, Column) else Column(name, digits=3) if name in _THREE_DIGITS else Column(name)
        for name in names
    )
    return Table(title, columns, tuple(tuple(map(cell, row)) for row in rows), note)


def accuracy_table(by_trial: Mapping[str, FrameScores], by_sample: Mapping[str, Estimate], note: str) -> Table:
    """Return accuracies by trial beside those by sample, and the difference, which is what leaks."""
    rows: list[tuple[object, ...]] = []
    for name, scores in by_trial.items():
        accuracy, other = scores.accuracy, by_sample[name]
        leak = None if accuracy.value is None or other.value is None else other.value - accuracy.value
        rows.append((name, accuracy, other, leak, scores.two_class))
    names = ("classifier", "by trial", "by sample", "leakage", "gross or not, by trial")
    return table_of("Accuracy on frames", names, rows, f"{note} {INTERVALS}")


def frame_tables(by_trial: Mapping[str, FrameScores]) -> list[Table]:
    """Return precision, recall and F1 of each class on trials that were not seen, and the confusion of their frames."""
    classes, confusions = [], []
    for name, scores in by_trial.items():
        for number, entry in enumerate(CLASSES):
            classes.append((name, entry, scores.precision[number], scores.recall[number], scores.f1[number]))
            confusions.append((name, entry, *map(int, scores.matrix[number])))
    names = ("classifier", "class", "precision", "recall", "F1")
    columns = ("classifier", "true class", *(f"found {entry}" for entry in CLASSES))
    return [
        table_of("Classes, on trials that were not seen", names, classes),
        table_of("Confusion, frames", columns, confusions, ""),
    ]


_EVENTS: tuple[tuple[str, str], ...] = (
    ("missed", "missed"),
    ("found before gross slip", "before_gross"),
    ("early alarm", "early"),
    ("false alarm", "at_rest"),
    ("onset error [s]", "error"),
    ("absolute error [s]", "absolute_error"),
    ("error, standard deviation [s]", "error_spread"),
    ("median delay [frames]", "delay_frames"),
    ("median delay, not early [frames]", "later_delay_frames"),
    ("lead before gross slip [s]", "lead"),
    ("lead, standard deviation [s]", "lead_spread"),
    ("lead of 95 % of trials [s]", "bound"),
    ("gross slip found", "gross_found"),
    ("gross onset error [s]", "gross_error"),
)
_EVENT_NOTE = (
    "Errors are time found less label, of early alarms too. Early alarm: before the label of slip, by however little. "
    "False alarm: at rest, or where there is no slip. Leads are those of other alarms. "
    f"Lead of 95 %: conformal bound, needs 19 trials. {INTERVALS}"
)


def event_table(scores: Mapping[str, EventScores], note: str = "", title: str = "Onset of slip") -> Table:
    """Return scores of events, a column for each classifier."""

    def text(value: object) -> object:
        return f"{value:z.3f}" if isinstance(value, float) else str(value) if isinstance(value, int) else value

    rows = [(label, *(text(getattr(entry, name)) for entry in scores.values())) for label, name in _EVENTS]
    return table_of(title, ("event", *scores), rows, f"{note} {_EVENT_NOTE}".strip())


def output_tables(tables: Sequence[Table], folder: Path | None = None) -> str:
    """Return tables in Markdown, and write each as a CSV file where a folder is given."""
    if folder is not None:
        names = ("-".join(table.title.lower().replace(",", "").split()) for table in tables)
        numbered = enumerate(zip(names, tables, strict=True), start=1)
        write_tables({f"{number}-{name}": table for number, (name, table) in numbered}, folder)
    return to_page(tables)


def write_tables(tables: Mapping[str, Table], folder: Path) -> None:
    """Write tables as CSV files by their names; other files of the folder stay."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for name, table in tables.items():
        write_text(folder / f"{name}.csv", to_csv(table))
