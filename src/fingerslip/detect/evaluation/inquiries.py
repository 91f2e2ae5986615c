"""What classifiers need, use and bear: learning curve, importance of rings, disturbed tracks, and what is assumed."""

from __future__ import annotations

import itertools
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.classifiers import Candidate, describe, probabilities, union_of_sets
from fingerslip.detect.evaluation.crossval import Parts, fit_fold, fit_rows, matrices_of
from fingerslip.detect.evaluation.scores import Estimate, FrameScores, frame_scores_of, ratio_estimate
from fingerslip.detect.features import FeatureSettings, MotionSettings, features_of, motion_of, ring_of_features
from fingerslip.detect.labels import LabelSettings, Onsets, classes_at, labels_from_external_markers
from fingerslip.detect.samples import (
    Samples,
    Sampling,
    columns_of,
    grouped_folds,
    held_out,
    joined_samples,
    left_out,
    trial_samples,
)
from fingerslip.detect.training import Detector
from fingerslip.detect.trials import TrialSet, check_labels, condition_text
from fingerslip.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def learning_curve(
    samples: Samples,
    candidate: Candidate,
    tests: Sequence[str],
    sizes: Sequence[int],
    *,
    seed: int = 0,
    workers: int = 1,
) -> dict[int, FrameScores]:
    """Return how well a classifier does on test trials after it learned from more and more others, by their number."""
    rest = [name for name in samples.trials if name not in set(tests)]
    order, rows = held_out(rest, len(rest), seed), samples.rows(tests)
    scores = {}
    for size in sizes:
        if not 1 <= size <= len(rest):
            raise InputError("sizes", f"got {size}", f"needs 1 to {len(rest)}, the trials that are no test trials")
        _, frames = fit_rows(samples, candidate, samples.rows(order[:size]), rows, seed=seed, workers=workers)
        scores[size] = frame_scores_of(matrices_of(samples, [frames]), seed=seed)
    return scores


