"""On what accuracy depends: lost markers, noise, frame rates, and what is assumed."""

from __future__ import annotations

import itertools
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.classifiers import Candidate, describe, probabilities, union_of_sets
from fingerslip.detect.evaluation.crossval import Parts, frames_by_trial
from fingerslip.detect.evaluation.scores import Estimate, bootstrap_estimate, frame_scores_of
from fingerslip.detect.features import FeatureSettings, features_of
from fingerslip.detect.labels import LabelSettings, Onsets, classes_at, labels_from_external_markers
from fingerslip.detect.motion import MotionSettings, motion_of
from fingerslip.detect.samples import (
    Samples,
    Sampling,
    TrialSample,
    grouped_folds,
    joined_samples,
    left_out,
    trial_sample,
)
from fingerslip.detect.training import Detector
from fingerslip.detect.trial_set import TrialSet, check_labels
from fingerslip.detect.trials import condition_text
from fingerslip.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "DISTURBANCES",
    "Assumption",
    "Robustness",
    "Sensitivity",
    "disturb",
    "each_alone",
    "likely_assumptions",
    "robustness_of",
    "sensitivity_of",
]


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


# Beside the matrices of classifiers, which have names of one word.
_MEDIANS = "median onsets"


@dataclass(frozen=True)
class Assumption:
    """Values that a paper does not print, as they may be."""

    quantity: str  # what is assumed, in words
    value: str  # what is assumed, in words
    labels: LabelSettings | str = field(default_factory=LabelSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    noise: float = 0.0  # standard deviation of noise that is added to all positions, in the unit of the tracks
    trials: tuple[str, ...] = ()  # names of the trials that it is about, as others are not like them


@dataclass(frozen=True)
class Sensitivity:
    """What accuracies come to with an assumption."""

    assumption: Assumption  # the assumption
    matrices: Mapping[str, NDArray[np.intp]]  # (n_trials, 3, 3)
    incipient: float  # median onsets of the labels [s]
    gross: float  # median onsets of the labels [s]

    @property
    def accuracies(self) -> dict[str, Estimate]:
        """Share of right frames of each classifier."""
        return {name: frame_scores_of(matrix).accuracy for name, matrix in self.matrices.items()}

    def of_condition(self, trials: TrialSet, condition: str) -> dict[str, dict[str, Estimate]]:
        """Return each classifier's accuracies on the trials of each value of a condition, or quarter of its range."""
        scores = {}
        for value, names in left_out(trials.conditions, condition).items():
            rows = np.flatnonzero(np.isin(trials.names, names))
            scores[value] = {name: frame_scores_of(matrix[rows]).accuracy for name, matrix in self.matrices.items()}
        return scores


def likely_assumptions(
    metres_per_pixel: float,
    others: Sequence[float] = (0.045e-3, 0.09e-3),
    motion: MotionSettings | None = None,
    stored: Sequence[str] = (),
) -> tuple[Assumption, ...]:
    """Return what may be assumed of the trials of Cordova Bulens et al. 2023: first as they are, then one change each.

    A pixel of another size makes the printed thresholds, 2 and 1 px, other lengths; that is all it does here. The noise
    stays as it is in metres.

    Units: metres_per_pixel [m]; others [m].
    """
    motion = motion or MotionSettings()
    default = LabelSettings(rest_frames=motion.rest_frames)

    def labels(incipient: float, gross: float) -> LabelSettings:
        return replace(default, incipient=incipient * default.incipient, gross=gross * default.gross)

    sizes = [(size, size / metres_per_pixel) for size in others]
    return (
        Assumption("as in the data set", f"{1e3 * metres_per_pixel:.3g} mm a pixel", default, motion),
        *(Assumption("size of a pixel", f"{1e3 * size:.3g} mm", labels(share, share), motion) for size, share in sizes),
        *(
            Assumption("threshold of incipient slip", f"{default.incipient * share:g} px", labels(share, 1.0), motion)
            for share in (0.5, 2.0)
        ),
        *(
            Assumption("threshold of gross slip", f"{default.gross * share:g} px", labels(1.0, share), motion)
            for share in (0.5, 2.0)
        ),
        *(Assumption("labels", name.replace("_", " "), name, motion) for name in stored),
        *(
            Assumption("frames in a speed", f"{frames}", default, replace(motion, window=frames))
            for frames in (max(2, motion.window // 3), 3 * motion.window)
        ),
        Assumption("noise of positions", "0.1 px more", default, motion, 0.1),
    )


def each_alone(trials: TrialSet, conditions: Sequence[str], base: Assumption) -> tuple[Assumption, ...]:
    """Return an assumption for each combination of the values of conditions: trials of these alone are there.

    Where a condition is a value of the sensor that a paper does not print, such as the stiffness of its skin, each is
    another sensor: to learn from all of them together would ask something else.
    """
    groups = [left_out(trials.conditions, condition) for condition in conditions]
    assumptions = []
    for values in itertools.product(*groups) if groups else ():
        inside = set(trials.names).intersection(*(group[value] for group, value in zip(groups, values, strict=True)))
        names = tuple(name for name in trials.names if name in inside)
        words = ", ".join(condition_text(key, value) for key, value in zip(conditions, values, strict=True))
        assumptions += [replace(base, quantity="trials alone of", value=words, trials=names)] if names else []
    return tuple(assumptions)


def sensitivity_of(
    trials: TrialSet,
    assumptions: Sequence[Assumption],
    candidates: Sequence[Candidate],
    *,
    sampling: Sampling | None = None,
    folds: int = 5,
    seed: int = 0,
    workers: int = 1,
    stored_parts: Parts | None = None,
) -> Iterator[Sensitivity]:
    """Yield what classifiers come to with each assumption, on trials that they have not seen."""
    chosen, store = sampling or Sampling(least=0.0), stored_parts or Parts()
    shared = [[describe(candidate, seed) for candidate in candidates], asdict(chosen), folds, seed]
    for (motion, _), group in itertools.groupby(assumptions, lambda entry: (entry.motion, entry.noise)):
        element = tuple(group)
        stored_results = [store.kept("assumption", [shared, _plain(entry)]) for entry in element]
        missing = [entry for entry, stored in zip(element, stored_results, strict=True) if stored is None]
        settings = FeatureSettings(union_of_sets(candidates), motion)
        new_samples = iter(_samples(trials, missing, settings, chosen, seed) if missing else [])
        for assumption, stored in zip(element, stored_results, strict=True):
            arrays = stored or _arrays(candidates, *next(new_samples), motion.window, (folds, seed, workers))
            if stored is None:
                store.keep("assumption", [shared, _plain(assumption)], arrays)
            yield _sensitivity(assumption, arrays)


def _arrays(
    candidates: Sequence[Candidate],
    samples: Samples,
    onsets: Mapping[str, Onsets],
    window: int,
    numbers: tuple[int, int, int],
) -> dict[str, NDArray[Any]]:
    """Return the confusion matrices of each classifier, and the median onsets; numbers are folds, seed and workers."""
    folds, seed, workers = numbers
    tests = grouped_folds(samples.trials, folds, seed)
    arrays: dict[str, NDArray[Any]] = {
        candidate.name: frames_by_trial(
            samples, onsets, candidate, tests, window=window, seed=seed, workers=workers
        ).matrices
        for candidate in candidates
    }
    return arrays | {_MEDIANS: np.array(_medians(onsets))}


def _sensitivity(assumption: Assumption, arrays: Mapping[str, NDArray[Any]]) -> Sensitivity:
    incipient, gross = arrays[_MEDIANS]
    matrices = {name: array for name, array in arrays.items() if name != _MEDIANS}
    return Sensitivity(assumption, matrices, float(incipient), float(gross))


def _plain(assumption: Assumption) -> dict[str, Any]:
    return {name: value for name, value in asdict(assumption).items() if name not in ("quantity", "value")}


def _samples(
    trials: TrialSet,
    assumptions: Sequence[Assumption],
    settings: FeatureSettings,
    sampling: Sampling,
    seed: int,
) -> list[tuple[Samples, dict[str, Onsets]]]:
    """Return samples and labels with each of some assumptions, which read motion in one way; trials are read once."""
    samples: list[list[TrialSample]] = [[] for _ in assumptions]
    labels: list[dict[str, Onsets]] = [{} for _ in assumptions]
    for name in trials.names:
        tracks, noise = trials.tracks(name), assumptions[0].noise
        if noise:
            tracks = disturb(tracks, "noise", noise, seed + zlib.crc32(name.encode()))
        motion, stored = motion_of(tracks, settings.motion), trials.labels(name)
        for number, assumption in enumerate(assumptions):
            source = assumption.labels
            if assumption.trials and name not in assumption.trials:
                continue
            if isinstance(source, str) and source not in stored:
                raise InputError(f"{trials.folder}: {name}", f"has no labels {source!r}", f"has {', '.join(stored)}")
            result = stored[source] if isinstance(source, str) else labels_from_external_markers(tracks, source)
            check_labels({name: result}, [name])
            labels[number][name] = result
            samples[number].append(trial_sample(name, motion, result, settings, sampling))
    return [(joined_samples(part), label) for part, label in zip(samples, labels, strict=True)]


def _medians(onsets: Mapping[str, Onsets]) -> tuple[float, float]:
    times = np.array([(onset.incipient, onset.gross) for onset in onsets.values()], dtype=float)
    incipient, gross = np.median(times, axis=0)
    return float(incipient), float(gross)
