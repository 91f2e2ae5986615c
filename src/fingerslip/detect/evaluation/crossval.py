"""Folds of trials, and their finished parts on disk."""

from __future__ import annotations

import shutil
import time
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial as partial_of
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fingerslip.detect.alarms import Smoother, Thresholds, false_alarm_threshold, onsets_from
from fingerslip.detect.classifiers import Candidate, columns_of, probabilities, union_of_sets
from fingerslip.detect.evaluation.scores import confusion_by_trial
from fingerslip.detect.features import FeatureSettings, feature_names, features_of
from fingerslip.detect.labels import CLASSES, Onsets
from fingerslip.detect.motion import MotionSettings, motion_of
from fingerslip.detect.optional import optional
from fingerslip.detect.samples import Samples, held_out, sample_split
from fingerslip.detect.training import (
    calibration_count,
    fit_detector,
    forward_filter,
    frame_scores,
    largest_before,
)
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError
from fingerslip.storage.files import check_folder, clean_stale, digest, new_file, writing
from fingerslip.version import __version__

__all__ = [
    "Fold",
    "FoldFrames",
    "FrameResult",
    "Parts",
    "events_by_trial",
    "fitted_fold",
    "frames_by_sample",
    "frames_by_trial",
    "joined_folds",
    "parts_beside",
    "rows_to_learn",
]


Arrays = dict[str, NDArray[Any]]

_FORMAT = 1
_CHECKSUM = "checksum"
# Arrays alone are written, so that reading them runs nothing.
_save: Callable[..., None] = partial_of(np.savez, allow_pickle=False)