def importance_by_ring(
    samples: Samples, candidate: Candidate, tests: Sequence[str], *, draws: int = 5, seed: int = 0, workers: int = 1
) -> dict[int, Estimate]:
    """Return by how much accuracy falls when all features of a ring are shuffled among the test samples.

    Permutation importance (Breiman 2001), for a ring at a time: its markers say nearly the same, and one of them alone
    would not be missed. Intervals are over the test trials; shuffles are averaged.
    """
    columns = columns_of(samples.names, candidate.sets)
    rings = ring_of_features([samples.names[column] for column in columns], samples.ring)
    if not any(ring is not None for ring in rings):
        raise InputError(f"classifier {candidate.name}", "sees no single markers", "needs features of rings")
    rest = [name for name in samples.trials if name not in set(tests)]
    rows, draw = samples.rows(tests), np.random.default_rng(seed)
    estimator, _ = fit_rows(samples, candidate, samples.rows(rest), rows, seed=seed, workers=workers)
    values, classes = samples.features(rows, candidate.sets), samples.classes[rows]
    _, trial = np.unique(samples.trial[rows], return_inverse=True)

    def right(values: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return how many samples of each trial are right."""
        return np.bincount(trial, weights=probabilities(estimator, values).argmax(axis=1) == classes).astype(float)

    frames, whole = np.bincount(trial).astype(float), right(values)
    importance = {}
    for ring in sorted({ring for ring in rings if ring is not None}):
        inside, remaining = np.array([other == ring for other in rings]), np.zeros(len(frames))
        for _ in range(draws):
            mixed = values.copy()
            mixed[:, inside] = values[draw.permutation(len(values))][:, inside]
            remaining += right(mixed) / draws
        importance[ring] = ratio_estimate(whole - remaining, frames, seed)
    return importance


def disturb(tracks: xr.Dataset, disturbance: str, amount: float, seed: int = 0) -> xr.Dataset:
    """Return tracks with a disturbance; those of external markers too."""
    if disturbance not in DISTURBANCES:
        raise InputError("disturbance", f"got {disturbance!r}", f"needs one of {', '.join(DISTURBANCES)}")
    allowed, is_possible = DISTURBANCES[disturbance]
    if not is_possible(amount):
        raise InputError(disturbance, f"got {amount}", f"needs {allowed}")
    draw, position, quality = np.random.default_rng(seed), tracks["position"], tracks["quality"]
    if disturbance == "slower":
        return tracks.isel(time=slice(0, None, int(amount)))
    if disturbance == "noise":
        noise = amount * draw.standard_normal(position.shape)
        return tracks.assign(position=position.copy(data=position.values + noise))
    gone = draw.random(quality.shape) < amount
    return tracks.assign(
        position=position.copy(data=np.where(gone[:, :, None], np.nan, position.values)),
        quality=quality.copy(data=np.where(gone, 0.0, quality.values)),
    )


#: What may be done to tracks: the amounts that it takes, in words and as a rule.
DISTURBANCES: Mapping[str, tuple[str, Callable[[float], bool]]] = MappingProxyType(
    {
        "lost": ("a share from 0 up to, not including, 1", lambda amount: 0.0 <= amount < 1.0),
        "noise": ("a standard deviation >= 0", lambda amount: amount >= 0.0),
        "slower": ("a whole number >= 1", lambda amount: amount >= 1 and amount % 1 == 0),
    }
)


class Robustness(NamedTuple):
    """How many frames are right under a disturbance."""

    disturbance: str  # its name in :data:`DISTURBANCES`
    amount: float
    accuracy: Estimate  # share of the frames that could be classified and are right, with its interval over trials
    unusable: float  # share of the frames with too few markers


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
    results = []
    for disturbance, amount in levels:
        motion, counts = detector.features.motion, []
        if disturbance == "slower" and amount >= 1:
            rest_frames, window = max(1, int(motion.rest_frames / amount)), max(2, round(motion.window / amount))
            motion = replace(motion, rest_frames=rest_frames, window=window)
        for name in names:
            tracks = disturb(trials.tracks(name), disturbance, amount, seed=seed + zlib.crc32(name.encode()))
            moved = motion_of(tracks, motion)
            classes = probabilities(detector.estimator, features_of(moved, detector.features)).argmax(axis=1)
            right = (classes == classes_at(onsets[name], moved.time))[moved.usable].sum()
            counts.append((right, moved.usable.sum(), len(moved.time)))
        rights, usable, frames = np.array(counts, dtype=float).reshape(-1, 3).T
        unusable = float(1.0 - usable.sum() / max(frames.sum(), 1.0))
        results.append(Robustness(disturbance, amount, ratio_estimate(rights, usable, seed), unusable))
    return results


@dataclass(frozen=True)
class Assumption:
    """Values that a paper does not print, as they may be."""

    quantity: str  # what is assumed, in words
    value: str
    labels: LabelSettings | str = field(default_factory=LabelSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    noise: float = 0.0  # standard deviation of noise that is added to all positions, in the unit of the tracks
    trials: tuple[str, ...] = ()  # names of the trials that it is about, as others are not like them

    @property
    def inputs(self) -> dict[str, object]:
        """Its values without its words."""
        return {name: value for name, value in asdict(self).items() if name not in ("quantity", "value")}


@dataclass(frozen=True)
class Sensitivity:
    """What accuracies come to with an assumption."""

    assumption: Assumption
    matrices: Mapping[str, NDArray[np.intp]]  # (n_trials, 3, 3), by classifier
    incipient: float  # median onset of the labels [s]
    gross: float  # median onset of the labels [s]

    @property
    def accuracies(self) -> dict[str, Estimate]:
        """Share of right frames of each classifier."""
        return {name: frame_scores_of(matrix).accuracy for name, matrix in self.matrices.items()}

    def of_condition(self, trials: TrialSet, condition: str) -> dict[str, dict[str, Estimate]]:
        """Return each classifier's accuracies on the trials of each value of a condition, or quarter of its range."""
        rows = {value: np.isin(trials.names, names) for value, names in left_out(trials.conditions, condition).items()}
        return {
            value: {name: frame_scores_of(matrix[inside]).accuracy for name, matrix in self.matrices.items()}
            for value, inside in rows.items()
        }


#: Sizes of a pixel that are likely, too [m].
_PIXELS = (0.045e-3, 0.09e-3)


def likely_assumptions(
    metres_per_pixel: float, motion: MotionSettings, stored: Sequence[str] = ()
) -> tuple[Assumption, ...]:
    """Return what may be assumed of the trials of Cordova Bulens et al. 2023: first as they are, then one change each.

    A pixel of another size [m] makes the printed thresholds, 2 and 1 px, other lengths; that is all it does here. The
    noise stays as it is in metres.
    """
    default = LabelSettings(rest_frames=motion.rest_frames)

    def labels(incipient: float = 1.0, gross: float = 1.0) -> LabelSettings:
        return replace(default, incipient=incipient * default.incipient, gross=gross * default.gross)

    windows = (max(2, motion.window // 3), 3 * motion.window)
    sizes = [(f"{1e3 * size:.3g} mm", size / metres_per_pixel) for size in _PIXELS]
    first, second = default.incipient, default.gross
    changes: list[tuple[str, str, LabelSettings | str, MotionSettings]] = [
        ("as in the data set", f"{1e3 * metres_per_pixel:.3g} mm a pixel", default, motion),
        *(("size of a pixel", words, labels(share, share), motion) for words, share in sizes),
        *(
            ("threshold of incipient slip", f"{first * share:g} px", labels(incipient=share), motion)
            for share in (0.5, 2.0)
        ),
        *(("threshold of gross slip", f"{second * share:g} px", labels(gross=share), motion) for share in (0.5, 2.0)),
        *(("labels", name.replace("_", " "), name, motion) for name in stored),
        *(("frames in a speed", f"{frames}", default, replace(motion, window=frames)) for frames in windows),
    ]
    noisy = Assumption("noise of positions", "0.1 px more", default, motion, 0.1)
    return (*(Assumption(*change) for change in changes), noisy)


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


# Beside the matrices of classifiers, which have names of one word.
_MEDIANS = "median onsets"


def sensitivity_of(
    trials: TrialSet,
    assumptions: Sequence[Assumption],
    candidates: Sequence[Candidate],
    *,
    sampling: Sampling | None = None,
    folds: int = 5,
    seed: int = 0,
    workers: int = 1,
    store: Parts | None = None,
) -> Iterator[Sensitivity]:
    """Yield what classifiers come to with each assumption, on trials that they have not seen."""
    chosen, store = sampling or Sampling(least=0.0), store or Parts()
    shared = [[describe(candidate, seed) for candidate in candidates], asdict(chosen), folds, seed]
    for (motion, _), group in itertools.groupby(assumptions, lambda entry: (entry.motion, entry.noise)):
        stored = {id(entry): (entry, store.read("assumption", [shared, entry.inputs])) for entry in group}
        missing = [entry for entry, arrays in stored.values() if arrays is None]
        settings = FeatureSettings(union_of_sets(candidates), motion)
        labelled = iter(_label(trials, missing, settings, chosen, seed) if missing else [])
        options = {"window": motion.window, "seed": seed, "workers": workers}
        for assumption, arrays in stored.values():
            results = dict(arrays or {})
            if arrays is None:
                samples, onsets = next(labelled)
                tests = grouped_folds(samples.trials, folds, seed)
                times = np.array([(onset.incipient, onset.gross) for onset in onsets.values()], dtype=np.float64)
                results[_MEDIANS] = np.nanmedian(times, axis=0)
                for entry in candidates:
                    frames = [fit_fold(samples, onsets, entry, test, **options).frames for test in tests]
                    results[entry.name] = matrices_of(samples, frames)
                store.write("assumption", [shared, assumption.inputs], results)
            medians = results.pop(_MEDIANS)
            yield Sensitivity(assumption, results, *map(float, medians))


def _label(
    trials: TrialSet, assumptions: Sequence[Assumption], settings: FeatureSettings, sampling: Sampling, seed: int
) -> list[tuple[Samples, dict[str, Onsets]]]:
    """Return samples and labels with each of some assumptions, which read motion in one way; trials are read once."""
    samples: list[list[Samples]] = [[] for _ in assumptions]
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
            onsets = stored[source] if isinstance(source, str) else labels_from_external_markers(tracks, source)
            check_labels({name: onsets}, [name])
            labels[number][name] = onsets
            samples[number].append(trial_samples(name, motion, onsets, settings, sampling))
    return [(joined_samples(entry), label) for entry, label in zip(samples, labels, strict=True)]
