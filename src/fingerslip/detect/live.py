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
from fingerslip.detect.training import Detector, check_tracks_fit
from fingerslip.errors import InputError
from fingerslip.tables.table import Cell, Column, Missing, Table
from fingerslip.vision.tracking.track import MarkerStream

if TYPE_CHECKING:
    import xarray as xr

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

    time: float  # [s]
    slip: float  # log odds of any slip
    gross: float  # log odds of gross slip
    onsets: Onsets  # when each began, as far as it has
    seconds: float  # how long the frame took [s]


class LiveDetector:
    """A detector that takes frames one at a time and finds what it finds in whole tracks.

    The frames at rest are kept until all are there; then they are worked off at once, so slip at rest is reported late.
    `ring` is the ring of each marker, (n_markers,).
    """

    def __init__(self, detector: Detector, ring: NDArray[np.intp] | None = None) -> None:
        self.detector = detector
        self._ring = ring
        self._waiting: list[Frame] = []
        self._recent: deque[tuple[float, Floats, NDArray[np.bool_]]] = deque(maxlen=detector.features.motion.window)
        self._last: Frame | None = None
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
        before = self._last
        if before is not None and not frame.time > before.time:
            raise InputError("frame", f"is at {frame.time:.6g} s after {before.time:.6g} s", "needs rising times")
        if before is not None and frame.position.shape != before.position.shape:
            fault = f"has positions of shape {frame.position.shape}"
            raise InputError("frame", fault, f"needs {before.position.shape}")
        self._last = frame
        if self._rest is not None:
            return [self._decide(frame)]
        self._waiting.append(frame)
        if len(self._waiting) < self.detector.features.motion.rest_frames:
            return []
        positions = np.stack([entry.position for entry in self._waiting])
        self._rest = mean_at_rest(positions, np.arange(positions.shape[1]))
        self._weights = neighbour_weights(self._rest)
        decisions = [self._decide(entry) for entry in self._waiting]
        self._waiting = []
        return decisions

    def _decide(self, frame: Frame) -> Finding:
        start = clock.perf_counter()
        interval = np.array([frame.time - (self._recent[-1][0] if self._recent else frame.time)])
        moved, detector = self._motion(frame), self.detector
        chances = np.full((1, 3), np.nan)
        if moved.usable[0]:
            chances = probabilities(detector.estimator, features_of(moved, detector.features))
        scores, self._state = detector.smoother.scores(self._state, interval, chances)
        slip, gross = scores[0].tolist()
        limits, onsets = detector.thresholds, self._onsets
        incipient = frame.time if onsets.incipient is None and slip > limits.slip else onsets.incipient
        is_first_gross = onsets.gross is None and incipient is not None and gross > limits.gross
        self._onsets = Onsets(incipient, frame.time if is_first_gross else onsets.gross)
        return Finding(frame.time, slip, gross, self._onsets, clock.perf_counter() - start)

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
    """Yield what a detector finds, frame by frame; `ring` is the ring of each marker, (n_markers,).

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

    frames: int
    median: float  # [s]
    late: float  # time that 95 % of the frames kept below [s]
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


def findings_table(findings: list[Finding], title: str, note: str) -> Table:
    """Return what a detector found, and how long it took; the note says what is in that time."""
    latency, onsets = latency_of(findings), findings[-1].onsets
    rows: tuple[tuple[Cell, ...], ...] = (
        ("slip begins [s]", Missing.NO_EVENT if onsets.incipient is None else f"{onsets.incipient:.4g}"),
        ("gross slip begins [s]", Missing.NO_EVENT if onsets.gross is None else f"{onsets.gross:.4g}"),
        ("frames", str(latency.frames)),
        ("median latency [ms]", f"{1e3 * latency.median:.3g}"),
        ("latency of 95 % of frames below [ms]", f"{1e3 * latency.late:.3g}"),
        ("frames a second", f"{latency.rate:.4g}"),
    )
    return Table(title, (Column(""), Column("value")), rows, note)
