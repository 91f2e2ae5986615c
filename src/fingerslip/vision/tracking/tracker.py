"""A tracker that takes the frames of a sensor one at a time, and what it finds the markers by: their reference."""

from __future__ import annotations

import math
import time as clock
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.vision.tracking.blobs import field_of
from fingerslip.vision.tracking.follow import follow, rest_state
from fingerslip.vision.tracking.layouts import LayoutName, layout_of, misfits, topology
from fingerslip.vision.tracking.markers import Markers, known_markers
from fingerslip.vision.tracks import make_tracks
from fingerslip.vision.video import DUPLICATED, Exposure, Frame, frame_state, grey_frame, opencv, rest_exposure

# Markers are looked for in the mean of this many frames, or of the rest frames where they are fewer.
_AVERAGED = 10
# Positions of a frame that shows nothing new are marked.
_OLD_QUALITY = 0.5


@dataclass(frozen=True)
class SeenMarkers:
    """The markers of a frame."""

    time: float  # time of the frame [s]
    position: NDArray[np.floating]  # (n_markers, 2), positions, NaN where a marker is not seen
    quality: NDArray[np.floating] = field(default_factory=lambda: np.empty(0))  # (n_markers,), from 0 (not seen) to 1
    state: int = 0  # 0 fine, 1 dark, 2 overexposed, 3 duplicated
    visible: int = 0  # markers that were seen, and blobs like them that no marker has
    seconds: float = 0.0  # how long it took to find them [s]


class MarkerTracker:
    """A tracker that takes the frames of a sensor one at a time, as they come from a camera.

    The first frames, ten or as many as the sensor rests, wait until all are there: markers are found in their mean.
    Then `reference` says what and how many they are.

    Parameters
    ----------
    n_markers : int, optional
        How many markers there are; without it, what the first frames show.
    rest_frames : int, optional
        How many frames the sensor rests at the beginning.
    layout : {'auto', 'rings', 'hex', 'grid', 'free'}, optional
        Arrangement of the markers.
    mask : (height, width) array of bool, or path, optional
        Pixels that count; a path is that of an image which is white there.
    bright : bool, optional
        Whether markers are brighter than what is around them.
    name : str, optional
        What errors call the frames.

    Examples
    --------
    >>> import numpy as np
    >>> import fingerslip as fs
    >>> rows, columns = np.mgrid[:120, :120]
    >>> frame = np.full((120, 120), 180, dtype=np.uint8)
    >>> for x, y in [(30, 30), (60, 30), (90, 30), (45, 60), (75, 60), (60, 90)]:
    ...     frame[np.hypot(columns - x, rows - y) < 5] = 40
    >>> tracker = fs.MarkerTracker(n_markers=6, rest_frames=2)
    >>> seen = [tracker.take(np.roll(frame, number, axis=1), number / 30.0) for number in range(4)]
    >>> [len(markers) for markers in seen]
    [0, 2, 1, 1]
    >>> round(float(seen[3][0].position[0, 0]), 1)
    33.0
    """

    def __init__(
        self,
        *,
        n_markers: int | None = None,
        rest_frames: int = 30,
        layout: LayoutName = "auto",
        mask: Flags | str | Path | None = None,
        bright: bool | None = None,
        name: str = "frames",
    ) -> None:
        if layout not in get_args(LayoutName):
            raise InputError("layout", f"got {layout!r}", f"needs one of {', '.join(get_args(LayoutName))}")
        for option, number in (("n_markers", n_markers), ("rest_frames", rest_frames)):
            if number is not None and number < 1:
                raise InputError(option, f"got {number}", "needs a number >= 1")
        self.name, self.rest_frames = name, rest_frames
        self.exposure = Exposure(0.0, 0.0)  # how light the frames are at rest
        self.shape: tuple[int, ...] = ()  # height and width of the frames [px]
        self._search = n_markers, layout, bright
        self._mask = mask
        self._waiting: list[tuple[Frame, float]] = []
        self._before: Frame | None = None
        self._reference: Reference | None = None

    @property
    def reference(self) -> Reference:
        """The markers at rest, numbered; raises InputError before there is one."""
        if self._reference is None:
            fault = f"got {len(self._waiting)} frames"
            allowed = f"needs {self._search_frames} to find its markers in"
            raise InputError(self.name, fault, allowed, "take more frames")
        return self._reference

    @property
    def at_rest(self) -> xr.Dataset:
        """Tracks of the reference alone, which tell how many markers there are and in which rings."""
        position: Floats = self.reference.markers.position
        return make_tracks(position[None], [0.0], units="px", ring=self.reference.ring, angle=self.reference.angle)

    @property
    def _search_frames(self) -> int:
        return min(self.rest_frames, _AVERAGED)

    def take(self, frame: NDArray[Any], time: float) -> list[SeenMarkers]:
        """Take the frame of a time [s], grey or blue first, and return where its markers are, once those are known.

        That is nothing while the first frames wait, then all of these at once, then one for each frame. InputError
        where the first frames show no or too few markers, or a frame has another size than the first.
        """
        frame = grey_frame(frame, "grey", self.name)
        self.shape = self.shape or frame.shape
        if frame.shape != self.shape:
            fault = f"a frame is {frame.shape[1]} x {frame.shape[0]} px"
            raise InputError(self.name, fault, f"needs {self.shape[1]} x {self.shape[0]} px, as the first has")
        if self._reference is not None:
            return [self._follow(frame, time)]
        self._waiting.append((frame, time))
        return self.begin() if len(self._waiting) == self._search_frames else []

    def begin(self) -> list[SeenMarkers]:
        """Find the markers in the frames that wait, though they be fewer than wished, and return those of each."""
        if not self._waiting or self._reference is not None:
            return []
        frames = [frame for frame, _ in self._waiting]
        averaged = np.mean(frames, axis=0)
        self._allowed = _mask_of(self._mask, self.shape)
        self._reference = reference_of(averaged, self._allowed, *self._search, self.name)
        self._state = rest_state(self._reference.markers)
        self.exposure = rest_exposure(np.clip(averaged, 0, 255).astype(np.uint8))
        waiting, self._waiting = self._waiting, []
        return [self._follow(frame, time) for frame, time in waiting]

    def _follow(self, frame: Frame, time: float) -> SeenMarkers:
        start = clock.perf_counter()
        light = frame_state(frame, self._before, self.exposure)
        self._state, position, quality = follow(self.reference.markers, self._state, frame, self._allowed)
        if light == DUPLICATED:
            quality = np.minimum(quality, _OLD_QUALITY)
        self._before = frame
        # Single precision is 1e-4 px for the widest images.
        seen = position.astype(np.float32), quality.astype(np.float32)
        return SeenMarkers(time, *seen, light, self._state.visible, clock.perf_counter() - start)


