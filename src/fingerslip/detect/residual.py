"""A detector that ships: it learns from no trials and knows no layout; what it needs it takes from the clip itself.

As long as all sticks, markers move in one pattern that grows: a motion as one, and how the sensor yields to it (Dong et
al. 2019 take a rigid motion alone). That is how a plane moves that a moving camera sees, so that no wall slips;
few markers tell the turn and size of the plane alone; it is fitted to the markers that agree. Those whose pictures are
less like a marker than most, at rest or now, are not counted: reflections pull at them. How the sensor yields is
fitted to its motion from rest until it is known as well as it has to be; the limit grows by what noise leaves unknown.
Slip begins where a share of the markers leaves the pattern by more than the limit. It is gross where the markers spring
back, faster than they were ever carried along. A motion that is not rigid from its start is no slide but a press; where
the sensor then rests, the next one begins.
"""

from __future__ import annotations

import time as clock
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats
from fingerslip.detect.features import fill_unseen, markers_of, neighbour_weights
from fingerslip.detect.labels import Onsets
from fingerslip.detect.live import Finding, FrameByFrame, frames_of, latency_of, run_live
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.parameters import NonNegativeNumber, Number, parameters
from fingerslip.tables.table import Cell, Column, Missing, Table
from fingerslip.vision.fields import fit_rigid_motions
from fingerslip.vision.tracking.layouts import nearest_neighbours
from fingerslip.vision.tracking.track import FEWEST, STIRRED, lagging_markers, rest_length
from fingerslip.vision.tracking.tracker import SeenMarkers

#: Share of the markers that left the pattern, and in how many tested clips slip had begun when it was first reached, as
#: (right + 1) / (all + 2): 233 clips, of which 117 slip. Below the limit of 0.1 the shares are assumed.
RIGHT = ((0.0, 0.0), (0.05, 0.25), (0.1, 118 / 119), (1.0, 118 / 119))
#: Time that markers have to stay where they are to rest again [s].
STILL = 0.5
#: The same of gross slip, which was told in five clips in which a part of the contact always sticks.
GROSS_RIGHT = 112 / 118

_MOST = 100  # frames that are taken for rest
# The first motion is one of so many times the noise, and of this share of the distance between markers.
_CLEAR, _FIRST = 10.0, 0.05
_WINDOW, _QUICK = 5, 2  # frames over which markers spring back, slowly and at once
_RIGID = 0.3  # share of the first motion of a slide that is not rigid, at most
_BEHIND = 0.25  # share of the markers that may stay behind the first motion where no slip is said
_MANY = 20  # markers that determine the motion of a plane before a camera
_ROUNDS = 4  # in which markers lose their weight as far as they left the pattern
_LEAST = 1e-6  # chance that stands for none
_SAME = 1e-12  # eigenvalue over the largest of motions that are one


@parameters
class ResidualSettings:
    """When markers have left the pattern; all values were chosen on simulated and analytic slides."""

    rest_frames: Annotated[int, pydantic.Field(ge=1)] = 30  # of rest at the start, at most: it ends where markers stir
    noise: NonNegativeNumber = 5.0  # residual that counts, in units of its root mean square at rest [-]
    growth: NonNegativeNumber = 0.02  # residual that counts, as a share of the displacement [-]
    share: Annotated[Number, pydantic.Field(gt=0, le=1)] = 0.1  # of the markers with such a residual, that is slip [-]
    # of the median quality of positions, that those have at least that count [-]
    likeness: Annotated[Number, pydantic.Field(ge=0, le=1)] = 0.95
    frames: Annotated[int, pydantic.Field(ge=1)] = 3  # in a row in which there are so many; the first is the onset
    fall: NonNegativeNumber = 0.02  # share of their displacement by which markers spring back in gross slip [-]
    speed: NonNegativeNumber = 2.0  # theirs then, in units of that at which they were carried along [-]