@dataclass(frozen=True)
class Parts:
    """Where finished parts are kept: a file for each, named by what it was computed from."""

    folder: Path | None = None  # the folder, made with the first part
    inputs: str = ""  # hash of the data and of the options that all parts share

    def kept(self, name: str, inputs: Any) -> Arrays | None:
        """Return a part that is there, undamaged and of the same inputs; else None.

        Parameters
        ----------
        name : str
            What the part is, in letters that a file name may have.
        inputs : plain data
            What it is computed from, beside what all parts share.
        """
        return None if self.folder is None else _load_part(self._file(self.folder, name, inputs))

    def keep(self, name: str, inputs: Any, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a part, whole or not at all; raise ResultError where it cannot be written."""
        if self.folder is None:
            return
        with writing(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
        with new_file(self._file(self.folder, name, inputs)) as partial:
            _save(partial, **{_CHECKSUM: np.array(_checksum(arrays))}, **arrays)

    def part(self, name: str, inputs: Any, make: Callable[[], Mapping[str, NDArray[Any]]]) -> Arrays:
        """Return a part: the one that is kept, or else a new one, which is then kept."""
        arrays = self.kept(name, inputs)
        if arrays is None:
            arrays = dict(make())
            self.keep(name, inputs, arrays)
        return arrays

    def remove(self) -> None:
        """Remove all parts: the whole is there."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)

    def _file(self, folder: Path, name: str, inputs: Any) -> Path:
        versions = (_FORMAT, __version__, str(optional("sklearn").__version__))
        return folder / f"{name}-{digest(versions, self.inputs, name, inputs)[:20]}.npz"


def parts_beside(output: Path | None, *inputs: Any) -> Parts:
    """Return the parts of what is to be written to a folder: they are in ``OUTPUT.unfinished``."""
    if output is None:
        return Parts()
    check_folder(output)
    folder = output.with_name(f"{output.name}.unfinished")
    clean_stale(folder)
    return Parts(folder, digest(*inputs))


def _load_part(path: Path) -> Arrays | None:
    """Read a part; one that is damaged counts as none, and is computed again."""
    try:
        # numpy itself leaves a file open that is no whole archive.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays: Arrays = {name: stored[name] for name in stored.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile):
        return None
    checksum = arrays.pop(_CHECKSUM, None)
    return arrays if checksum is not None and str(checksum) == _checksum(arrays) else None


def _checksum(arrays: Mapping[str, NDArray[Any]]) -> str:
    described = [[name, str(array.dtype), list(array.shape)] for name, array in sorted(arrays.items())]
    return digest(described, *(array for _, array in sorted(arrays.items())))


Floats = NDArray[np.float64]


@dataclass
class Fold:
    """One classifier that learned from some trials."""

    candidate: Candidate  # what it is
    estimator: object  # the fitted pipeline
    smoother: Smoother  # from its probabilities to scores
    tested: tuple[str, ...]  # trials that it is tested on, and those that set its threshold
    kept: tuple[str, ...]  # trials that it is tested on, and those that set its threshold


@dataclass(frozen=True)
class FrameResult:
    """What a classifier said of frames of trials that it had not seen."""

    matrices: NDArray[np.intp]  # (n_trials, 3, 3), confusion matrix of each trial
    chances: Floats  # (n_samples, 3), probability of each class
    classes: NDArray[np.int8]  # (n_samples,), true classes
    folds: tuple[Fold, ...] = field(repr=False)
    seconds: float = 0.0  # processor time of fitting and of classifying the samples [s]


def frames_by_trial(
    samples: Samples,
    onsets: Mapping[str, Onsets],
    candidate: Candidate,
    tests: Sequence[Sequence[str]],
    *,
    window: int,
    share: float = 0.05,
    seed: int = 0,
    workers: int = 1,
) -> FrameResult:
    """Fit a classifier for each fold and return what it says of the samples of the trials left out."""
    start = time.process_time()
    results = [
        fitted_fold(samples, onsets, candidate, test, window=window, share=share, seed=seed, workers=workers)
        for test in tests
    ]
    result = joined_folds(samples, [part for _, part in results], tuple(fold for fold, _ in results))
    return replace(result, seconds=time.process_time() - start)


@dataclass(frozen=True)
class FoldFrames:
    """What a classifier says of the samples of the trials that a fold leaves out."""

    rows: NDArray[np.intp]  # (n_tested,), their rows among all samples
    chances: Floats  # (n_tested, 3), probability of each class


def fitted_fold(
    samples: Samples,
    onsets: Mapping[str, Onsets],
    candidate: Candidate,
    test: Sequence[str],
    *,
    window: int,
    share: float = 0.05,
    seed: int = 0,
    workers: int = 1,
) -> tuple[Fold, FoldFrames]:
    """Fit a classifier for one fold; for the parameters see :func:`frames_by_trial`."""
    learned, calibration_trials = rows_to_learn(samples, test, share, seed)
    with threadpool_limits(workers):
        estimator = fit_detector(candidate, samples, learned, seed, workers)
        rows = np.flatnonzero(np.isin(np.array(samples.trials)[samples.trial], list(test)))
        values = samples.values[np.ix_(rows, columns_of(samples.names, candidate.sets))]
        part = FoldFrames(rows, probabilities(estimator, values))
    return Fold(
        candidate, estimator, forward_filter(samples, onsets, window, learned), tuple(test), calibration_trials
    ), part


def joined_folds(samples: Samples, pieces: Sequence[FoldFrames], folds: tuple[Fold, ...] = ()) -> FrameResult:
    """Return what a classifier said in all folds together."""
    rows, chances = (np.concatenate([getattr(part, name) for part in pieces]) for name in ("rows", "chances"))
    classes = samples.classes[rows]
    matrices = confusion_by_trial(classes, chances.argmax(axis=1).astype(np.int8), samples.trial[rows])
    return FrameResult(matrices, chances, classes, folds)


def rows_to_learn(
    samples: Samples, test: Sequence[str], share: float = 0.05, seed: int = 0
) -> tuple[NDArray[np.intp], tuple[str, ...]]:
    """Return the rows that a fold learns from, and the trials that set its threshold."""
    names, rest = np.array(samples.trials), [name for name in samples.trials if name not in set(test)]
    calibration = held_out(rest, calibration_count(len(rest), share), seed + 1)
    rows = np.flatnonzero(~np.isin(names[samples.trial], [*test, *calibration]))
    if not rows.size:
        raise InputError("folds", "leave no trial to learn from", "needs some", "take more trials or other folds")
    missing = [name for number, name in enumerate(CLASSES) if number not in samples.classes[rows]]
    if missing:
        where, fault = f"the fold that leaves out trial {test[0]}", f"has no frame of {missing[0]} to learn from"
        raise InputError(where, fault, "needs frames of all classes", "take more trials or fewer folds")
    return rows, calibration


def frames_by_sample(samples: Samples, candidate: Candidate, *, seed: int = 0, workers: int = 1) -> NDArray[np.intp]:
    """Return the confusion matrices of trials when samples are split 90 to 10 whatever their trial, as published."""
    tested = sample_split(len(samples.classes), seed)
    with threadpool_limits(workers):
        estimator = fit_detector(candidate, samples, np.flatnonzero(~tested), seed, workers)
        values = samples.values[np.ix_(np.flatnonzero(tested), columns_of(samples.names, candidate.sets))]
        classes = probabilities(estimator, values).argmax(axis=1).astype(np.int8)
    return confusion_by_trial(samples.classes[tested], classes, samples.trial[tested])


def events_by_trial(
    trials: TrialSet,
    onsets: Mapping[str, Onsets],
    results: Sequence[FrameResult],
    motion: MotionSettings,
    *,
    share: float = 0.05,
    workers: int = 1,
) -> list[dict[str, Onsets]]:
    """Return the onsets that each classifier finds in the trials that it was not fitted to.

    Every trial is read once. The threshold of each fold is set by its kept trials; without them it is where slip is as
    likely as not.
    """
    folds = [fold for result in results for fold in result.folds]
    settings = FeatureSettings(union_of_sets([fold.candidate for fold in folds]), motion)
    maxima: list[list[float]] = [[] for _ in folds]
    scores: list[dict[str, tuple[Floats, Floats]]] = [{} for _ in folds]
    used = {name for fold in folds for name in (*fold.tested, *fold.kept)}
    with threadpool_limits(workers):
        for name in (name for name in trials.names if name in used):
            maxima_by_trial = _scores(trials, name, folds, settings)
            for number, (when, entry) in maxima_by_trial.items():
                if name in folds[number].tested:
                    scores[number][name] = when, entry
                else:
                    maxima[number].append(largest_before(when, entry, onsets[name]))
    limits = [Thresholds(false_alarm_threshold(entry, share)) if entry else Thresholds() for entry in maxima]
    events = [
        {name: onsets_from(*entry, limit) for name, entry in score.items()}
        for score, limit in zip(scores, limits, strict=True)
    ]
    return _by_result(results, events)


def _scores(
    trials: TrialSet, name: str, folds: Sequence[Fold], settings: FeatureSettings
) -> dict[int, tuple[Floats, Floats]]:
    """Return times and scores of a trial for every fold that needs it, by the number of the fold."""
    moved = motion_of(trials.tracks(name), settings.motion)
    values, names = features_of(moved, settings), feature_names(moved, settings)
    scores = {}
    for number, fold in enumerate(folds):
        if name in fold.tested or name in fold.kept:
            chances = probabilities(fold.estimator, values[:, columns_of(names, fold.candidate.sets)])
            chances[~moved.usable] = np.nan
            scores[number] = moved.time, frame_scores(fold.smoother, moved.time, chances)
    return scores


def _by_result(results: Sequence[FrameResult], events: list[dict[str, Onsets]]) -> list[dict[str, Onsets]]:
    ends = np.cumsum([len(result.folds) for result in results])
    starts = [end - len(result.folds) for end, result in zip(ends, results, strict=True)]
    return [
        {name: onsets for event in events[first:last] for name, onsets in event.items()}
        for first, last in zip(starts, ends, strict=True)
    ]
