"""A tracker that takes the frames of a sensor one at a time."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.tracking.follow import follow, rest_state
from fingerslip.vision.tracking.layouts import LayoutName, check_layout
from fingerslip.vision.tracking.reference import Reference, reference_of
from fingerslip.vision.tracks import make_tracks
from fingerslip.vision.video import DUPLICATED, Exposure, Frame, frame_state, opencv, rest_exposure

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

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
    >>> rows, columns = np.mgrid[:120, :120]
    >>> frame = np.full((120, 120), 180, dtype=np.uint8)
    >>> for x, y in [(30, 30), (60, 30), (90, 30), (45, 60), (75, 60), (60, 90)]:
    ...     frame[np.hypot(columns - x, rows - y) < 5] = 40
    >>> tracker = MarkerTracker(n_markers=6, rest_frames=2)
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
        check_layout(layout)
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

    def take(self, frame: Frame, time: float) -> list[SeenMarkers]:
        """Take the grey frame (height, width) of a time [s] and return where its markers are, once those are known.

        Returns
        -------
        list of SeenMarkers
            None of them while the first frames wait; all of these at once; then those of each frame.

        Raises
        ------
        InputError
            Where the first frames show no or too few markers; where a frame has another size than the first.
        """
        if frame.ndim != 2:
            fault, allowed = f"a frame has the shape {frame.shape}", "needs (height, width), grey"
            raise InputError(self.name, fault, allowed, "read it with fs.live_frames")
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


def _mask_of(mask: NDArray[np.bool_] | str | Path | None, shape: tuple[int, ...]) -> Flags | None:
    if mask is None:
        return None
    if isinstance(mask, str | Path):
        image = opencv().imread(str(mask), 0) if Path(mask).is_file() else None
        if image is None:
            raise InputError("mask", f"{mask} cannot be read as an image", "needs one that is white where markers are")
        mask = image > 127
    allowed = np.ascontiguousarray(mask, dtype=bool)
    if allowed.shape != shape:
        raise InputError("mask", f"got shape {allowed.shape}", f"needs {shape}, the height and width of the frames")
    return allowed
