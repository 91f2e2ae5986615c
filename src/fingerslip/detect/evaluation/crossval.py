"""Classifiers on trials that they have not seen: folds, what they say of frames and events, kept when it is done."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fingerslip.arrays import Floats
from fingerslip.detect.classifiers import Candidate, describe, fit, optional, probabilities, union_of_sets
from fingerslip.detect.evaluation.scores import (
    EventScores,
    FrameScores,
    confusion_by_trial,
    event_scores_of,
    frame_scores_of,
    rest_ends,
)
from fingerslip.detect.features import FeatureSettings, MotionSettings, feature_names, features_of, motion_of
from fingerslip.detect.labels import CLASSES, Onsets, classes_at, onsets_of, times_of
from fingerslip.detect.samples import Samples, Sampling, columns_of, held_out, sample_split, samples_of
from fingerslip.detect.training import (
    UNLIKE,
    Detector,
    ForwardFilter,
    Thresholds,
    calibration_count,
    false_alarm_threshold,
    forward_filter,
    frame_chances,
    frame_scores,
    largest_before,
    onsets_from,
    rate_fault,
    single_frame_scores,
    strange_shares,
)
from fingerslip.detect.trials import TrialSet, check_labels
from fingerslip.errors import InputError
from fingerslip.storage.files import check_folder, clean_stale, digest, new_file, writing
from fingerslip.version import __version__

Arrays = Mapping[str, NDArray[Any]]
Groups = Sequence[Sequence[str]]

_FORMAT = 3


#: What reading arrays back may raise.
UNREADABLE = (OSError, ValueError, EOFError, zipfile.BadZipFile)


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read an archive of arrays, which has a checksum of each; nothing else is read, so that nothing runs."""
    # numpy itself leaves a file open that is no whole archive.
    with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