@dataclass(frozen=True)
class Slide:
    """What happens from one rest to the next."""

    start: float  # when the markers first leave the noise of rest [s]
    is_press: bool  # whether their first motion is no rigid one, so that nothing is said of slip
    onsets: Onsets = field(default_factory=lambda: Onsets(None, None))
    end: float | None = None  # when the markers rest again [s], where they do
    # Markers that stay behind the first motion and are not counted, as reflections and those outside the contact, of
    # all that are followed.
    behind: int = 0
    markers: int = 0

    @property
    def is_judged(self) -> bool:
        """Whether something is said of slip: not in a press; where many markers stay behind, only that it slips."""
        return not self.is_press and (self.onsets.first is not None or self.behind <= _BEHIND * self.markers)


@dataclass(frozen=True)
class ResidualFinding(Finding):
    """What the detector says at one time, and why; `onsets` are the first of all slides."""

    share: float  # share of the markers that are seen, move with the sensor, and have left the pattern [-]
    # (n_markers, 2), what the pattern leaves, in units of the limit; NaN where not counted: unseen, behind, in presses
    residual: Floats = field(repr=False)
    displacement: float  # root mean square since rest, in the unit of the positions
    slides: tuple[Slide, ...]  # so far


class ResidualDetector(FrameByFrame[ResidualFinding]):
    """The detector, which takes markers frame by frame.

    Parameters
    ----------
    settings : ResidualSettings, optional
        Its thresholds.

    Examples
    --------
    >>> from fingerslip.detect.residual import ResidualSettings, detect_residual
    >>> from fingerslip.detect.synthetic import SyntheticSlide, synthetic_trial
    >>> trial = synthetic_trial("slide", SyntheticSlide(travel=4e-3))
    >>> onsets = detect_residual(trial.tracks, ResidualSettings(rest_frames=20))[-1].onsets
    >>> round(onsets.incipient - trial.labels["contact"].incipient, 1)
    0.0
    """

    def __init__(self, settings: ResidualSettings | None = None) -> None:
        self.settings = settings or ResidualSettings()
        super().__init__(self.settings.rest_frames)
        self._slides: list[Slide] = []
        self._history: deque[tuple[float, Floats]] = deque(maxlen=_MOST)  # times and positions (n, 2)

    def _is_rest_over(self, positions: Floats) -> bool:
        return rest_length(positions) < len(positions)

    def _begin(self, positions: Floats) -> None:
        positions = positions[: rest_length(positions)]
        visible: Flags = np.asarray(np.isfinite(positions).all(axis=2))
        self._chosen: Flags = visible.mean(axis=0) >= 0.5
        if self._chosen.sum() < FEWEST:
            fault = f"{self._chosen.sum()} markers are seen in half of the frames at rest"
            raise InputError("frames", fault, f"needs {FEWEST}", "begin where the sensor rests and is seen")
        positions, visible = positions[:, self._chosen], visible[:, self._chosen]
        rest = np.nanmean(positions, axis=0)
        self._weights = neighbour_weights(rest)
        moved = fill_unseen(positions - rest, visible, self._weights)
        spacing = float(np.median(nearest_neighbours(rest)[1]))
        self._spread = _rms(fit_rigid_motions(rest, rest + moved).residual)
        self._noise = max(self._spread, 1e-3 * spacing)
        self._jitter = max(_rms(moved), self._noise)
        self._clear = max(_CLEAR * self._jitter, _FIRST * spacing)
        self._rest_at(rest)

    def _rest_at(self, rest: Floats) -> None:
        """Count all motion from markers at rest (n, 2), until they rest again."""
        self._rest, self._is_moving = rest, False
        # How the sensor yields along its first motion, of which these are sums, and the error [-] of that.
        self._pattern, self._error = np.zeros_like(rest), 0.0
        self._along, self._moment, self._power = np.zeros_like(rest), np.zeros_like(rest), 0.0
        self._still: Flags = np.zeros(len(rest), dtype=bool)  # which stay behind their neighbours
        self._was_clear: Flags = np.ones(len(rest), dtype=bool)  # when they were last seen at rest
        self._first: deque[Floats] = deque(maxlen=_MOST)
        self._means: deque[Floats] = deque(maxlen=_WINDOW + 1)
        self._steps: deque[float] = deque(maxlen=3 * _WINDOW)
        self._beyond: deque[tuple[float, bool]] = deque(maxlen=self.settings.frames)
        self._fastest = 0.0
        self._stirred: float | None = None  # since when they are beyond their noise at rest [s]

    def _decide(self, frame: SeenMarkers) -> ResidualFinding:
        start, settings = clock.perf_counter(), self.settings
        position = frame.position[self._chosen].astype(np.float64)
        visible: Flags = np.asarray(np.isfinite(position).all(axis=1))
        moved = fill_unseen((position - self._rest)[None], visible[None], self._weights)[0]
        displacement, share = _rms(moved), 0.0
        residual, left = np.full(frame.position.shape, np.nan), np.zeros_like(moved)
        if not self._is_moving:
            self._start(frame.time, moved, displacement)
        is_press = self._is_moving and self._slides[-1].is_press
        clear = self._is_clear(frame.quality)
        if not self._is_moving:
            self._was_clear = np.where(visible, clear, self._was_clear)
        counted = visible & clear & self._was_clear & ~self._still & (not is_press)
        if self._is_moving and counted.any():
            along = float((moved * self._along).sum())
            noise = float(np.hypot(self._noise, self._error * along))
            limit = max(settings.noise * noise, settings.growth * displacement)
            left = self._less_motion(moved - along * self._pattern, counted, limit)
            share = float((np.linalg.norm(left[counted], axis=1) > 1.0).mean())
            is_rough = settings.noise * self._spread > settings.growth * self._power**0.5
            if is_rough and share < settings.share and self._slides[-1].onsets.first is None:
                self._fit_pattern(moved[None])
            self._watch(frame.time, share, self._is_back(moved.mean(axis=0)))
        residual[self._chosen] = np.where(counted[:, None], left, np.nan)
        self._rest_again(frame.time, self._rest + moved)
        onsets = self._first_onsets()
        odds = _log_odds(sureness(share)), _log_odds(GROSS_RIGHT if onsets.gross is not None else 0.0)
        seconds, slides = clock.perf_counter() - start, tuple(self._slides)
        return ResidualFinding(frame.time, *odds, onsets, seconds, share, residual, displacement, slides)

    def _is_clear(self, quality: NDArray[np.floating]) -> Flags:
        """Tell which markers, by the quality of their positions, look as most do: reflections pull at others."""
        quality = quality[self._chosen] if quality.size else np.ones(len(self._rest))
        seen = quality > 0.0
        least = self.settings.likeness * np.median(quality[seen]) if seen.any() else 0.0
        return np.asarray(~seen | (quality >= least))

    def _start(self, time: float, moved: Floats, displacement: float) -> None:
        """See whether the markers begin to move, and in which pattern, by their displacements (n, 2)."""
        self._first.append(moved)
        if displacement <= STIRRED * self._jitter:
            self._stirred = None
        elif self._stirred is None:
            self._stirred = time
        if displacement > self._clear:
            self._still = lagging_markers(self._rest, moved[None], 0.5 * self._clear)
            self._along = moved / (len(moved) * displacement)
            self._fit_pattern(np.stack(self._first))
            self._is_moving, self._clear_since = True, time
            start = time if self._stirred is None else self._stirred
            is_press, behind = _rms(self._less_rigid(moved)) > _RIGID * displacement, int(self._still.sum())
            self._slides.append(Slide(start, is_press, behind=behind, markers=len(moved)))

    def _fit_pattern(self, moved: Floats) -> None:
        """Fit how the sensor yields to further displacements (n_frames, n, 2), as far as noise lets it be known."""
        lengths = np.tensordot(moved, self._along)
        self._moment += np.tensordot(lengths, moved, 1)
        self._power += float(lengths @ lengths)
        pattern, error = self._less_rigid(self._moment / self._power), self._spread / self._power**0.5
        # The share of the pattern that is no noise, as an empirical Bayes estimate has it.
        share = 1.0 - (error / _rms(pattern)) ** 2 if _rms(pattern) > error else 0.0
        self._pattern, self._error = share * pattern, share**0.5 * error

    def _less_rigid(self, moved: Floats) -> Floats:
        position = np.where(self._still[:, None], np.nan, self._rest + moved)
        residual: Floats = np.nan_to_num(fit_rigid_motions(self._rest, position[None]).residual[0])
        return residual

    def _less_motion(self, moved: Floats, counted: Flags, limit: float) -> Floats:
        """Return what a motion as one leaves of displacements (n, 2), in limits; those that count (n,) make it."""
        middle, size = self._rest.mean(axis=0), float(np.ptp(self._rest, axis=0).max())
        x, y = ((self._rest - middle) / size).T
        one, none = np.ones_like(x), np.zeros_like(x)
        columns = [(one, none), (none, one), (x, y), (-y, x)]
        if counted.sum() >= _MANY:
            seen_x, seen_y = ((self._rest + moved - middle) / size).T
            columns += [(x, -y), (y, x), (x * seen_x, x * seen_y), (y * seen_x, y * seen_y)]
        basis = np.array(columns).transpose(2, 1, 0)
        weights, left = counted.astype(np.float64), moved
        basis /= np.maximum(np.linalg.norm(basis, axis=(0, 1)), np.finfo(np.float64).tiny)
        for _ in range(1 + _ROUNDS):
            rows = (weights[:, None, None] * basis).reshape(2 * len(moved), -1).T
            normal = rows @ basis.reshape(2 * len(moved), -1)
            left = moved - basis @ np.linalg.lstsq(normal, rows @ moved.ravel(), rcond=_SAME)[0]
            weights = counted / (1.0 + (left**2).sum(axis=1) / limit**2)
        return left / limit

    def _is_back(self, mean: Floats) -> bool:
        """Tell whether markers sprang back, by their mean displacement (2,)."""
        self._means.append(mean)
        before, length = self._means[0], float(np.linalg.norm(self._means[0]))
        if len(self._means) <= _WINDOW or length < self._clear:
            return False
        step = float((mean - before) @ before) / length
        quick = float((mean - self._means[-1 - _QUICK]) @ before) / length
        least, carried = max(self.settings.fall * length, 3.0 * self._noise), self.settings.speed * self._fastest
        self._steps.append(step)
        self._fastest = max(self._fastest, float(np.median(self._steps)))
        return -step > max(least, carried) or -quick > max(least, carried * _QUICK / _WINDOW)

    def _watch(self, time: float, share: float, is_back: bool) -> None:
        """Note what a frame says of the slide."""
        self._beyond.append((time, share >= self.settings.share))
        slide = self._slides[-1]
        incipient, gross = slide.onsets.incipient, slide.onsets.gross
        if incipient is None and len(self._beyond) == self.settings.frames and all(flag for _, flag in self._beyond):
            incipient = self._beyond[0][0]
        if gross is None and is_back:
            gross = time
            incipient = time if incipient is None else incipient
        self._slides[-1] = replace(slide, onsets=Onsets(incipient, gross))

    def _rest_again(self, time: float, position: Floats) -> None:
        """Begin anew where markers that moved stay at their positions (n, 2)."""
        self._history.append((time, position))
        if not self._is_moving:
            return
        newest = [places for _, places in self._history][-FEWEST:]
        if len(newest) == FEWEST and _rms(np.stack(newest) - self._rest) < 0.5 * self._clear:
            self._end(time, self._rest)  # back where it began
            return
        if time - self._clear_since < STILL:
            return
        recent = np.stack([places for then, places in self._history if time - then <= STILL])
        earlier, later = np.array_split(recent, 2)
        is_still = _rms(recent - recent.mean(axis=0)) < STIRRED * self._jitter
        if is_still and len(recent) >= FEWEST and _rms(later.mean(axis=0) - earlier.mean(axis=0)) < self._jitter:
            self._end(time, recent.mean(axis=0))

    def _end(self, time: float, rest: Floats) -> None:
        self._slides[-1] = replace(self._slides[-1], end=time)
        self._rest_at(rest)

    def _first_onsets(self) -> Onsets:
        slides = [slide.onsets for slide in self._slides]
        return Onsets(
            next((onsets.incipient for onsets in slides if onsets.incipient is not None), None),
            next((onsets.gross for onsets in slides if onsets.gross is not None), None),
        )


