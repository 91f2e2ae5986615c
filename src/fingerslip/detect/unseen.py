"""A detector on trials of another task or sensor than it learned from: what it finds, beside labels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.alarms import Hysteresis, Thresholds, onsets_from
from fingerslip.detect.classifiers import probabilities
from fingerslip.detect.evaluation.scores import (
    EventScores,
    confusion_by_trial,
    event_scores_of,
    frame_scores_of,
    rest_ends,
)
from fingerslip.detect.features import features_of
from fingerslip.detect.labels import Onsets, classes_at
from fingerslip.detect.motion import motion_of
from fingerslip.detect.tables import confusion_table, event_table, frame_table
from fingerslip.detect.training import Detector, check_tracks_fit, frame_scores
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError
from fingerslip.tables.table import Table

__all__ = ["READINGS", "Unseen", "on_unseen", "unseen_tables"]

#: How onsets are read from frames: as the detector does it, and by the first frame that is more likely slip than not.
READINGS = ("detector", "single frames")

_SINGLE = Hysteresis(1)


@dataclass(frozen=True)
class Unseen:
    """What a detector finds in trials that it did not learn from."""

    found: Mapping[str, Mapping[str, Onsets]]  # onsets of every trial, by reading
    scores: Mapping[str, EventScores]  # their scores, by reading
    matrices: NDArray[np.intp]  # (n_trials, 3, 3)


def on_unseen(detector: Detector, trials: TrialSet, onsets: Mapping[str, Onsets], *, seed: int = 0) -> Unseen:
    """Return what a detector finds in all trials of a data set that it did not learn from."""
    if detector.data == trials.digest:
        repair = "fingerslip detect evaluate leaves trials out in turn"
        raise InputError(str(trials.folder), "is what the detector learned from", "needs another data set", repair)
    missing = [name for name in trials.names if name not in onsets]
    if missing:
        raise InputError("labels", f"have no trial {missing[0]}", "needs every trial of the data set")
    result: dict[str, dict[str, Onsets]] = {reading: {} for reading in READINGS}
    matrices = []
    for name in trials.names:
        both, matrix = _of_trial(detector, trials, name, onsets[name])
        matrices.append(matrix)
        for reading, onset in zip(READINGS, both, strict=True):
            result[reading][name] = onset
    ends, frame = rest_ends(trials, trials.names, detector.features.motion.rest_frames)
    scores = {
        reading: event_scores_of(onset, onsets, ends, frame=frame, seed=seed) for reading, onset in result.items()
    }
    return Unseen(result, scores, np.concatenate(matrices))


def _of_trial(
    detector: Detector, trials: TrialSet, name: str, label: Onsets
) -> tuple[tuple[Onsets, Onsets], NDArray[np.intp]]:
    """Return the onsets in both readings and the confusion matrix of all frames, shape (1, 3, 3)."""
    tracks = trials.tracks(name)
    check_tracks_fit(detector, tracks)
    motion = motion_of(tracks, detector.features.motion)
    chances = probabilities(detector.estimator, features_of(motion, detector.features))
    likely = chances.argmax(axis=1).astype(np.int8)[motion.usable]
    true = classes_at(label, motion.time)[motion.usable]
    matrix = confusion_by_trial(true, likely, np.zeros(len(true), dtype=np.intp))
    chances[~motion.usable] = np.nan
    plain = replace(detector, smoother=_SINGLE, thresholds=Thresholds())
    first, second = (
        onsets_from(motion.time, frame_scores(model.smoother, motion.time, chances), model.thresholds)
        for model in (detector, plain)
    )
    return (first, second), matrix


def unseen_tables(result: Unseen, *, seed: int = 0) -> list[Table]:
    """Return the tables of what was found: onsets in both readings, classes and confusion of all frames."""
    frames = {"all frames": frame_scores_of(result.matrices, seed=seed)}
    note = "Single frames: the first frame that is more likely slip than not, without smoothing or guarantee."
    return [
        event_table(result.scores, note),
        frame_table(frames),
        confusion_table({name: frame.matrix for name, frame in frames.items()}),
    ]
