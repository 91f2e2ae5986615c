"""A detector on trials of another task or sensor than it learned from: what it finds, beside labels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

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

#: How onsets are read from frames: as the detector does it, and by the first frame that is more likely slip than not.
READINGS = ("detector", "single frames")


@dataclass(frozen=True)
class Unseen:
    """What a detector finds in trials that it did not learn from."""

    onsets: Mapping[str, Mapping[str, Onsets]]  # of every trial, by reading
    scores: Mapping[str, EventScores]  # by reading
    matrices: NDArray[np.intp]  # (n_trials, 3, 3), confusion of all frames


def on_unseen(detector: Detector, trials: TrialSet, onsets: Mapping[str, Onsets], *, seed: int = 0) -> Unseen:
    """Return what a detector finds in all trials of a data set that it did not learn from."""
    if detector.data == trials.digest:
        repair = "fingerslip detect evaluate leaves trials out in turn"
        raise InputError(str(trials.folder), "is what the detector learned from", "needs another data set", repair)
    missing = [name for name in trials.names if name not in onsets]
    if missing:
        raise InputError("labels", f"have no trial {missing[0]}", "needs every trial of the data set")
    readings = ((detector.smoother, detector.thresholds), (Hysteresis(1), Thresholds()))
    results: dict[str, dict[str, Onsets]] = {reading: {} for reading in READINGS}
    matrices = []
    for name in trials.names:
        tracks = trials.tracks(name)
        check_tracks_fit(detector, tracks)
        motion = motion_of(tracks, detector.features.motion)
        chances = probabilities(detector.estimator, features_of(motion, detector.features))
        likely, true = chances.argmax(axis=1).astype(np.int8), classes_at(onsets[name], motion.time)
        one_trial = np.zeros(int(motion.usable.sum()), dtype=np.intp)
        matrices.append(confusion_by_trial(true[motion.usable], likely[motion.usable], one_trial))
        for reading, (smoother, thresholds) in zip(READINGS, readings, strict=True):
            results[reading][name] = onsets_from(motion.time, frame_scores(smoother, motion, chances), thresholds)
    ends, frame = rest_ends(trials, trials.names, detector.features.motion.rest_frames)
    scores = {
        reading: event_scores_of(result, onsets, ends, frame=frame, seed=seed) for reading, result in results.items()
    }
    return Unseen(results, scores, np.concatenate(matrices))


def unseen_tables(result: Unseen, *, seed: int = 0) -> list[Table]:
    """Return the tables of what was found: onsets in both readings, classes and confusion of all frames."""
    frames = {"all frames": frame_scores_of(result.matrices, seed=seed)}
    note = "Single frames: the first frame that is more likely slip than not, without smoothing or guarantee."
    return [event_table(result.scores, note), frame_table(frames), confusion_table(frames)]
