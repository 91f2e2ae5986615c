"""How a detector does with lost markers, more noise, and fewer frames than it learned from."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.classifiers import probabilities
from fingerslip.detect.evaluation.scores import Estimate, bootstrap_estimate
from fingerslip.detect.features import FeatureSettings, features_of
from fingerslip.detect.labels import Onsets, classes_at
from fingerslip.detect.motion import MotionSettings, motion_of
from fingerslip.detect.training import Detector
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["DISTURBANCES", "Robustness", "disturb", "robustness_of"]


@dataclass(frozen=True)
class Robustness:
    """How many frames are right under a disturbance."""

    disturbance: str  # its name in :data:`DISTURBANCES`
    amount: float  # how much of it
    accuracy: Estimate  # share of the frames that could be classified and are right, with its interval over trials
    unusable: float  # share of the frames with too few markers


def disturb(tracks: xr.Dataset, disturbance: str, amount: float, seed: int = 0) -> xr.Dataset:
    """Return tracks with a disturbance; those of external markers too."""
    if disturbance not in DISTURBANCES:
        raise InputError("disturbance", f"got {disturbance!r}", f"needs one of {', '.join(DISTURBANCES)}")
    return DISTURBANCES[disturbance](tracks, amount, np.random.default_rng(seed))


def _lost(tracks: xr.Dataset, amount: float, draw: np.random.Generator) -> xr.Dataset:
    import xarray as xr

    if not 0.0 <= amount < 1.0:
        raise InputError("lost", f"got {amount}", "needs a share from 0 up to, not including, 1")
    gone = draw.random(tracks["quality"].shape) < amount
    damaged = tracks.copy()
    damaged["position"] = tracks["position"].where(~xr.DataArray(gone, dims=("time", "marker")))
    damaged["quality"] = tracks["quality"].copy(data=np.where(gone, 0.0, tracks["quality"].values))
    return damaged


def _noisy(tracks: xr.Dataset, amount: float, draw: np.random.Generator) -> xr.Dataset:
    if not amount >= 0.0:
        raise InputError("noise", f"got {amount}", "needs a standard deviation >= 0")
    position = tracks["position"]
    return tracks.assign(position=position.copy(data=position.values + amount * draw.standard_normal(position.shape)))


def _slower(tracks: xr.Dataset, amount: float, _draw: np.random.Generator) -> xr.Dataset:
    if amount < 1 or amount != int(amount):
        raise InputError("slower", f"got {amount}", "needs a whole number >= 1")
    return tracks.isel(time=slice(0, None, int(amount)))


#: What may be done to tracks.
DISTURBANCES: Mapping[str, Callable[[xr.Dataset, float, np.random.Generator], xr.Dataset]] = MappingProxyType(
    {
        "lost": _lost,
        "noise": _noisy,
        "slower": _slower,
    }
)


def robustness_of(
    detector: Detector,
    trials: TrialSet,
    onsets: Mapping[str, Onsets],
    names: Sequence[str],
    levels: Sequence[tuple[str, float]],
    *,
    seed: int = 0,
) -> list[Robustness]:
    """Return how many frames of test trials a detector gets right at each level of disturbance.

    With every so manieth frame, the frames at rest and those of a velocity are fewer too, so that they last as long.
    """
    return [_at_level(detector, trials, {name: onsets[name] for name in names}, level, seed) for level in levels]


def _at_level(
    detector: Detector, trials: TrialSet, onsets: Mapping[str, Onsets], level: tuple[str, float], seed: int
) -> Robustness:
    counts = []
    settings = replace(detector.features, motion=_motion(detector.features, *level))
    for name in onsets:
        tracks = disturb(trials.tracks(name), *level, seed=seed + zlib.crc32(name.encode()))
        moved = motion_of(tracks, settings.motion)
        classes = probabilities(detector.estimator, features_of(moved, settings)).argmax(axis=1)
        right = (classes == classes_at(onsets[name], moved.time))[moved.usable].sum()
        counts.append((right, moved.usable.sum(), len(moved.time)))
    right, usable, frames = np.array(counts, dtype=float).reshape(-1, 3).T

    def share(drawn: NDArray[np.intp]) -> float:
        usable_share = usable[drawn].sum()
        return float(right[drawn].sum() / usable_share) if usable_share else np.nan

    accuracy = bootstrap_estimate(share, len(counts), seed=seed)
    return Robustness(*level, accuracy=accuracy, unusable=float(1.0 - usable.sum() / max(frames.sum(), 1.0)))


def _motion(features: FeatureSettings, disturbance: str, amount: float) -> MotionSettings:
    if disturbance != "slower":
        return features.motion
    motion = features.motion
    return replace(
        motion, rest_frames=max(1, int(motion.rest_frames / amount)), window=max(2, round(motion.window / amount))
    )
