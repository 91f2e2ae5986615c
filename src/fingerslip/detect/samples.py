"""Which frames of a trial a classifier learns from, their features in one table, and which trials it is tested on."""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats, Singles
from fingerslip.detect.features import FeatureSettings, Motion, feature_names, features_of, motion_of
from fingerslip.detect.labels import CLASSES, GROSS, INCIPIENT, NO_SLIP, Onsets, classes_at
from fingerslip.detect.trials import TrialSet, check_labels
from fingerslip.errors import InputError


@dataclass(frozen=True)
class Sampling:
    """How many frames of each class are taken from a trial."""

    no_slip: int = 50  # random frames of this class
    first_incipient: int = 50  # the first frames of incipient slip
    more_incipient: int = 50  # random ones of the rest
    gross: int = 50  # random frames of this class
    least: float = 1.0  # share of these numbers that a trial must have, and all it has are taken; 1 as published
    seed: int = 0  # of what is random; each trial has one of its own, made of this one and its name


#: 200 frames a trial, as in Cordova Bulens et al. 2023.
PUBLISHED_SAMPLING = Sampling()


@dataclass(frozen=True)
class Samples:
    """Sampled frames of one or many trials of one layout."""

    values: Singles  # (n_samples, n_features)
    classes: NDArray[np.int8]  # (n_samples,)
    trial: NDArray[np.intp]  # (n_samples,), number of its trial in `trials`
    names: tuple[str, ...]  # names of the features
    trials: tuple[str, ...]  # names of the trials
    ring: NDArray[np.intp]  # (n_markers,), ring of each internal marker
    rest_end: Floats  # (n_trials,), time of the last frame at rest of each trial [s]
    interval: Floats  # (n_trials,), median time between the frames of each trial [s]
    rest: NDArray[np.intp]  # (n_trials,), frames in which the markers of each trial rest, of those taken for rest
    filled: int = 0  # positions that were not seen in these trials, and filled
    unusable: int = 0  # frames with too few markers, which are not sampled

    def rows(self, trials: Sequence[str]) -> NDArray[np.intp]:
        """Return the rows of some trials."""
        return np.flatnonzero(np.isin(np.array(self.trials)[self.trial], list(trials)))

    def trials_without(self, tests: Sequence[str]) -> list[str]:
        """Return the names of the trials that are no test trials."""
        return [name for name in self.trials if name not in set(tests)]

    def features(self, rows: NDArray[np.intp], sets: Sequence[str]) -> Singles:
        """Return some sets of features of some rows, (n_rows, n_columns)."""
        return self.values[np.ix_(rows, columns_of(self.names, sets))]


def columns_of(names: Sequence[str], sets: Sequence[str]) -> NDArray[np.intp]:
    """Return the columns of some sets of features, by the names of all features."""
    return np.concatenate([np.flatnonzero([name.split("/")[0] == entry for name in names]) for entry in sets])


def samples_of(
    trials: TrialSet,
    onsets: Mapping[str, Onsets],
    features: FeatureSettings | None = None,
    sampling: Sampling = PUBLISHED_SAMPLING,
    *,
    names: Sequence[str] | None = None,
) -> Samples:
    """Return the sampled frames of trials with their features."""
    settings, chosen = features or FeatureSettings(), tuple(trials.names if names is None else names)
    check_labels(onsets, chosen)
    motions = ((name, motion_of(trials.tracks(name), settings.motion)) for name in chosen)
    return joined_samples([trial_samples(name, motion, onsets[name], settings, sampling) for name, motion in motions])


def trial_samples(name: str, motion: Motion, onsets: Onsets, settings: FeatureSettings, sampling: Sampling) -> Samples:
    """Return the sampled frames of one trial."""
    from fingerslip.vision.tracking.track import rest_length

    classes, rest = classes_at(onsets, motion.time), settings.motion.rest_frames
    if classes[:rest].any():
        fault = f"slips at {onsets.first:.4g} s, within the {rest} frames that are taken for rest"
        repair = f"write --rest {classes.nonzero()[0][0]} or less" if not classes[0] else "leave the trial out"
        raise InputError(f"trial {name}", fault, "needs rest before slip", repair)
    frames = chosen_frames(classes, motion.usable, sampling, name)
    return Samples(
        values=features_of(motion.at(frames), settings),
        classes=classes[frames],
        trial=np.zeros(len(frames), dtype=np.intp),
        names=feature_names(motion, settings),
        trials=(name,),
        ring=motion.ring,
        rest_end=motion.time[[rest - 1]],
        interval=np.atleast_1d(np.median(np.diff(motion.time))),
        rest=np.array([rest_length(motion.rest + motion.displacement[:rest])]),
        filled=int((~motion.seen).sum()),
        unusable=int((~motion.usable).sum()),
    )


