"""A detector: a fitted classifier with its features, smoothing and thresholds, ready for tracks."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.arrays import Floats, Singles
from fingerslip.detect.classifiers import CLASSIFIERS, Candidate, fit, probabilities
from fingerslip.detect.features import (
    LAYOUT_FREE,
    FeatureSettings,
    Motion,
    MotionSettings,
    features_of,
    markers_of,
    motion_of,
)
from fingerslip.detect.labels import Onsets, times_of
from fingerslip.detect.samples import PUBLISHED_SAMPLING, Samples, Sampling, held_out, samples_of
from fingerslip.detect.trials import TrialSet, check_labels, layout_digest, layout_text
from fingerslip.errors import InputError, shorten
from fingerslip.libraries import xr
from fingerslip.parameters import Number, parameters

Positive = Annotated[Number, pydantic.Field(gt=0, allow_inf_nan=False)]

#: Probabilities of a frame count as at least this: a forest of 50 trees cannot tell less from nothing.
_LEAST = 1e-3
#: Share by which the frame rate of a recording may differ from that of a detector.
RATE_TOLERANCE = 0.1
#: In the provenance of a detector: how many trials it was tested on and how many of these are said to be unlike those
#: that it learned from, and how far off its times are on them.
TESTED, TIME_ERROR = "tested_unlike", "time_error_s"
#: Share of the features of a clip beyond the range of those learned that makes it unlike them; assumed.
UNLIKE = 0.1


@parameters
class ForwardFilter:
    """The forward recursion of a hidden Markov model: no slip, then incipient, then gross slip (Rabiner 1989)."""

    dwell: tuple[Positive, Positive]  # mean time without slip, and of incipient slip [s]
    prior: tuple[Positive, Positive, Positive]  # shares of the classes among the training frames
    weight: Positive  # how much a frame counts: 1 for independent frames, 1 / window for velocities that share frames

    def start(self) -> Floats:
        """Return the state before the first frame: log probabilities, almost surely no slip."""
        state: Floats = np.log(np.array([1.0 - 2.0 * _LEAST, _LEAST, _LEAST]))
        return state

    def scores(self, state: Floats, interval: Floats, probabilities: Floats) -> tuple[Floats, Floats]:
        """Return the log odds (n_times, 2) that there is slip, and that it is gross, and the state after the frames.

        The intervals (n_times,) are times since the frame before each [s], and the probabilities (n_times, 3) those of
        the classes, NaN where a frame could not be classified.
        """
        likelihood = self.weight * (np.log(np.maximum(probabilities, _LEAST)) - np.log(self.prior))
        likelihood[np.isnan(probabilities).any(axis=1)] = 0.0
        leave = -np.expm1(-np.asarray(interval)[:, None] / np.array(self.dwell))
        beliefs: Floats = _recursion()(state, leave, likelihood)
        # A chain of no frames leaves the state as it was.
        return _log_odds(beliefs), (beliefs[-1] if len(beliefs) else state)


@functools.cache
def _recursion() -> Callable[..., Any]:
    """Return the log probabilities after each frame, (n_times, 3), of a chain that only goes on, as compiled code."""
    import numba

    @numba.njit(cache=True)
    def recursion(state: Floats, leave: Floats, likelihood: Floats) -> Floats:  # pragma: no cover  it is compiled
        beliefs = np.empty_like(likelihood)
        before = state.copy()
        for frame in range(len(likelihood)):
            chance = np.exp(before)
            gone, further = chance[0] * leave[frame, 0], chance[1] * leave[frame, 1]
            # In the log domain, so that what is very unlikely now may still become true.
            before[0] += np.log1p(-leave[frame, 0])
            before[1] = np.log(max(chance[1] - further + gone, 1e-300))
            before[2] = np.log(max(chance[2] + further, 1e-300))
            before += likelihood[frame]
            before -= before.max() + np.log(np.exp(before - before.max()).sum())
            beliefs[frame] = before
        return beliefs

    return recursion


def single_frame_scores(probabilities: Floats) -> Floats:
    """Return the scores (n_times, 2) of frames on their own, of probabilities (n_times, 3); -inf where they are NaN."""
    classified, scores = ~np.isnan(probabilities).any(axis=1), np.full((len(probabilities), 2), -np.inf)
    scores[classified] = _log_odds(np.log(np.maximum(probabilities[classified], _LEAST)))
    return scores


def _log_odds(beliefs: Floats) -> Floats:
    """Return log odds of slip and of gross slip, from log probabilities that need not sum to one."""
    slip = np.logaddexp(beliefs[:, 1], beliefs[:, 2]) - beliefs[:, 0]
    gross = beliefs[:, 2] - np.logaddexp(beliefs[:, 0], beliefs[:, 1])
    return np.stack([slip, gross], axis=1)


@dataclass(frozen=True)
class Thresholds:
    """Log odds beyond which slip, and gross slip, has begun; 0 is as likely as not."""

    slip: float = 0.0
    gross: float = 0.0


def onsets_from(time: Floats, scores: Floats, thresholds: Thresholds | None = None) -> Onsets:
    """Return the first times at which scores are above their thresholds.

    Gross slip is slip: it counts only once slip was found, so the guarantee of that threshold holds for both.
    """
    limits = thresholds or Thresholds()
    slip = np.maximum.accumulate(scores[:, 0] > limits.slip)
    above = (slip, slip & (scores[:, 1] > limits.gross))
    return Onsets(*(float(time[np.argmax(flags)]) if flags.any() else None for flags in above))


def least_trials(share: float = 0.05) -> int:
    """Return how many trials a guarantee needs: 19 for 5 %."""
    if not 0.0 < share < 1.0:
        raise InputError("share", f"got {share}", "needs a number between 0 and 1")
    return math.ceil(1.0 / share - 1e-9) - 1


def false_alarm_threshold(maxima: Sequence[float], share: float = 0.05) -> float:
    """Return the threshold that the largest score of a new no-slip trial exceeds in at most a share of them."""
    _check_count(len(maxima), share)
    rank = math.ceil((len(maxima) + 1) * (1.0 - share) - 1e-9)
    return float(sorted(maxima)[rank - 1])


def lead_bound(leads: Sequence[float | None], share: float = 0.05) -> float | None:
    """Return the lead before gross slip that a new trial has in at least 1 - share of them [s]."""
    _check_count(len(leads), share)
    rank = math.floor((len(leads) + 1) * share + 1e-9)
    bound = sorted(-math.inf if lead is None else lead for lead in leads)[rank - 1]
    return bound if math.isfinite(bound) else None


def _check_count(count: int, share: float) -> None:
    needed = least_trials(share)
    if count < needed:
        fault = f"got {count} trials for a guarantee of {1.0 - share:.4g}"
        raise InputError("calibration", fault, f"needs at least {needed}", "keep more trials out of the training")


@dataclass(frozen=True)
class Calibration:
    """What the threshold of a detector guarantees."""

    trials: int = 0  # trials from which it was set, none of them learned from
    share: float = 0.05  # share of the no-slip trials that may raise a false alarm


@dataclass(frozen=True)
class Detector:
    """What finds slip in tracks."""

    classifier: str  # name in :data:`fingerslip.detect.classifiers.CLASSIFIERS`
    estimator: Any  # the fitted pipeline
    features: FeatureSettings
    names: tuple[str, ...]  # names of its features
    layout: str  # hash of the internal markers that it was made for; empty where it needs no layout
    layout_in_words: str
    smoother: ForwardFilter
    thresholds: Thresholds = field(default_factory=Thresholds)
    calibration: Calibration = field(default_factory=Calibration)
    data: str = ""  # hash of the data set that it learned from
    frame_rate: Positive | None = None  # median of the trials that it learned from [1/s], where it is known
    # (2, 2, n_features), least and largest features at rest and in the frames that it learned from
    ranges: list[list[list[float]]] | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)


def candidate_of_name(name: str) -> Candidate:
    """Return a classifier by its name, on its own features or, as in ``forest:sliding+time``, on others."""
    classifier, separator, sets = name.partition(":")
    if classifier not in CLASSIFIERS:
        raise InputError("classifier", f"got {shorten(classifier)!r}", f"needs one of {', '.join(CLASSIFIERS)}")
    if not separator:
        return CLASSIFIERS[classifier]
    return replace(CLASSIFIERS[classifier], name=name, sets=FeatureSettings(tuple(sets.split("+"))).sets)


def train(
    trials: TrialSet,
    onsets: Mapping[str, Onsets],
    classifier: str = "forest",
    *,
    motion: MotionSettings | None = None,
    sampling: Sampling = PUBLISHED_SAMPLING,
    names: Sequence[str] | None = None,
    share: float = 0.05,
    seed: int = 0,
    workers: int = 1,
) -> Detector:
    """Return a detector that learned from most trials, all or those in `names`, with a threshold set by the others.

    At most a share of trials without slip raises a false alarm; with too few trials for that, the threshold is where
    slip is as likely as not, and `calibration.trials` is 0.
    """
    candidate = candidate_of_name(classifier)
    settings = FeatureSettings(candidate.sets, motion or MotionSettings())
    chosen = tuple(trials.names if names is None else names)
    calibration = held_out(chosen, calibration_count(len(chosen), share), seed)
    check_labels(onsets, calibration, needed=())
    samples = samples_of(trials, onsets, settings, sampling, names=[name for name in chosen if name not in calibration])
    estimator = fit(candidate, samples.values, samples.classes, seed=seed, workers=workers)
    inside = markers_of(trials.tracks(chosen[0]), "internal")
    rests = (trials.tracks(name).isel(time=slice(settings.motion.rest_frames)) for name in samples.trials)
    at_rest = np.concatenate([features_of(motion_of(rest, settings.motion), settings) for rest in rests])
    # Of trials at several rates no rate is the one that it learned from.
    alike = np.ptp(samples.interval) <= RATE_TOLERANCE * np.median(samples.interval)
    detector = Detector(
        classifier=classifier,
        estimator=estimator,
        features=settings,
        names=samples.names,
        layout="" if LAYOUT_FREE.issuperset(settings.sets) else layout_digest(inside),
        layout_in_words=layout_text(inside),
        smoother=forward_filter(samples, onsets, settings.motion.window),
        data=trials.digest,
        frame_rate=float(f"{1.0 / np.median(samples.interval):.6g}") if alike else None,
        ranges=[[part.min(axis=0).tolist(), part.max(axis=0).tolist()] for part in (at_rest, samples.values)],
        provenance={
            "trials": len(samples.trials),
            "samples": len(samples.classes),
            "seed": seed,
            "set": trials.title,
            "shortest rest": int(samples.rest.min()),
        },
    )
    if not calibration:
        return detector
    scored = ((detect(detector, trials.tracks(name))[:2], onsets[name]) for name in calibration)
    limit = false_alarm_threshold([largest_before(*scores, label) for scores, label in scored], share)
    return replace(detector, thresholds=Thresholds(slip=limit), calibration=Calibration(len(calibration), share))


def with_test_results(
    detector: Detector, trials: TrialSet, onsets: Mapping[str, Onsets], names: Sequence[str]
) -> Detector:
    """Return a detector that says how it does in trials that it did not learn from."""
    begins = [detect(detector, trials.tracks(name))[2] for name in names]
    unlike = sum(bool(strange_shares(detector, trials.tracks(name)).max() > UNLIKE) for name in names)
    error = time_error([onsets[name] for name in names], begins)
    return replace(detector, provenance={**detector.provenance, TESTED: [len(names), unlike], **error})


def strange_shares(detector: Detector, tracks: xr.Dataset) -> Floats:
    """Return which shares of the features of tracks, at rest and later (2,), are beyond the range of those learned."""
    motion, resting = motion_of(tracks, detector.features.motion), detector.features.motion.rest_frames
    values, usable = features_of(motion, detector.features), motion.usable
    rest, later = values[:resting][usable[:resting]], values[resting:][usable[resting:]]
    return np.array([strange_share(detector, rest, is_rest=True), strange_share(detector, later, is_rest=False)])


def strange_share(detector: Detector, values: Singles, *, is_rest: bool) -> float:
    """Return which share of features (n_times, n_features) is beyond the range of those learned, at rest or later."""
    if detector.ranges is None or not values.size:
        return 0.0
    low, high = detector.ranges[0 if is_rest else 1]
    return float(((values < low) | (values > high)).mean())


def time_error(labels: Sequence[Onsets], begins: Sequence[Onsets]) -> dict[str, list[float]]:
    """Return how far off slip begins: median, 5 % and 95 % of the size, mean [s], trials; empty without any."""
    errors = (times_of(begins) - times_of(labels))[:, 0]
    errors = errors[np.isfinite(errors)]
    sizes = np.quantile(np.abs(errors), (0.5, 0.05, 0.95)) if errors.size else ()
    return {TIME_ERROR: [*np.round([*sizes, errors.mean()], 4).tolist(), errors.size]} if errors.size else {}


def calibration_count(trials: int, share: float) -> int:
    """Return how many of the trials are kept for the threshold: a fifth, at least what it needs; 0 with too few."""
    needed = max(least_trials(share), round(0.2 * trials))
    return needed if trials >= 2 * needed else 0


def forward_filter(
    samples: Samples, onsets: Mapping[str, Onsets], window: int, rows: NDArray[np.intp] | slice = slice(None)
) -> ForwardFilter:
    """Return the smoother whose times and shares are those of training trials, the rows of these among the samples."""
    trials = np.unique(samples.trial[rows])
    times = np.column_stack([samples.rest_end[trials], times_of(onsets[samples.trials[number]] for number in trials)])
    # Without slip, and with incipient slip, in trials with both onsets, as those with samples of all classes are.
    dwell = np.maximum(np.diff(times[np.isfinite(times).all(axis=1)], axis=1), 1e-3)
    counts = np.bincount(samples.classes[rows], minlength=3) + 1
    no_slip, incipient, gross = (counts / counts.sum()).tolist()
    waiting, partial = (float(np.mean(column)) for column in dwell.T)
    return ForwardFilter((waiting, partial), (no_slip, incipient, gross), 1.0 / window)


def frame_scores(smoother: ForwardFilter, motion: Motion, chances: Floats) -> Floats:
    """Return the scores (n_times, 2) of all frames of a trial; those that are not usable count as not classified."""
    interval = np.diff(motion.time, prepend=motion.time[:1])
    usable_chances = np.where(motion.usable[:, None], chances, np.nan)
    return smoother.scores(smoother.start(), interval, usable_chances)[0]


def largest_before(time: Floats, scores: Floats, onsets: Onsets) -> float:
    """Return the largest score of slip before there is any: the worst that a no-slip trial of this length does."""
    before = time < (np.inf if onsets.first is None else onsets.first)
    return float(scores[before, 0].max()) if before.any() else -np.inf


def detect(detector: Detector, tracks: xr.Dataset) -> tuple[Floats, Floats, Onsets]:
    """Return times (n_times,) [s], log odds (n_times, 2) of slip and of gross slip, and when each begins."""
    motion, chances = frame_chances(detector, tracks)
    scores = frame_scores(detector.smoother, motion, chances)
    return motion.time, scores, onsets_from(motion.time, scores, detector.thresholds)


def frame_chances(detector: Detector, tracks: xr.Dataset) -> tuple[Motion, Floats]:
    """Return the motion of the markers in tracks, and the probability of each class in every frame (n_times, 3)."""
    check_tracks_fit(detector, tracks)
    motion = motion_of(tracks, detector.features.motion)
    return motion, probabilities(detector.estimator, features_of(motion, detector.features))


def check_tracks_fit(detector: Detector, tracks: xr.Dataset) -> None:
    """Check that tracks have the markers that a detector was made for."""
    inside = markers_of(tracks, "internal")
    if detector.layout and layout_digest(inside) != detector.layout:
        words = layout_text(inside)
        # Numbers and rings of each marker count, too, and the words do not have them.
        fault = f"have {words}{', numbered otherwise' if words == detector.layout_in_words else ''}"
        allowed = f"needs the markers that the detector learned from: {detector.layout_in_words}"
        raise InputError("tracks", fault, allowed, "train a detector for this layout")


def rate_fault(detector: Detector, rate: float) -> str:
    """Say how the frame rate of a recording [1/s] differs from that of a detector; nothing where it fits."""
    if detector.frame_rate is None or not abs(rate / detector.frame_rate - 1.0) > RATE_TOLERANCE:
        return ""
    return f"has {rate:.4g} frames/s, the detector learned from {detector.frame_rate:.4g} frames/s"


def check_rate_fits(detector: Detector, rate: float, where: str) -> None:
    """Refuse a recording at another frame rate [1/s], of which velocities and times are not those that were learned."""
    fault = rate_fault(detector, rate)
    if fault:
        allowed = f"needs that rate within {100 * RATE_TOLERANCE:.0f} %"
        repair = "record at it, state the true rate of a video with --frame-rate, or train a detector at this one"
        raise InputError(where, fault, allowed, repair)


def frame_rate_of(time: Floats) -> float:
    """Return the frame rate of a recording [1/s] by the times of its frames (n_times,) [s]; NaN of fewer than two."""
    return float(1.0 / np.median(np.diff(time))) if len(time) > 1 else np.nan
