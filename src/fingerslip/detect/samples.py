"""Which frames of a trial a classifier learns from, and their features in one table."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.features import FeatureSettings, feature_names, features_of
from fingerslip.detect.motion import Motion, motion_of
from fingerslip.detect.onsets import CLASSES, GROSS, INCIPIENT, NO_SLIP, Onsets, classes_at
from fingerslip.detect.trial_set import TrialSet, check_labels
from fingerslip.errors import InputError

__all__ = [
    "PUBLISHED_SAMPLING",
    "Samples",
    "Sampling",
    "TrialSample",
    "at_frames",
    "chosen_frames",
    "joined_samples",
    "samples_of",
    "trial_sample",
]


@dataclass(frozen=True)
class Sampling:
    """How many frames of each class are taken from a trial.

    Parameters
    ----------
    no_slip, gross : int
        Random frames of these classes.
    first_incipient, more_incipient : int
        The first frames of incipient slip, and random ones of the rest.
    least : float
        Share of these numbers that a trial must have; with fewer frames of a class than asked for, all are taken. 1: no
        fewer, as published.
    seed : int
        Seed of what is random. Each trial has a seed of its own, made of this one and its name.
    """

    no_slip: int = 50
    first_incipient: int = 50
    more_incipient: int = 50
    gross: int = 50
    least: float = 1.0
    seed: int = 0


#: 200 frames a trial, as in Cordova Bulens et al. 2023.
PUBLISHED_SAMPLING = Sampling()


@dataclass(frozen=True)
class Samples:
    """Sampled frames of many trials.

    Parameters
    ----------
    values : (n_samples, n_features) array of float32
        Features.
    classes : (n_samples,) array of int
        Class of each.
    trial : (n_samples,) array of int
        Number of its trial in `trials`.
    time : (n_samples,) array
        Its time [s].
    names : tuple of str
        Names of the features.
    trials : tuple of str
        Names of the trials.
    ring : (n_markers,) array of int
        Ring of each internal marker.
    rest_end : (n_trials,) array
        Time of the last frame at rest of each trial [s].
    filled : int
        Positions that were not seen in these trials, and filled.
    unusable : int
        Frames with too few markers, which are not sampled.
    """

    values: NDArray[np.float32]
    classes: NDArray[np.int8]
    trial: NDArray[np.intp]
    time: NDArray[np.float64]
    names: tuple[str, ...]
    trials: tuple[str, ...]
    ring: NDArray[np.intp]
    rest_end: NDArray[np.float64]
    filled: int = 0
    unusable: int = 0


def samples_of(
    trials: TrialSet,
    onsets: Mapping[str, Onsets],
    features: FeatureSettings | None = None,
    sampling: Sampling = PUBLISHED_SAMPLING,
    *,
    names: Sequence[str] | None = None,
) -> Samples:
    """Return the sampled frames of trials with their features.

    Parameters
    ----------
    trials : TrialSet
        The data set.
    onsets : mapping of str to Onsets
        Label of each trial.
    features : FeatureSettings, optional
        The features; the published ones without it.
    sampling : Sampling, optional
        How many frames of each class.
    names : sequence of str, optional
        The trials to take; all without it.

    Raises
    ------
    InputError
        Where a trial lacks a label, or has fewer frames of a class than are asked for.
    """
    settings, chosen = features or FeatureSettings(), tuple(trials.names if names is None else names)
    check_labels(onsets, chosen)
    return joined_samples(
        [
            trial_sample(name, motion_of(trials.tracks(name), settings.motion), onsets[name], settings, sampling)
            for name in chosen
        ]
    )


@dataclass(frozen=True)
class TrialSample:
    """Sampled frames of one trial.

    Parameters
    ----------
    name : str
        Its name.
    values : (n_samples, n_features) array of float32
        Features.
    classes : (n_samples,) array of int
        Class of each.
    time : (n_samples,) array
        Its time [s].
    names : tuple of str
        Names of the features.
    ring : (n_markers,) array of int
        Ring of each internal marker.
    rest_end : float
        Time of the last frame at rest [s].
    filled, unusable : int
        Positions that were not seen in the trial, and frames with too few markers.
    """

    name: str
    values: NDArray[np.float32]
    classes: NDArray[np.int8]
    time: NDArray[np.float64]
    names: tuple[str, ...]
    ring: NDArray[np.intp]
    rest_end: float
    filled: int
    unusable: int


def trial_sample(
    name: str, motion: Motion, onsets: Onsets, settings: FeatureSettings, sampling: Sampling
) -> TrialSample:
    """Return the sampled frames of one trial.

    Raises
    ------
    InputError
        Where it has fewer frames of a class than are asked for.
    """
    classes = classes_at(onsets, motion.time)
    frames = chosen_frames(classes, motion.usable, sampling, name)
    return TrialSample(
        name=name,
        values=features_of(at_frames(motion, frames), settings),
        classes=classes[frames],
        time=motion.time[frames],
        names=feature_names(motion, settings),
        ring=motion.ring,
        rest_end=float(motion.time[settings.motion.rest_frames - 1]),
        filled=motion.filled,
        unusable=int((~motion.usable).sum()),
    )


def joined_samples(parts: Sequence[TrialSample]) -> Samples:
    """Return the sampled frames of trials of one layout in one table."""
    return Samples(
        values=np.concatenate([one.values for one in parts]),
        classes=np.concatenate([one.classes for one in parts]),
        trial=np.repeat(np.arange(len(parts)), [len(one.classes) for one in parts]),
        time=np.concatenate([one.time for one in parts]),
        names=parts[0].names,
        trials=tuple(one.name for one in parts),
        ring=parts[0].ring,
        rest_end=np.array([one.rest_end for one in parts]),
        filled=sum(one.filled for one in parts),
        unusable=sum(one.unusable for one in parts),
    )


def at_frames(motion: Motion, frames: NDArray[np.intp]) -> Motion:
    """Return some frames of a motion."""
    over_time = ("time", "displacement", "velocity", "seen", "usable")
    return Motion(**{**vars(motion), **{name: getattr(motion, name)[frames] for name in over_time}})


def chosen_frames(
    classes: NDArray[np.int8], usable: NDArray[np.bool_], sampling: Sampling, trial: str
) -> NDArray[np.intp]:
    """Return the frames that are sampled, in order of time.

    Parameters
    ----------
    classes : (n_times,) array of int
        Class of each frame.
    usable : (n_times,) array of bool
        Frames in which enough markers were seen.
    sampling : Sampling
        How many of each class.
    trial : str
        Name of the trial.

    Raises
    ------
    InputError
        Where there are fewer frames of a class.
    """
    draw = np.random.default_rng([sampling.seed, zlib.crc32(trial.encode())])
    incipient = np.flatnonzero((classes == INCIPIENT) & usable)
    first, rest = np.split(incipient, [sampling.first_incipient])
    wanted = (
        (NO_SLIP, np.flatnonzero((classes == NO_SLIP) & usable), sampling.no_slip),
        (INCIPIENT, first, sampling.first_incipient),
        (INCIPIENT, rest, sampling.more_incipient),
        (GROSS, np.flatnonzero((classes == GROSS) & usable), sampling.gross),
    )
    parts = []
    for number, frames, count in wanted:
        if len(frames) < sampling.least * count:
            found = f"has {len(frames)} frames of {CLASSES[number]} where {count} are sampled"
            raise InputError(f"trial {trial}", found, "needs more", "leave the trial out, or sample fewer frames")
        parts.append(draw.choice(frames, min(count, len(frames)), replace=False))
    return np.sort(np.concatenate(parts))
