"""A detector frame by frame: marker positions in, scores and events out, from a file, a tracker or a camera."""

from __future__ import annotations

import time as clock
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats
from fingerslip.detect.classifiers import probabilities
from fingerslip.detect.features import (
    Motion,
    features_of,
    fill_unseen,
    markers_of,
    mean_at_rest,
    neighbour_weights,
    velocities,
)
from fingerslip.detect.labels import Onsets
from fingerslip.detect.training import Detector, check_tracks_fit, strange_share
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.vision.tracking.tracker import SeenMarkers
from fingerslip.vision.tracks import check_size


@dataclass(frozen=True)
class Finding:
    """What a detector says at one time."""

    time: float  # [s]
    slip: float  # log odds of any slip
    gross: float  # log odds of gross slip
    onsets: Onsets  # when each began, as far as it has
    seconds: float  # how long the frame took [s]


F = TypeVar("F", bound=Finding)


class FrameByFrame(ABC, Generic[F]):
    """What takes the markers of frames one at a time, and waits until those at rest are all there.

    The frames at rest are then worked off at once, so slip at rest is reported late.
    """

    def __init__(self, rest_frames: int) -> None:
        self.rest_frames = rest_frames
        self._waiting: list[SeenMarkers] | None = []  # none once rest is over
        self._last: SeenMarkers | None = None

    def take(self, frame: SeenMarkers) -> list[F]:
        """Take the next frame and return what is found: nothing until rest is over, then one finding a frame.

        Raises
        ------
        InputError
            Where the number of markers changes, time does not go on, or a marker was never seen at rest.
        """
        if not isinstance(frame, SeenMarkers):
            repair = "write: for seen in tracker.take(frame, time): live.take(seen)"
            raise InputError("frame", f"is a {type(frame).__name__}", "needs the markers of one frame", repair)
        before = self._last
        if before is not None and not frame.time > before.time:
            raise InputError("frame", f"is at {frame.time:.6g} s after {before.time:.6g} s", "needs rising times")
        if before is not None and frame.position.shape != before.position.shape:
            fault = f"has positions of shape {frame.position.shape}"
            raise InputError("frame", fault, f"needs {before.position.shape}")
        check_size(frame.position, "frame")
        self._last = frame
        if self._waiting is None:
            return [self._decide(frame)]
        self._waiting.append(frame)
        positions = np.stack([entry.position for entry in self._waiting]).astype(np.float64)
        if len(positions) < self.rest_frames and not self._is_rest_over(positions):
            return []
        waiting, self._waiting = self._waiting, None
        self._begin(positions)
        return [self._decide(entry) for entry in waiting]

    def _is_rest_over(self, positions: Floats) -> bool:
        """Tell whether rest is over before its frames are all there, by positions (n_frames, n_markers, 2)."""
        del positions
        return False

    @abstractmethod
    def _begin(self, positions: Floats) -> None:
        """Take the positions of the frames that were waited for, (n_frames, n_markers, 2)."""

    @abstractmethod
    def _decide(self, frame: SeenMarkers) -> F:
        """Return what is found in a frame."""