def _rms(vectors: Floats) -> float:
    """Return the root mean square length of vectors (..., 2)."""
    return float(np.sqrt((vectors**2).sum(axis=-1).mean()))


def sureness(share: float) -> float:
    """Return how sure it is that a share of the markers that left the pattern [-] is slip, by the clips of the tests.

    Examples
    --------
    >>> sureness(0.0), sureness(0.04)
    (0.0, 0.2)
    """
    return float(np.interp(share, [row[0] for row in RIGHT], [row[1] for row in RIGHT]))


def _log_odds(chance: float) -> float:
    return float(np.log(max(chance, _LEAST) / max(1.0 - chance, _LEAST)))


def frames_at_rest(tracks: xr.Dataset) -> int:
    """Return in how many frames at their start the markers of tracks rest; at least five."""
    position = markers_of(tracks, "internal")["position"].values
    if len(position) <= FEWEST:
        raise InputError("tracks", f"have {len(position)} frames", f"needs more than {FEWEST} at rest", "record more")
    return min(rest_length(position), _MOST)


def detect_residual(tracks: xr.Dataset, settings: ResidualSettings | None = None) -> list[ResidualFinding]:
    """Return what the detector finds in the internal markers of tracks, frame by frame."""
    detector = ResidualDetector(settings)
    findings = list(run_live(detector, frames_of(tracks)))
    if not findings:
        fault = f"have {tracks.sizes['time']} frames"
        raise InputError("tracks", fault, f"needs the {detector.rest_frames} at rest and more")
    return findings


