"""Whole trials as a task of their own: is there slip in it, or none?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.classifiers import optional, scaled_logistic, small_forest, two_thresholds
from fingerslip.detect.evaluation.scores import Estimate, ratio_estimate
from fingerslip.detect.features import FeatureSettings, MotionSettings, features_of, motion_of
from fingerslip.detect.labels import Onsets
from fingerslip.detect.recordings import NO_SLIP_WORD, SLIP
from fingerslip.detect.residual import ResidualSettings, detect_residual
from fingerslip.detect.trials import TrialSet
from fingerslip.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]

#: What says of a trial whether there is slip in it, and the columns of features that it sees.
_SEEN: Mapping[str, tuple[Any, str]] = {
    "forest": (small_forest, "field"),
    "logistic": (scaled_logistic, "field"),
    "length of the clip alone": (two_thresholds, "length"),
}
#: Name of the detector that ships, which learns nothing.
SHIPS = "the detector that ships"


@dataclass(frozen=True)
class WholeScores:
    """How well whole trials are told apart."""

    accuracy: Estimate
    found: Estimate  # share of the trials with slip that are found
    false: Estimate  # share of the trials without slip that are said to slip
    area: float | None  # below the curve of found over false; None for what gives no probability


def slips_of(trials: TrialSet, onsets: Mapping[str, Onsets]) -> dict[str, bool]:
    """Return whether there is slip in each trial: by its condition 'slip', else by its onsets."""
    result = {}
    for name in trials.names:
        stated = trials.conditions[name].get(SLIP)
        if stated is None and name not in onsets:
            raise InputError(f"trial {name}", "has no label", "needs a condition 'slip' or onsets")
        result[name] = onsets[name].first is not None if stated is None else stated != NO_SLIP_WORD
    if len(set(result.values())) < 2:
        word = "slip" if all(result.values()) else "no slip"
        raise InputError(str(trials.folder), f"has {word} in all trials", "needs trials with and without", "add some")
    return result


def score_whole(
    trials: TrialSet, slips: Mapping[str, bool], tests: Sequence[Sequence[str]], motion: MotionSettings, seed: int = 0
) -> dict[str, WholeScores]:
    """Return how well trials of each fold are told apart after learning from the others, by classifier."""
    names, true = list(slips), np.array(list(slips.values()))
    fold = np.array([next(number for number, test in enumerate(tests) if name in test) for name in names])
    for number, test in enumerate(tests):
        if len(np.unique(true[fold != number])) < 2:
            fault = f"the fold that leaves out trial {test[0]} has one kind of trial to learn from"
            raise InputError("folds", fault, "needs trials with slip and without", "take fewer folds")
    columns = [_whole(trials.tracks(name), motion) for name in names]
    selection, scores = optional("sklearn.model_selection"), {}
    for classifier, (make, seen) in _SEEN.items():
        values, folds = np.stack([column[seen] for column in columns]), selection.PredefinedSplit(fold)
        chances = selection.cross_val_predict(make(seed), values, true, cv=folds, method="predict_proba")[:, 1]
        area = float(optional("sklearn.metrics").roc_auc_score(true, chances))
        scores[classifier] = _scores(true, chances > 0.5, area, seed)
    scores[SHIPS] = _scores(true, np.array([column["ships"][0] > 0 for column in columns]), None, seed)
    return scores


def _whole(tracks: xr.Dataset, motion: MotionSettings) -> dict[str, Floats]:
    """Return what is known of a trial: statistics of features over its frames, its length, and what ships says."""
    moved = motion_of(tracks, motion)
    frames = features_of(moved, FeatureSettings(("field",), motion)).astype(np.float64)
    statistics = [frames.mean(axis=0), frames.std(axis=0), np.quantile(frames, 0.95, axis=0), frames[-1]]
    onsets = detect_residual(tracks, ResidualSettings(rest_frames=motion.rest_frames))[-1].onsets
    length = moved.time[-1] - moved.time[0]
    return {
        "field": np.concatenate(statistics),
        "length": np.array([length]),
        "ships": np.array([float(onsets.first is not None)]),
    }


def _scores(true: NDArray[np.bool_], said: NDArray[np.bool_], area: float | None, seed: int) -> WholeScores:
    everything = np.ones(len(true))
    return WholeScores(
        ratio_estimate((true == said).astype(float), everything, seed),
        ratio_estimate((true & said).astype(float), true.astype(float), seed),
        ratio_estimate((~true & said).astype(float), (~true).astype(float), seed),
        area,
    )
