"""An evaluation of many classifiers in parts, each of which is kept when it is done: frames, events, left out."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.classifiers import Candidate, describe, union_of_sets
from fingerslip.detect.evaluation.crossval import (
    Fold,
    FoldFrames,
    FrameResult,
    Parts,
    events_by_trial,
    fitted_fold,
    frames_by_sample,
    joined_folds,
    parts_beside,
    rows_to_learn,
)
from fingerslip.detect.features import FeatureSettings
from fingerslip.detect.labels import Onsets
from fingerslip.detect.motion import MotionSettings
from fingerslip.detect.samples import Samples, Sampling, samples_of
from fingerslip.detect.trial_set import TrialSet

__all__ = ["Evaluation", "begun_evaluation"]

Groups = Sequence[Sequence[str]]
Events = dict[str, dict[str, Onsets]]


@dataclass(frozen=True)
class Evaluation:
    """What classifiers are evaluated on."""

    trials: TrialSet  # the data set
    onsets: Mapping[str, Onsets]  # labels of its trials
    samples: Samples  # sampled frames with the features of all candidates
    motion: MotionSettings  # how motion is read
    seed: int = 0  # seed of what is random, and cores
    workers: int = 1  # seed of what is random, and cores
    parts: Parts = field(default_factory=Parts)

    def check(self, groups: Groups) -> None:
        """Check that every fold has something of each class to learn from, before anything is fitted.

        Raises
        ------
        InputError
            Where one has not.
        """
        for test in groups:
            rows_to_learn(self.samples, test, seed=self.seed)

    def by_sample(self, candidate: Candidate) -> NDArray[np.intp]:
        """Return the confusion matrices of trials when frames are split 90 to 10 whatever their trial."""

        def made() -> dict[str, NDArray[Any]]:
            return {"matrices": frames_by_sample(self.samples, candidate, seed=self.seed, workers=self.workers)}

        name = _name(candidate, "by-sample")
        return self.parts.part(name, self._describe(candidate), made)["matrices"]

    def by_group(self, candidate: Candidate, groups: Groups) -> list[FoldFrames]:
        """Return what a classifier says of the trials of each group after it has learned from those of the others."""
        return [self._of_group(candidate, test) for test in groups]

    def by_fold(self, candidates: Sequence[Candidate], tests: Groups) -> tuple[dict[str, FrameResult], Events]:
        """Return frames and events of classifiers on trials that they have not seen, both by name of the classifier.

        All classifiers of a fold are fitted before the next fold, so that its trials are read once for all of them.
        """
        frames: dict[str, list[FoldFrames]] = {candidate.name: [] for candidate in candidates}
        events: dict[str, dict[str, Onsets]] = {candidate.name: {} for candidate in candidates}
        for test in tests:
            for name, (part, onsets) in self._of_fold(candidates, test).items():
                frames[name].append(part)
                events[name] |= onsets
        ordered = {name: {trial: event[trial] for trial in self.trials.names} for name, event in events.items()}
        return {name: joined_folds(self.samples, frame) for name, frame in frames.items()}, ordered

    def _of_group(self, candidate: Candidate, test: Sequence[str]) -> FoldFrames:
        def made() -> dict[str, NDArray[Any]]:
            return vars(self._fit(candidate, test)[1])

        return FoldFrames(**self.parts.part(_name(candidate, "frames"), self._describe(candidate, test), made))

    def _of_fold(
        self, candidates: Sequence[Candidate], test: Sequence[str]
    ) -> dict[str, tuple[FoldFrames, dict[str, Onsets]]]:
        """Return frames and events of the trials of a fold, of which those that are kept are not computed again."""
        events = {
            candidate.name: self.parts.kept(_name(candidate, "events"), self._describe(candidate, test))
            for candidate in candidates
        }
        fitted = {
            candidate.name: self._fit(candidate, test) for candidate in candidates if events[candidate.name] is None
        }
        for entry in candidates:
            if entry.name in fitted:
                self.parts.keep(_name(entry, "frames"), self._describe(entry, test), vars(fitted[entry.name][1]))
        alone = [joined_folds(self.samples, [part], (fold,)) for fold, part in fitted.values()]
        events_of_fold = (
            events_by_trial(self.trials, self.onsets, alone, self.motion, workers=self.workers) if alone else []
        )
        new = dict(zip(fitted, events_of_fold, strict=True))
        results = {}
        for entry in candidates:
            stored = events[entry.name]
            if stored is None:
                self.parts.keep(
                    _name(entry, "events"), self._describe(entry, test), {"onsets": _as_array(new[entry.name], test)}
                )
                results[entry.name] = fitted[entry.name][1], new[entry.name]
            else:
                results[entry.name] = self._of_group(entry, test), _as_onsets(stored["onsets"], test)
        return results

    def _fit(self, candidate: Candidate, test: Sequence[str]) -> tuple[Fold, FoldFrames]:
        window = self.motion.window
        return fitted_fold(
            self.samples, self.onsets, candidate, test, window=window, seed=self.seed, workers=self.workers
        )

    def _describe(self, candidate: Candidate, test: Sequence[str] = ()) -> list[Any]:
        """Return what a part is computed from, beside what all share: the classifier and the trials left out."""
        return [*describe(candidate, self.seed), list(test)]


def begun_evaluation(
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
    settings = [dataclasses.asdict(motion), dataclasses.asdict(sampling)]
    store = parts_beside(output, trials.digest, labels, settings, seed)
    samples = samples_of(trials, onsets, FeatureSettings(union_of_sets(candidates), motion), sampling)
    return Evaluation(trials, onsets, samples, motion, seed, workers, store)


def _name(candidate: Candidate, kind: str) -> str:
    """Return the name of a part; a colon is none that every file system takes."""
    return f"{candidate.name.replace(':', '.')}-{kind}"


def _as_array(events: Mapping[str, Onsets], test: Sequence[str]) -> NDArray[np.float64]:
    """Return onsets as numbers, shape (n_trials, 2), NaN where there is none."""
    return np.array([[events[name].incipient, events[name].gross] for name in test], dtype=np.float64)


def _as_onsets(times: NDArray[np.float64], test: Sequence[str]) -> dict[str, Onsets]:
    pairs = ([None if np.isnan(time) else float(time) for time in row] for row in times)
    return {name: Onsets(*pair) for name, pair in zip(test, pairs, strict=True)}