class LiveDetector(FrameByFrame[Finding]):
    """A trained detector that takes frames one at a time and finds what it finds in whole tracks.

    Parameters
    ----------
    detector : Detector
        The detector, as :func:`fingerslip.detect.model_file.read_detector` reads it.
    ring : (n_markers,) array of int, optional
        Ring of each marker, where the detector needs it.

    Examples
    --------
    ::

        tracker, live = fs.MarkerTracker(n_markers=81, rest_frames=100), fs.LiveDetector(read_detector("detector"))
        for time, frame in fs.live_frames(0):
            for seen in tracker.take(frame, time):
                for finding in live.take(seen):
                    print(finding.onsets)
    """

    def __init__(self, detector: Detector, ring: NDArray[np.intp] | None = None) -> None:
        super().__init__(detector.features.motion.rest_frames)
        self.detector = detector
        self._ring = np.zeros(0, dtype=np.intp) if ring is None else ring
        self._recent: deque[tuple[float, Floats, Flags]] = deque(maxlen=detector.features.motion.window)
        self._state = detector.smoother.start()
        self._onsets = Onsets(None, None)
        # At rest and later: sum of the shares of features beyond the range of those learned, and number of frames.
        self._strange = np.zeros((2, 2))
        self._resting = self.rest_frames

    @property
    def strange_shares(self) -> Floats:
        """Shares of the features, at rest and later (2,), that were beyond the range of those learned so far.

        Sums over the frames are divided by at least as many as there are at rest, so that the first few decide nothing.
        """
        shares: Floats = self._strange[:, 0] / np.maximum(self._strange[:, 1], self.rest_frames)
        return shares

    def _begin(self, positions: Floats) -> None:
        self._rest = mean_at_rest(positions, np.arange(positions.shape[1]))
        self._weights = neighbour_weights(self._rest)
        self._ring = self._ring if self._ring.size else np.zeros(len(self._rest), dtype=np.intp)

    def _decide(self, frame: SeenMarkers) -> Finding:
        start, detector = clock.perf_counter(), self.detector
        interval = np.array([frame.time - (self._recent[-1][0] if self._recent else frame.time)])
        visible: Flags = np.asarray(np.isfinite(frame.position).all(axis=1))
        displacement = fill_unseen((frame.position - self._rest)[None], visible[None], self._weights)
        self._recent.append((frame.time, displacement[0], visible))
        chances = np.full((1, 3), np.nan)
        if visible.mean() >= detector.features.motion.least_seen:
            times, moved, seen = (np.array(column) for column in zip(*self._recent, strict=True))
            velocity = velocities(times, moved, seen, len(times))[-1:]
            motion = Motion(times[-1:], self._rest, displacement, velocity, self._ring, visible[None], np.array([True]))
            values, is_rest = features_of(motion, detector.features), self._resting > 0
            self._strange[0 if is_rest else 1] += strange_share(detector, values, is_rest=is_rest), 1.0
            chances = probabilities(detector.estimator, values)
        self._resting -= 1
        scores, self._state = detector.smoother.scores(self._state, interval, chances)
        slip, gross = scores[0].tolist()
        limits, onsets = detector.thresholds, self._onsets
        incipient = frame.time if onsets.incipient is None and slip > limits.slip else onsets.incipient
        is_first_gross = onsets.gross is None and incipient is not None and gross > limits.gross
        self._onsets = Onsets(incipient, frame.time if is_first_gross else onsets.gross)
        return Finding(frame.time, slip, gross, self._onsets, clock.perf_counter() - start)


def frames_of(tracks: xr.Dataset) -> Iterator[SeenMarkers]:
    """Yield the internal markers of tracks frame by frame, as a tracker behind a camera does."""
    inside = markers_of(tracks, "internal")
    columns = (inside[name].values for name in ("time", "position", "quality"))
    for time, position, quality in zip(*columns, strict=True):
        yield SeenMarkers(float(time), position, quality)


def run_live(live: FrameByFrame[F], frames: Iterable[SeenMarkers]) -> Iterator[F]:
    """Yield what is found, frame by frame."""
    for frame in frames:
        yield from live.take(frame)


def run_on_tracks(detector: Detector, tracks: xr.Dataset) -> Iterator[Finding]:
    """Yield what a detector finds in tracks, frame by frame."""
    check_tracks_fit(detector, tracks)
    inside = markers_of(tracks, "internal")
    ring = inside["ring"].values.astype(np.intp) if "ring" in inside.variables else None
    yield from run_live(LiveDetector(detector, ring), frames_of(tracks))


@dataclass(frozen=True)
class Latency:
    """How long frames took."""

    frames: int
    median: float  # [s]
    late: float  # time that 95 % of the frames kept below [s]
    largest: float  # [s]
    rate: float  # frames a second that can be kept up


def latency_of(findings: Sequence[Finding]) -> Latency:
    """Return how long frames took; raise InputError where there are none."""
    if not findings:
        raise InputError("frames", "got fewer than the frames at rest", "needs more of them")
    seconds = np.array([finding.seconds for finding in findings])
    middle, late = (float(quantile) for quantile in np.quantile(seconds, (0.5, 0.95)))
    return Latency(len(seconds), middle, late, float(seconds.max()), float(1.0 / seconds.mean()))