def _mask_of(mask: Flags | str | Path | None, shape: tuple[int, ...]) -> Flags | None:
    if mask is None:
        return None
    where = "mask"
    if isinstance(mask, str | Path):
        where = f"mask: {mask}"
        image = opencv().imread(str(mask), 0) if Path(mask).is_file() else None
        if image is None:
            raise InputError(where, "cannot be read as an image", "needs one that is white where markers are")
        mask = image > 127
    allowed = np.ascontiguousarray(mask, dtype=bool)
    if allowed.shape != shape:
        needed = f"needs {shape}, the height and width of the frames"
        raise InputError(where, f"has the shape {allowed.shape}", needed, "draw it on a frame of the video")
    if not allowed.any():
        raise InputError(where, "leaves out all pixels", "needs some that count, white in an image")
    return allowed


# Quality of a marker, and of one that is of the same kind in shares of the median.
_LEAST_QUALITY, _LIKENESS = 0.6, 0.8
_CLOSEST = 0.45  # of two blobs that are nearer, in distances between markers, one is a reflection
_ODD = 0.1  # share of the blobs that may be no markers, by the layout of the others
_LEAST_SHARE = 0.8  # of the markers; with fewer there is no tracking
_FEWEST = 10  # blobs that may be a sensor's markers where nobody says how many there are
# Contrast over noise, both summed over the pixels of a marker: the largest of pure noise is about 5.
_LEAST_RATIO = 8.0
_DARK, _BRIGHT = 6.0, 245.0  # grey levels
_REPAIR = "give the number of markers (--markers), whether they are bright (--bright, --dark), or a mask (--mask)"


