"""A detector frame by frame: marker positions in, scores and events out, from a file, a tracker or a camera."""

from __future__ import annotations

import dataclasses
import time as clock
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.classifiers import probabilities
from fingerslip.detect.features import features_of
from fingerslip.detect.labels import Onsets
from fingerslip.detect.motion import Motion, fill_unseen, markers_of, neighbour_weights, velocities
from fingerslip.detect.training import Detector, check_tracks_fit
from fingerslip.errors import InputError
from fingerslip.vision.tracking.track import MarkerStream

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "Finding",
    "Frame",
    "Latency",
    "LiveDetector",
    "frames_of",
    "latency_of",
    "run_live",
    "run_on_markers",
    "run_on_tracks",
]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Frame:
    """Where the internal markers are at one time.

    Parameters
    ----------
    time : float
        Time [s].
    position : (n_markers, 2) array
        Positions in the unit and the order that the detector learned, NaN where a marker is not seen.
    """

    time: float
    position: Floats


@dataclass(frozen=True)
class Finding:
    """What a detector says at one time."""

    time: float  # time of the frame [s]
    slip: float  # log odds of any slip, and of gross slip
    gross: float  # log odds of any slip, and of gross slip
    onsets: Onsets  # when each began, as far as it has
    seconds: float  # how long the frame took [s]


class LiveDetector:
    """A detector that takes frames one at a time and finds what it finds in whole tracks.

    The frames at rest are kept until all are there; then they are worked off at once, so slip at rest is reported late.

    Arrays: ring (n_markers,).
    """

    def __init__(self, detector: Detector, ring: NDArray[np.intp] | None = None) -> None:
        self.detector = detector
        motion = detector.features.motion
        self._ring = ring
        self._waiting: list[Frame] = []
        self._recent: deque[tuple[float, Floats, NDArray[np.bool_]]] = deque(maxlen=motion.window)
        self._rest: Floats | None = None
        self._weights = np.zeros((0, 0))
        self._state = detector.smoother.start()
        self._onsets = Onsets(None, None)

    def take(self, frame: Frame) -> list[Finding]:
        """Take the next frame and return what is found: nothing until rest is over, then one finding a frame.

        Raises
        ------
        InputError
            Where the number of markers changes, time does not go on, or a marker was never seen at rest.
        """
        self._check(frame)
        if self._rest is not None:
            return [self._finding(frame)]
        self._waiting.append(frame)
        if len(self._waiting) < self.detector.features.motion.rest_frames:
            return []
        self._rest = self._at_rest()
        self._weights = neighbour_weights(self._rest)
        decisions = [self._finding(entry) for entry in self._waiting]
        self._waiting = []
        return decisions

    def _check(self, frame: Frame) -> None:
        times = [self._recent[-1][0]] if self._recent else [entry.time for entry in self._waiting[-1:]]
        if times and not frame.time > times[0]:
            raise InputError("frame", f"is at {frame.time:.6g} s after {times[0]:.6g} s", "needs rising times")
        wanted = self._waiting[0].position.shape if self._waiting else (0 if self._rest is None else self._rest.shape)
        if wanted and frame.position.shape != wanted:
            raise InputError("frame", f"has positions of shape {frame.position.shape}", f"needs {wanted}")

    def _at_rest(self) -> Floats:
        positions = np.stack([frame.position for frame in self._waiting])
        visible = ~np.isnan(positions).any(axis=2)
        if not visible.any(axis=0).all():
            marker = int(np.argmin(visible.any(axis=0)))
            raise InputError(f"marker {marker}", "is seen in none of the frames at rest", "needs a rest position")
        mean: Floats = np.nansum(positions, axis=0) / visible.sum(axis=0)[:, None]
        return mean

    def _finding(self, frame: Frame) -> Finding:
        start = clock.perf_counter()
        before = self._recent[-1][0] if self._recent else frame.time
        moved = self._motion(frame)
        features = self.detector.features
        chances = np.full((1, 3), np.nan)
        if moved.usable[0]:
            chances = probabilities(self.detector.estimator, features_of(moved, features))
        interval = np.array([frame.time - before])
        scores, self._state = self.detector.smoother.scores(self._state, interval, chances)
        self._onsets = self._with(frame.time, scores[0])
        seconds = clock.perf_counter() - start
        return Finding(frame.time, float(scores[0, 0]), float(scores[0, 1]), self._onsets, seconds)

    def _motion(self, frame: Frame) -> Motion:
        """Return the motion of the newest frame alone."""
        assert self._rest is not None
        visible: NDArray[np.bool_] = np.asarray(np.isfinite(frame.position).all(axis=1))
        displacement = fill_unseen((frame.position - self._rest)[None], visible[None], self._weights)
        self._recent.append((frame.time, displacement[0], visible))
        times, moved, seen = (np.array(column) for column in zip(*self._recent, strict=True))
        velocity = velocities(times, moved, seen, len(times))[-1:]
        usable = np.array([visible.mean() >= self.detector.features.motion.least_seen])
        ring = np.zeros(len(self._rest), dtype=np.intp) if self._ring is None else self._ring
        return Motion(times[-1:], self._rest, displacement, velocity, ring, visible[None], usable)

    def _with(self, time: float, scores: Floats) -> Onsets:
        limits, old = self.detector.thresholds, self._onsets
        incipient = time if old.incipient is None and scores[0] > limits.slip else old.incipient
        gross = time if old.gross is None and incipient is not None and scores[1] > limits.gross else old.gross
        return Onsets(incipient, gross)


