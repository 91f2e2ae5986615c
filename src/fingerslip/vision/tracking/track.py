"""From a video to tracks."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import FingerslipError
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole
from fingerslip.vision.exposure import STATES, Exposure
from fingerslip.vision.tracking.frames import Channel, VideoInput
from fingerslip.vision.tracking.lens import lens_of, undistorted
from fingerslip.vision.tracking.stream import MarkerStream, SeenMarkers, open_markers
from fingerslip.vision.tracking.topology import LayoutName
from fingerslip.vision.tracks import make_tracks

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["TrackingWarning", "track_markers"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Frame = NDArray[np.uint8]

_MOVED = 0.5  # px that the rest frames may move
# Share of the frames in which a marker may be missing before it is said.
_OFTEN = 0.1
_DARK = 16.0  # mean grey level at rest: below it frames use less than a sixteenth of their levels
_SATURATED = 0.5  # share of the pixels at rest


class TrackingWarning(UserWarning):
    """Tracks are not all that they should be; their attribute ``warnings`` says the same."""


def track_markers(
    video: VideoInput,
    *,
    n_markers: int | None = None,
    rest_frames: int = 30,
    layout: LayoutName = "rings",
    mask: NDArray[np.bool_] | str | Path | None = None,
    calibration: Pinhole | Fisheye | str | Path | None = None,
    bright: bool | None = None,
    frame_rate: float | None = None,
    channel: Channel = "grey",
) -> xr.Dataset:
    """Follow the markers of a video of an optical tactile sensor.

    Parameters
    ----------
    video : path, array or sequence of arrays
        A video file, a folder of images, or frames (n, height, width) or (n, height, width, 3), blue first.
    n_markers : int, optional
        How many markers there are; without it, the number at which the first frames are clearest.
    rest_frames : int, optional
        How many frames the sensor rests at the beginning: their mean is the reference.
    layout : {'rings', 'hex', 'free'}, optional
        Arrangement of the markers, which numbers them: concentric rings and hexagonal lattices from the centre
        outwards and by rising angle from x to y of the image, free ones by rows.
    mask : (height, width) array of bool, or path, optional
        Pixels that count, such as those inside a bright ring; a path is that of an image which is white there.
    calibration : Pinhole or Fisheye or path, optional
        Intrinsics of the camera, or a file of them in OpenCV's form; positions are then those of a camera without
        distortion.
    bright : bool, optional
        Whether markers are brighter than what is around them; without it, what the first frames show.
    frame_rate : float, optional
        Frames a second [1/s], instead of what the file states. Folders and arrays need it.
    channel : {'grey', 'blue', 'green', 'red'}, optional
        What is taken of colour frames.

    Returns
    -------
    xarray.Dataset
        Tracks in pixels, see :mod:`fingerslip.vision.tracks`, with also ``reference`` (marker, axis), the mean position
        in the rest frames; ``rest_noise`` (marker, axis), the standard deviation there; ``radius`` (marker);
        ``frame_state`` (time): 0 fine, 1 dark, 2 overexposed, 3 duplicated; and with a calibration ``image_position``.
        The attribute ``partial`` is 1 where the video or the markers are not whole, and ``warnings`` says why.

    Raises
    ------
    InputError
        Where the video cannot be read, has no frame rate, or shows no or too few markers; where an argument cannot be.

    Warns
    -----
    TrackingWarning
        Where the tracks are marked for a reason: frames or markers are missing, frames are dark, overexposed or
        duplicated, or the sensor moved while it should have rested.

    Examples
    --------
    >>> import numpy as np
    >>> rows, columns = np.mgrid[:120, :120]
    >>> frame = np.full((120, 120), 180, dtype=np.uint8)
    >>> for x, y in [(30, 30), (60, 30), (90, 30), (45, 60), (75, 60), (60, 90)]:
    ...     frame[np.hypot(columns - x, rows - y) < 5] = 40
    >>> frames = [np.roll(frame, shift, axis=1) for shift in (0, 1, 2, 3)]
    >>> tracks = track_markers(frames, n_markers=6, rest_frames=1, layout="free", frame_rate=30.0)
    >>> tracks["position"].sel(marker=0, axis="x").values.round(1).tolist()
    [30.0, 31.0, 32.0, 33.0]
    """
    stream = open_markers(
        video,
        n_markers=n_markers,
        rest_frames=rest_frames,
        layout=layout,
        mask=mask,
        bright=bright,
        frame_rate=frame_rate,
        channel=channel,
    )
    course = _followed(stream)
    if calibration is not None:
        lens = lens_of(calibration, (stream.shape[1], stream.shape[0]))
        course = dataclasses.replace(course, position=undistorted(lens, course.position), raw=course.position)
    tracks = _labelled(stream, course, rest_frames)
    for text in filter(None, str(tracks.attrs["warnings"]).split("\n")):
        warnings.warn(text, TrackingWarning, stacklevel=2)
    return tracks


@dataclass(frozen=True)
class _Course:
    """What was found in all frames: positions (t, n, 2), qualities (t, n), states (t,), why reading ended early, and
    positions before the lens was corrected.
    """

    position: Floats
    quality: Floats
    states: NDArray[np.int8]
    broken: str = ""
    raw: Floats | None = None


def _followed(stream: MarkerStream) -> _Course:
    """Return what was found in all frames; of the frames, only two are in memory at a time."""
    rows: list[SeenMarkers] = []
    broken = ""
    try:
        for row in stream:
            rows.append(row)  # noqa: PERF402  what was read before an error is kept
    except FingerslipError as error:
        broken = str(error)
    return _Course(
        np.array([row.position for row in rows], dtype=np.float64),
        np.array([row.quality for row in rows], dtype=np.float64),
        np.array([row.state for row in rows], dtype=np.int8),
        broken,
    )


def _labelled(stream: MarkerStream, course: _Course, rest_frames: int) -> xr.Dataset:
    frames, reference = stream.frames, stream.reference
    complaints = [*reference.warnings, *_complaints(stream, course, rest_frames)]
    rest = min(rest_frames, len(course.states))
    partial = bool(course.broken or reference.warnings)
    tracks = make_tracks(
        course.position,
        np.arange(len(course.states)) / frames.frame_rate,
        units="px",
        quality=course.quality,
        ring=reference.ring,
        angle=reference.angle,
        attributes={
            "image_width": stream.shape[1],
            "image_height": stream.shape[0],
            "frame_rate": frames.frame_rate,
            "source": frames.name,
            "rest_frames": rest,
            "bright": int(reference.markers.polarity > 0),
            "partial": int(partial),
            "warnings": "\n".join(complaints),
        },
    )
    if course.raw is not None:
        meaning = {"units": "px", "long_name": "position in the frames, with the lens's distortion"}
        tracks = tracks.assign(image_position=(("time", "marker", "axis"), course.raw, meaning))
    return tracks.assign(_at_rest(course.position[:rest])).assign(
        frame_state=("time", course.states, {"long_name": ", ".join(f"{n} {s}" for n, s in enumerate(STATES))}),
        radius=("marker", reference.markers.radius, {"units": "px", "long_name": "radius of the markers at rest"}),
    )


def _at_rest(position: Floats) -> dict[str, tuple[tuple[str, str], Floats, dict[str, str]]]:
    seen = np.isfinite(position)
    count = seen.sum(axis=0)
    total = np.where(seen, position, 0.0).sum(axis=0)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    square = np.where(seen, (position - mean) ** 2, 0.0).sum(axis=0)
    noise = np.where(count > 1, np.sqrt(square / np.maximum(count - 1, 1)), np.nan)
    dims = ("marker", "axis")
    return {
        "reference": (dims, mean, {"units": "px", "long_name": "mean position in the rest frames"}),
        "rest_noise": (dims, noise, {"units": "px", "long_name": "standard deviation of the position at rest"}),
    }


def _complaints(stream: MarkerStream, course: _Course, rest_frames: int) -> Iterator[str]:
    """Yield what is wrong with the frames."""
    frames, count = stream.frames, len(course.states)
    rest = min(rest_frames, count)
    if course.broken:
        yield f"{course.broken}; the tracks are those of the first {count} frames"
    elif count < rest_frames:
        yield f"{frames.name}: ends within the {rest_frames} rest frames, after {count}; all are the reference"
    yield from _of_light(frames.name, stream.exposure)
    for number, state in enumerate(STATES):
        which = np.flatnonzero(course.states == number)
        if number and which.size:
            yield f"{frames.name}: {which.size} of {count} frames are {state}, the first is frame {which[0]}"
    often = int((np.isnan(course.position).any(axis=2).mean(axis=0) > _OFTEN).sum())
    if often:
        total = course.position.shape[1]
        yield f"{frames.name}: {often} of {total} markers were not seen in more than a tenth of the frames"
    moved = _moved(course.position[:rest])
    if moved > _MOVED:
        yield f"{frames.name}: the sensor moved by {moved:.1f} px in the {rest} rest frames; the reference is no rest"


def _of_light(name: str, rest: Exposure) -> Iterator[str]:
    """Yield what is wrong with the light at rest: frames are only compared with it later."""
    if rest.mean < _DARK:
        yield f"{name}: is dark, mean grey level {rest.mean:.0f} of 255 at rest; noise is large: add light or exposure"
    if rest.saturated > _SATURATED:
        yield f"{name}: is overexposed, {100 * rest.saturated:.0f} % of the pixels are saturated at rest; less light"


def _moved(position: Floats) -> float:
    """Return the largest distance between the markers' median displacements in some frames [px]."""
    seen = position[np.isfinite(position).all(axis=(1, 2))]
    if len(seen) < 2:
        return 0.0
    middle = np.median(seen - seen.mean(axis=0), axis=1)
    return float(np.linalg.norm(middle.max(axis=0) - middle.min(axis=0)))