@dataclass(frozen=True)
class Reference:
    """The markers at rest, numbered."""

    markers: Markers  # what is known of them, in the order of their numbers
    layout: str  # how they are arranged
    ring: NDArray[np.intp] | None  # (n,), ring of each
    angle: Floats | None  # (n,), angle of each around the centre [rad]
    warnings: tuple[str, ...]  # what is not as it should be


def reference_of(  # noqa: PLR0917  the options of a search
    image: Floats, mask: Flags | None, n_markers: int | None, layout: LayoutName, bright: bool | None, name: str
) -> Reference:
    """Find, measure and number the markers of the mean of the first frames, image (height, width) [grey levels]."""
    markers = _best(image, mask, bright)
    if markers is not None:
        layout = layout_of(markers.position) if layout == "auto" else layout
        odd = misfits(markers.position, layout)
        markers = markers.select(np.flatnonzero(~odd)) if odd.mean() <= _ODD else markers
        markers = markers.select(np.flatnonzero(~_too_near(markers, _CLOSEST * float(np.median(markers.spacing)))))
        if layout == "free" and n_markers is None:
            # Neither a layout nor a number says which of the blobs are markers.
            markers = markers.select(np.flatnonzero(_same_kind(markers)))
    count = 0 if markers is None else len(markers.position)
    if markers is None or count < (_LEAST_SHARE * n_markers if n_markers else _FEWEST):
        level = float(image.mean())
        light = "dark " if level < _DARK else "overexposed " if level > _BRIGHT else ""
        fault = f"found {count or 'no'} markers in the {light}first frames, of mean grey level {level:.0f} of 255"
        blobs = f"at least {_FEWEST} blobs that are alike and stand out of what is around them"
        raise InputError(name, fault, f"needs {n_markers or blobs}", _REPAIR)
    warnings = []
    if n_markers is not None and count > n_markers:
        alike = int(_same_kind(markers).sum())
        if alike > n_markers:
            repair = f"give n_markers {alike} or none (--markers) for all, or a mask of those that are meant"
            fault = f"asked for {n_markers} markers, found {alike} of the same kind in the first frames"
            warnings.append(f"{name}: {fault}; {repair}")
        markers = markers.select(np.argsort(-markers.quality, kind="stable")[:n_markers])
    elif n_markers is not None and count < n_markers:
        warnings.append(f"found {count} of {n_markers} markers in the first frames")
    numbered = topology(markers.position, layout)
    warnings += [numbered.complaint] if numbered.complaint else []
    ordered = markers.select(numbered.order)
    return Reference(ordered, numbered.layout, numbered.ring, numbered.angle, tuple(warnings))


def _best(image: Floats, mask: Flags | None, bright: bool | None) -> Markers | None:
    """Return the markers of the polarity that has the stronger field, none where it is no more than noise."""
    polarities = (1.0, -1.0) if bright is None else (1.0 if bright else -1.0,)
    fields = {polarity: field_of(image, mask, polarity) for polarity in polarities}
    polarity = max(fields, key=lambda key: float(fields[key].strength.sum()))
    blobs = fields[polarity]
    if not len(blobs.strength):
        return None
    radius = float(np.median(blobs.radius))
    markers = known_markers(image, mask, blobs, polarity)
    near = np.linalg.norm(markers.position - blobs.position, axis=1) < radius
    twice = _too_near(markers, 0.8 * radius)
    markers = markers.select(np.flatnonzero((markers.quality >= _LEAST_QUALITY) & near & ~twice))
    noise = float(np.median(np.abs(np.diff(image, axis=1)))) / (0.6745 * math.sqrt(2.0))
    pixels = math.sqrt(math.pi) * radius
    if not len(markers.position) or float(np.median(markers.amplitude)) * pixels <= _LEAST_RATIO * noise:
        return None
    return markers


def _too_near(markers: Markers, distance: float) -> Flags:
    """Tell which markers (n,) have a stronger one nearer than a distance [px]."""
    apart = np.linalg.norm(markers.position[:, None] - markers.position[None], axis=2)
    rank = np.argsort(np.argsort(-markers.strength, kind="stable"))
    return np.asarray(((apart < distance) & (rank[None] < rank[:, None])).any(axis=1))


def _same_kind(markers: Markers) -> Flags:
    return np.asarray(markers.quality > _LIKENESS * np.median(markers.quality))