@dataclass(frozen=True)
class Parts:
    """Where finished parts are stored: a file of arrays for each, named by what it was computed from."""

    folder: Path | None = None  # made with the first part
    inputs: str = ""  # hash of the data and of the options that all parts share

    def read(self, name: str, inputs: Any) -> Arrays | None:
        """Return a part that is there, undamaged and of the same inputs (plain data); else None."""
        if self.folder is None:
            return None
        try:
            return read_arrays(self._file(self.folder, name, inputs))
        except UNREADABLE:
            return None

    def write(self, name: str, inputs: Any, arrays: Arrays) -> Arrays:
        """Write a part, whole or not at all, and return it; raise ResultError where it cannot be written."""
        if self.folder is not None:
            with writing(self.folder):
                self.folder.mkdir(parents=True, exist_ok=True)
            with new_file(self._file(self.folder, name, inputs)) as partial:
                np.savez(partial, **dict[str, Any](arrays))
        return arrays

    def part(self, name: str, inputs: Any, make: Callable[[], Arrays]) -> Arrays:
        """Return a part: the stored one, or else a new one, which is then stored."""
        arrays = self.read(name, inputs)
        return self.write(name, inputs, make()) if arrays is None else arrays

    def remove(self) -> None:
        """Remove all parts: the whole is there."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)

    def _file(self, folder: Path, name: str, inputs: Any) -> Path:
        versions = (_FORMAT, __version__, str(optional("sklearn").__version__))
        # A colon is in no name that every file system takes.
        return folder / f"{name.replace(':', '.')}-{digest(versions, self.inputs, name, inputs)[:20]}.npz"


def parts_beside(output: Path | None, *inputs: Any) -> Parts:
    """Return the parts of what is to be written to a folder: they are in ``OUTPUT.unfinished``."""
    if output is None:
        return Parts()
    check_folder(output)
    folder = output.with_name(f"{output.name}.unfinished")
    clean_stale(folder)
    return Parts(folder, digest(*inputs))


@dataclass(frozen=True)
class FoldFrames:
    """What a classifier says of the samples of the trials that a fold leaves out."""

    rows: NDArray[np.intp]  # (n_tested,), their rows among all samples
    chances: Floats  # (n_tested, 3), probability of each class

    @classmethod
    def of(cls, folds: Sequence[FoldFrames]) -> FoldFrames:
        """Return what is said of the samples of some folds."""
        return cls(np.concatenate([fold.rows for fold in folds]), np.concatenate([fold.chances for fold in folds]))


@dataclass(frozen=True)
class Fold:
    """One classifier that learned from some trials."""

    candidate: Candidate
    estimator: object  # the fitted pipeline
    smoother: ForwardFilter
    tested: tuple[str, ...]  # trials that it is tested on
    calibration: tuple[str, ...]  # trials that set its threshold
    frames: FoldFrames


@dataclass(frozen=True)
class Evaluation:
    """What classifiers are evaluated on; every part of it is stored when it is done."""

    trials: TrialSet
    onsets: Mapping[str, Onsets]  # labels of its trials
    samples: Samples  # sampled frames with the features of all candidates
    motion: MotionSettings
    seed: int = 0
    workers: int = 1
    share: float = 0.05  # of the trials without slip, that may raise a false alarm
    parts: Parts = field(default_factory=Parts)

    def rows_to_learn(self, test: Sequence[str]) -> tuple[NDArray[np.intp], tuple[str, ...]]:
        """Return the rows that a fold learns from, and the trials that set its threshold."""
        rest = self.samples.trials_without(test)
        calibration = held_out(rest, calibration_count(len(rest), self.share), self.seed + 1)
        rows = self.samples.rows([name for name in rest if name not in set(calibration)])
        if not rows.size:
            raise InputError("folds", "leave no trial to learn from", "needs some", "take more trials or other folds")
        missing = [name for number, name in enumerate(CLASSES) if number not in self.samples.classes[rows]]
        if missing:
            where, fault = f"the fold that leaves out trial {test[0]}", f"has no frame of {missing[0]} to learn from"
            raise InputError(where, fault, "needs frames of all classes", "take more trials or fewer folds")
        return rows, calibration

    def fit_rows(
        self, candidate: Candidate, learned: NDArray[np.intp], tested: NDArray[np.intp]
    ) -> tuple[Any, FoldFrames]:
        """Return a classifier that is fitted to some rows of the samples, and what it says of others."""
        values, classes = self.samples.features(learned, candidate.sets), self.samples.classes[learned]
        with threadpool_limits(self.workers):
            estimator = fit(candidate, values, classes, seed=self.seed, workers=self.workers)
            chances = probabilities(estimator, self.samples.features(tested, candidate.sets))
        return estimator, FoldFrames(tested, chances)

    def fit(self, candidate: Candidate, test: Sequence[str]) -> Fold:
        """Fit a classifier to the trials that are not tested, and classify the samples of those that are."""
        learned, calibration = self.rows_to_learn(test)
        estimator, frames = self.fit_rows(candidate, learned, self.samples.rows(test))
        smoother = forward_filter(self.samples, self.onsets, self.motion.window, learned)
        return Fold(candidate, estimator, smoother, tuple(test), calibration, frames)

    def matrices(self, frames: Sequence[FoldFrames]) -> NDArray[np.intp]:
        """Return the confusion matrices (n_trials, 3, 3) of the trials of some folds."""
        whole = FoldFrames.of(frames)
        classes = whole.chances.argmax(axis=1).astype(np.int8)
        return confusion_by_trial(self.samples.classes[whole.rows], classes, self.samples.trial[whole.rows])

    def scores(self, frames: Sequence[FoldFrames]) -> FrameScores:
        """Return the scores of frames of some folds."""
        return frame_scores_of(self.matrices(frames), seed=self.seed)

    def events(self, folds: Sequence[Fold]) -> list[dict[str, Onsets]]:
        """Return the onsets that each fold finds in the trials that it is tested on; every trial is read once.

        The threshold of a fold is set by its calibration trials; without them it is where slip is as likely as not.
        """
        settings = FeatureSettings(union_of_sets([fold.candidate for fold in folds]), self.motion)
        maxima: list[list[float]] = [[] for _ in folds]
        scores: list[dict[str, tuple[Floats, Floats]]] = [{} for _ in folds]
        used = {name for fold in folds for name in (*fold.tested, *fold.calibration)}
        with threadpool_limits(self.workers):
            for name in (name for name in self.trials.names if name in used):
                moved = motion_of(self.trials.tracks(name), self.motion)
                values, names = features_of(moved, settings), feature_names(moved, settings)
                for number, fold in enumerate(folds):
                    if name not in (*fold.tested, *fold.calibration):
                        continue
                    chances = probabilities(fold.estimator, values[:, columns_of(names, fold.candidate.sets)])
                    trial_scores = frame_scores(fold.smoother, moved, chances)
                    if name in fold.tested:
                        scores[number][name] = moved.time, trial_scores
                    else:
                        maxima[number].append(largest_before(moved.time, trial_scores, self.onsets[name]))
        limits = [Thresholds(false_alarm_threshold(entry, self.share)) if entry else Thresholds() for entry in maxima]
        return [
            {name: onsets_from(*trial_scores, limit) for name, trial_scores in fold_scores.items()}
            for fold_scores, limit in zip(scores, limits, strict=True)
        ]

    def by_sample(self, candidate: Candidate) -> NDArray[np.intp]:
        """Return the confusion matrices of trials when samples are split 90 to 10 whatever their trial."""

        def part() -> Arrays:
            tested = sample_split(len(self.samples.classes), self.seed)
            _, frames = self.fit_rows(candidate, np.flatnonzero(~tested), np.flatnonzero(tested))
            return {"matrices": self.matrices([frames])}

        return self.parts.part(f"{candidate.name}-by-sample", describe(candidate, self.seed), part)["matrices"]

    def by_group(self, candidate: Candidate, groups: Groups) -> list[FoldFrames]:
        """Return what a classifier says of the trials of each group after it has learned from those of the others."""

        def part(test: Sequence[str]) -> Arrays:
            inputs = [*describe(candidate, self.seed), list(test)]
            return self.parts.part(f"{candidate.name}-frames", inputs, lambda: vars(self.fit(candidate, test).frames))

        return [FoldFrames(**part(test)) for test in groups]

    def by_fold(
        self, candidates: Sequence[Candidate], tests: Groups
    ) -> tuple[dict[str, list[FoldFrames]], dict[str, dict[str, Onsets]]]:
        """Return frames and events of classifiers on trials that they have not seen, both by name of the classifier.

        All classifiers of a fold are fitted before the next fold, so that its trials are read once for all of them.
        """
        frames: dict[str, list[FoldFrames]] = {candidate.name: [] for candidate in candidates}
        events: dict[str, dict[str, Onsets]] = {candidate.name: {} for candidate in candidates}
        for test in tests:
            inputs = {entry.name: [*describe(entry, self.seed), list(test)] for entry in candidates}
            keys = {name: (f"{name}-fold", values) for name, values in inputs.items()}
            stored = {name: arrays for name, key in keys.items() if (arrays := self.parts.read(*key)) is not None}
            folds = [self.fit(candidate, test) for candidate in candidates if candidate.name not in stored]
            for fold, onsets in zip(folds, self.events(folds) if folds else [], strict=True):
                name, times = fold.candidate.name, times_of(onsets[trial] for trial in test)
                stored[name] = self.parts.write(*keys[name], {**vars(fold.frames), "onsets": times})
            for name, arrays in stored.items():
                frames[name].append(FoldFrames(arrays["rows"], arrays["chances"]))
                events[name] |= zip(test, onsets_of(arrays["onsets"]), strict=True)
        return frames, {name: {trial: onsets[trial] for trial in self.trials.names} for name, onsets in events.items()}


def begin_evaluation(
    trials: TrialSet,
    onsets: Mapping[str, Onsets],
    candidates: Sequence[Candidate],
    motion: MotionSettings,
    sampling: Sampling,
    *,
    seed: int = 0,
    workers: int = 1,
    output: Path | None = None,
) -> Evaluation:
    """Sample the frames of a data set for an evaluation."""
    labels = {name: [onset.incipient, onset.gross] for name, onset in onsets.items()}
    store = parts_beside(output, trials.digest, labels, [asdict(motion), asdict(sampling)], seed)
    samples = samples_of(trials, onsets, FeatureSettings(union_of_sets(candidates), motion), sampling)
    return Evaluation(trials, onsets, samples, motion, seed, workers, parts=store)


#: How onsets are read from frames: as the detector does it, and by the first frame that is more likely slip than not.
READINGS = ("detector", "single frames")


@dataclass(frozen=True)
class Unseen:
    """What a detector finds in trials that it did not learn from."""

    onsets: Mapping[str, Mapping[str, Onsets]]  # of every trial, by reading
    scores: Mapping[str, EventScores]  # by reading
    matrices: NDArray[np.intp]  # (n_trials, 3, 3), confusion of all frames
    rate_fault: str = ""  # how the frame rate of the trials differs from that of the detector
    unlike: int = 0  # trials that are unlike those that it learned from


def on_unseen(detector: Detector, trials: TrialSet, onsets: Mapping[str, Onsets]) -> Unseen:
    """Return what a detector finds in all trials of a data set that it did not learn from."""
    if detector.data == trials.digest:
        repair = "fingerslip detect evaluate leaves trials out in turn"
        raise InputError(str(trials.folder), "is what the detector learned from", "needs another data set", repair)
    check_labels(onsets, trials.names, needed=())
    results: dict[str, dict[str, Onsets]] = {reading: {} for reading in READINGS}
    matrices, unlike = [], 0
    for name in trials.names:
        tracks = trials.tracks(name)
        motion, chances = frame_chances(detector, tracks)
        unlike += int(strange_shares(detector, tracks).max() > UNLIKE)
        usable, likely = motion.usable, chances.argmax(axis=1).astype(np.int8)
        true, one_trial = classes_at(onsets[name], motion.time)[usable], np.zeros(int(usable.sum()), dtype=np.intp)
        matrices.append(confusion_by_trial(true, likely[usable], one_trial))
        smoothed = frame_scores(detector.smoother, motion, chances)
        alone = single_frame_scores(np.where(usable[:, None], chances, np.nan))
        results[READINGS[0]][name] = onsets_from(motion.time, smoothed, detector.thresholds)
        results[READINGS[1]][name] = onsets_from(motion.time, alone)
    ends, frame = rest_ends(trials, trials.names, detector.features.motion.rest_frames)
    scores = {reading: event_scores_of(result, onsets, ends, frame=frame) for reading, result in results.items()}
    return Unseen(results, scores, np.concatenate(matrices), rate_fault(detector, 1.0 / frame), unlike)