def joined_samples(samples: Sequence[Samples]) -> Samples:
    """Return the samples of single trials in one table."""
    for part in samples:
        if part.names != samples[0].names:
            fault = f"has {len(part.names)} features beside {len(samples[0].names)} of trial {samples[0].trials[0]}"
            repair = "take features that need no layout, such as forest:field"
            raise InputError(f"trial {part.trials[0]}", fault, "needs the same markers and rings", repair)
    joined = {
        name: np.concatenate([getattr(part, name) for part in samples])
        for name in ("values", "classes", "rest_end", "interval", "rest")
    }
    return Samples(
        **joined,
        trial=np.repeat(np.arange(len(samples)), [len(part.classes) for part in samples]),
        names=samples[0].names,
        trials=tuple(name for part in samples for name in part.trials),
        ring=samples[0].ring,
        filled=sum(part.filled for part in samples),
        unusable=sum(part.unusable for part in samples),
    )


def chosen_frames(classes: NDArray[np.int8], usable: Flags, sampling: Sampling, trial: str) -> NDArray[np.intp]:
    """Return the frames that are sampled, in order of time; `classes` and `usable` are (n_times,)."""
    draw = np.random.default_rng([sampling.seed, zlib.crc32(trial.encode())])
    incipient = np.flatnonzero((classes == INCIPIENT) & usable)
    first, rest = np.split(incipient, [sampling.first_incipient])
    wanted = [
        (NO_SLIP, np.flatnonzero((classes == NO_SLIP) & usable), sampling.no_slip),
        (INCIPIENT, first, sampling.first_incipient),
        (INCIPIENT, rest, sampling.more_incipient),
        (GROSS, np.flatnonzero((classes == GROSS) & usable), sampling.gross),
    ]
    if not classes.any():
        del wanted[1:]  # a trial without slip
    pieces = []
    for number, frames, count in wanted:
        if len(frames) < sampling.least * count:
            fault = f"has {len(frames)} frames of {CLASSES[number]} where {count} are sampled"
            repair = "leave the trial out, sample fewer with --samples, or need a smaller share of them with --least"
            raise InputError(f"trial {trial}", fault, f"needs {sampling.least:.0%} of them", repair)
        pieces.append(draw.choice(frames, min(count, len(frames)), replace=False))
    return np.sort(np.concatenate(pieces))


#: Numbers of more values than this are left out in ranges instead of one by one.
_VALUES, _RANGES = 8, 4


def held_out(names: Sequence[str], count: int, seed: int) -> tuple[str, ...]:
    """Return some trials, chosen by hashes of their names: the same on every machine and in every order."""
    return tuple(sorted(names, key=lambda name: hashlib.sha256(f"{seed}:{name}".encode()).hexdigest())[:count])


def grouped_folds(
    names: Sequence[str], folds: int, seed: int, groups: Mapping[str, str] | None = None
) -> list[tuple[str, ...]]:
    """Return the test trials of each fold; every trial is in one of them, those of one group in the same."""
    group_of = groups or {name: name for name in names}
    different = sorted(set(group_of.values()))
    if not 2 <= folds <= len(different):
        words = "trials" if groups is None else "groups"
        raise InputError("folds", f"got {folds}", f"needs 2 to {len(different)}, the number of {words}")
    order = held_out(different, len(different), seed)
    by_fold = [set(order[number::folds]) for number in range(folds)]
    chosen = names if groups else order
    return [tuple(name for name in chosen if group_of[name] in inside) for inside in by_fold]


def benchmark_test_trials(names: Sequence[str], seed: int = 0) -> tuple[str, ...]:
    """Return the fifth of the trials that a submission is scored on, sorted; the others are there to learn from."""
    return tuple(sorted(held_out(names, max(1, round(0.2 * len(names))), seed)))


def sample_split(count: int, seed: int) -> Flags:
    """Return which samples are tested when samples are split whatever trial they are of, as published: 90 to 10.

    Frames of one trial are then on both sides. The accuracy says how well a classifier knows trials that it has seen.
    """
    tested = np.zeros(count, dtype=bool)
    tested[np.random.default_rng(seed).permutation(count)[: round(0.1 * count)]] = True
    return tested


def left_out(conditions: Mapping[str, Mapping[str, Any]], key: str) -> dict[str, tuple[str, ...]]:
    """Return the trials of each value of a condition; of each quarter of its range where it has many values."""
    for name, values in conditions.items():
        if key not in values:
            raise InputError(f"trial {name}", f"has no condition {key!r}", "needs it to be left out by it")
    values = {name: condition[key] for name, condition in conditions.items()}
    different = sorted(set(values.values()), key=lambda value: (isinstance(value, str), value))
    if len(different) < 2:
        raise InputError(f"condition {key!r}", f"is {different[0]!r} in all trials", "needs at least two values")
    if len(different) <= _VALUES or any(isinstance(value, str) for value in different):
        texts = {value: f"{value:.4g}" if isinstance(value, float) else str(value) for value in different}
        return {texts[value]: tuple(name for name in values if values[name] == value) for value in different}
    numbers = np.array(list(values.values()))
    edges = np.quantile(numbers, np.linspace(0.0, 1.0, _RANGES + 1))
    quarter = np.clip(np.searchsorted(edges, numbers, side="right") - 1, 0, _RANGES - 1)
    groups = {
        f"{edges[number]:.4g} to {edges[number + 1]:.4g}": tuple(np.array(list(values))[quarter == number].tolist())
        for number in range(_RANGES)
    }
    return {label: names for label, names in groups.items() if names}