def frames_of(tracks: xr.Dataset) -> Iterator[Frame]:
    """Yield the internal markers of tracks frame by frame.

    This is the seam for other sources: whatever yields :class:`Frame`, a tracker that follows a video or a camera for
    instance, can be given to :func:`run_live`.

    Raises
    ------
    InputError
        Where the tracks have no internal markers.
    """
    inside = markers_of(tracks, "internal")
    for time, position in zip(inside["time"].values, inside["position"].values, strict=True):
        yield Frame(float(time), position)


def run_live(detector: Detector, frames: Iterable[Frame], ring: NDArray[np.intp] | None = None) -> Iterator[Finding]:
    """Yield what a detector finds, frame by frame.

    Parameters
    ----------
    detector : Detector
        The detector.
    frames : iterable of Frame
        The frames.
    ring : (n_markers,) array of int, optional
        Ring of each marker.

    Raises
    ------
    InputError
        Where a frame does not follow from the one before.
    """
    live = LiveDetector(detector, ring)
    for frame in frames:
        yield from live.take(frame)


def run_on_tracks(detector: Detector, tracks: xr.Dataset) -> Iterator[Finding]:
    """Yield what a detector finds in tracks, frame by frame."""
    check_tracks_fit(detector, tracks)
    inside = markers_of(tracks, "internal")
    ring = inside["ring"].values.astype(np.intp) if "ring" in inside.variables else None
    yield from run_live(detector, frames_of(tracks), ring)


def run_on_markers(detector: Detector, stream: MarkerStream) -> Iterator[Finding]:
    """Yield what a detector finds in a video, frame by frame; the time of a frame is that of tracker and detector."""
    check_tracks_fit(detector, stream.at_rest)
    live, start = LiveDetector(detector, stream.reference.ring), clock.perf_counter()
    for seen in stream:
        decisions = live.take(Frame(seen.time, seen.position.astype(np.float64)))
        duration, start = clock.perf_counter() - start, clock.perf_counter()
        # The frames at rest are worked off at once, so only later ones have a time of their own.
        yield from (
            dataclasses.replace(decision, seconds=duration if len(decisions) == 1 else decision.seconds)
            for decision in decisions
        )


@dataclass(frozen=True)
class Latency:
    """How long frames took."""

    frames: int  # number of frames
    median: float  # median, and time that 95 % of the frames kept below [s]
    late: float  # median, and time that 95 % of the frames kept below [s]
    rate: float  # frames a second that can be kept up


def latency_of(findings: list[Finding]) -> Latency:
    """Return how long frames took.

    Raises
    ------
    InputError
        Where there are none.
    """
    if not findings:
        raise InputError("frames", "got fewer than the frames at rest", "needs more of them")
    seconds = np.array([finding.seconds for finding in findings])
    middle, late = (float(quantile) for quantile in np.quantile(seconds, (0.5, 0.95)))
    return Latency(len(seconds), middle, late, float(1.0 / seconds.mean()))