def slides_of(findings: Sequence[Finding]) -> tuple[Slide, ...]:
    """Return what happens from rest to rest; what a detector finds that knows no rests is one slide."""
    last = findings[-1]
    if isinstance(last, ResidualFinding):
        return last.slides
    return (Slide(findings[0].time, is_press=False, onsets=last.onsets),)


def findings_table(findings: Sequence[Finding], title: str, note: str) -> Table:
    """Return what a detector found, and how long it took; the note says what is in that time."""
    latency, onsets, slides = latency_of(findings), findings[-1].onsets, slides_of(findings)
    is_judged = not slides or any(slide.is_judged for slide in slides)
    no_event = Missing.NO_EVENT if is_judged else Missing.NOT_JUDGED
    # Markers that only stop are not seen to slip as one.
    is_open = isinstance(findings[-1], ResidualFinding) and onsets.incipient is not None
    no_gross = Missing.NOT_JUDGED if is_open else no_event
    rows: tuple[tuple[Cell, ...], ...] = (
        ("slip begins [s]", no_event if onsets.incipient is None else f"{onsets.incipient:.4g}"),
        ("gross slip begins [s]", no_gross if onsets.gross is None else f"{onsets.gross:.4g}"),
        ("frames", str(latency.frames)),
        ("median latency [ms]", f"{1e3 * latency.median:.3g}"),
        ("latency of 95 % of frames below [ms]", f"{1e3 * latency.late:.3g}"),
        ("largest latency [ms]", f"{1e3 * latency.largest:.3g}"),
        ("processed a second", f"{latency.rate:.4g}"),
    )
    return Table(title, (Column(""), Column("value")), rows, note)
