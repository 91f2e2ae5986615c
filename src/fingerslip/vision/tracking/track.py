"""From a video to tracks."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.arrays import Flags, Floats
from fingerslip.errors import FingerslipError
from fingerslip.libraries import xr
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole, read_calibration
from fingerslip.vision.tracking.layouts import LayoutName, expected_displacement, nearest_neighbours
from fingerslip.vision.tracking.tracker import MarkerTracker, SeenMarkers
from fingerslip.vision.tracks import make_tracks, seen
from fingerslip.vision.video import STATES, Channel, Frames, VideoInput, open_frames

_MOVED = 0.5  # px that the rest frames may move
# Median fit of what may be markers in no pattern: of four real clips 0.93 to 0.95, of wood grain, clouds and photos to
# 0.88; specks fit as well as markers.
_ROUND = 0.9
# Share of the frames in which a marker may be missing before it is said.
_OFTEN = 0.1
# Share of the frames in which more blobs than at rest may be without a marker before it is said.
_WITHOUT = 0.02
# How far a marker may leave its neighbours in a frame, in distances between them, before it may be another one.
_LEAP = 0.45
# Blobs like markers that may be visible, in shares of the markers, before it is said.
_MORE = 1.25
_DARK = 16.0  # mean grey level at rest: below it frames use less than a sixteenth of their levels
_SATURATED = 0.5  # share of the pixels at rest


def undistort_pixels(lens: Pinhole | Fisheye, position: Floats) -> Floats:
    """Return pixels (..., 2) of a pinhole with the same camera matrix and no distortion; NaN for what it cannot see."""
    rays = lens.directions(position)
    depth = np.where(rays[..., 2] > 0, rays[..., 2], np.nan)
    return rays[..., :2] / depth[..., None] * (lens.focal_x, lens.focal_y) + (lens.centre_x, lens.centre_y)


class TrackingWarning(UserWarning):
    """Tracks are not all that they should be; their attribute ``warnings`` says the same."""


def track_markers(
    video: VideoInput,
    *,
    n_markers: int | None = None,
    rest_frames: int | None = None,
    layout: LayoutName = "auto",
    mask: Flags | str | Path | None = None,
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
        How many frames the sensor rests at the beginning: their mean is the reference. Without it, as many as the
        markers show, 30 at most.
    layout : {'auto', 'rings', 'hex', 'grid', 'free'}, optional
        Arrangement of the markers, which numbers them: concentric rings and hexagonal lattices from the centre
        outwards and by rising angle from x to y of the image, square grids and free ones by rows. Without it, the
        first of these that nearly all markers fit.
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
        ``still`` (marker), 1 where a marker does not move with its neighbours;
        ``frame_state`` (time): 0 fine, 1 dark, 2 overexposed, 3 duplicated; ``visible`` (time), how many markers were
        seen or would have been, blobs like them included; and with a calibration ``image_position``. The attribute
        ``layout`` is the arrangement.
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
    >>> import fingerslip as fs
    >>> rows, columns = np.mgrid[:120, :120]
    >>> frame = np.full((120, 120), 180, dtype=np.uint8)
    >>> for x, y in [(30, 30), (60, 30), (90, 30), (45, 60), (75, 60), (60, 90)]:
    ...     frame[np.hypot(columns - x, rows - y) < 5] = 40
    >>> frames = [np.roll(frame, shift, axis=1) for shift in (0, 1, 2, 3)]
    >>> tracks = fs.track_markers(frames, n_markers=6, rest_frames=1, layout="free", frame_rate=30.0)
    >>> tracks["position"].sel(marker=0, axis="x").values.round(1).tolist()
    [30.0, 31.0, 32.0, 33.0]
    """
    frames = open_frames(video, frame_rate, channel)
    rest = {} if rest_frames is None else {"rest_frames": rest_frames}
    tracker = MarkerTracker(n_markers=n_markers, layout=layout, mask=mask, bright=bright, name=frames.name, **rest)
    lens = lens_of(calibration, frames)
    rows, broken = follow_video(frames, tracker)
    tracks = tracks_of(tracker, rows, frames.frame_rate, lens, broken, rest_frames=rest_frames)
    for text in filter(None, str(tracks.attrs["warnings"]).split("\n")):
        warnings.warn(text, TrackingWarning, stacklevel=2)
    return tracks


#: Dimensions, unit and meaning of what tracks of a video have beside what all tracks have.
_OF_VIDEOS: Mapping[str, tuple[tuple[str, ...], str, str]] = {
    "reference": (("marker", "axis"), "px", "mean position in the rest frames"),
    "rest_noise": (("marker", "axis"), "px", "standard deviation of the position at rest"),
    "radius": (("marker",), "px", "radius of the markers at rest"),
    "frame_state": (("time",), "", ", ".join(f"{number} {state}" for number, state in enumerate(STATES))),
    "still": (("marker",), "", "1 where a marker does not move with its neighbours"),
    "visible": (("time",), "", "markers that were seen, and blobs like them that no marker has"),
    "image_position": (("time", "marker", "axis"), "px", "position in the frames, with the lens's distortion"),
}


def lens_of(calibration: Pinhole | Fisheye | str | Path | None, frames: Frames) -> Pinhole | Fisheye | None:
    """Return the lens of a camera; that of a file has to be for frames of their size."""
    if not isinstance(calibration, str | Path):
        return calibration
    height, width = next(iter(frames.read())).shape
    return read_calibration(calibration, size=(width, height))


def follow_video(frames: Frames, tracker: MarkerTracker) -> tuple[list[SeenMarkers], str]:
    """Return what a tracker sees in all frames, of which few are in memory at a time, and why there are no more."""
    rows: list[SeenMarkers] = []
    try:
        for number, frame in enumerate(frames.read()):
            rows += tracker.take(frame, number / frames.frame_rate)
        rows += tracker.begin()
    except FingerslipError as error:
        if not rows:
            raise
        return rows, str(error)
    return rows, ""


def tracks_of(
    tracker: MarkerTracker,
    rows: Sequence[SeenMarkers],
    frame_rate: float,
    lens: Pinhole | Fisheye | None = None,
    broken: str = "",
    *,
    rest_frames: int | None = None,
) -> xr.Dataset:
    """Return what a tracker saw in all frames as tracks, with what is wrong with them and why they may be `broken`.

    Without their number the rest frames are those of the tracker in which the markers rest.
    """
    reference = tracker.reference
    image_position = np.array([row.position for row in rows], dtype=np.float64)
    position = image_position if lens is None else undistort_pixels(lens, image_position)
    rest = min(rest_frames or min(rest_length(position), tracker.rest_frames), len(rows))
    tracks = make_tracks(
        position,
        [row.time for row in rows],
        units="px",
        quality=np.array([row.quality for row in rows], dtype=np.float64),
        ring=reference.ring,
        angle=reference.angle,
        attributes={
            "image_width": tracker.shape[1],
            "image_height": tracker.shape[0],
            "frame_rate": frame_rate,
            "source": tracker.name,
            "rest_frames": rest,
            "layout": reference.layout,
            "bright": int(reference.markers.polarity > 0),
            "partial": int(bool(broken or reference.warnings)),
            "warnings": "\n".join([*reference.warnings, *_complaints(tracker, rows, position, rest, broken)]),
        },
    )
    values = {
        "radius": reference.markers.radius,
        "frame_state": np.array([row.state for row in rows], dtype=np.int8),
        "visible": np.array([row.visible for row in rows], dtype=np.int32),
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of markers that were not seen at rest
        values["reference"] = np.nanmean(position[:rest], axis=0)
        values["rest_noise"] = np.nanstd(position[:rest], axis=0, ddof=1)
    values["still"] = still_markers(position).astype(np.int8)
    if lens is not None:
        values["image_position"] = image_position
    for name, array in values.items():
        dims, unit, meaning = _OF_VIDEOS[name]
        tracks[name] = (dims, array, {"units": unit, "long_name": meaning} if unit else {"long_name": meaning})
    return tracks


def _complaints(
    tracker: MarkerTracker, rows: Sequence[SeenMarkers], position: Floats, rest: int, broken: str
) -> Iterator[str]:
    """Yield what is wrong with the frames, of which so many are those at rest."""
    states = np.array([row.state for row in rows], dtype=np.int8)
    name, light, count, rest_frames = tracker.name, tracker.exposure, len(states), tracker.rest_frames
    if broken:
        yield f"{broken}; the tracks are those of the first {count} frames"
    elif rest == count < rest_frames:
        yield f"{name}: ends within the {rest_frames} rest frames, after {count}; all are the reference"
    # Frames are only compared with the light at rest.
    if light.mean < _DARK:
        yield f"{name}: is dark, mean grey level {light.mean:.0f} of 255 at rest; noise is large: add light or exposure"
    if light.saturated > _SATURATED:
        yield f"{name}: is overexposed, {100 * light.saturated:.0f} % of the pixels are saturated at rest; less light"
    for number, state in enumerate(STATES):
        which = np.flatnonzero(states == number)
        if number and which.size:
            yield f"{name}: {which.size} of {count} frames are {state}, the first is frame {which[0]}"
    yield from _doubts(tracker, rows, position, rest)
    visible, followed = float(np.median([row.visible for row in rows])), position.shape[1]
    if visible > _MORE * followed:
        yield f"{name}: {followed} markers are followed, where {visible:.0f} blobs like them are visible in most frames"
    moved = _moved_at_rest(position[:rest])
    if moved > _MOVED:
        still = rest_length(position)
        repair = f"it rests in {still}: --rest {still}" if FEWEST < still < rest else "let it rest before it moves"
        fault = f"the sensor moved by {moved:.1f} px in the {rest} rest frames; the reference is no rest"
        yield f"{name}: {fault}; {repair}"


def _doubts(tracker: MarkerTracker, rows: Sequence[SeenMarkers], position: Floats, rest: int) -> Iterator[str]:
    """Yield which markers are lost or may be others, and where blobs have none."""
    name, markers, unseen = tracker.name, tracker.reference.markers, np.asarray(np.isnan(position).any(axis=2))
    fit = float(np.median(markers.quality))
    if tracker.reference.layout == "free" and fit < _ROUND:
        fault = (
            f"the points are in no pattern and fit round markers by {fit:.2f}, those of recorded sensors by over 0.92"
        )
        yield f"{name}: {fault}; they may be a texture"
    often = int(((unseen.mean(axis=0) > _OFTEN) | unseen[-FEWEST:].all(axis=0)).sum())
    if often:
        lost = "not seen in more than a tenth of the frames or at the end"
        yield f"{name}: {often} of {position.shape[1]} markers were {lost}"
    without = np.array([row.visible for row in rows]) - (~unseen).sum(axis=1)
    more = without > without[:rest].max()
    if more.mean() > _WITHOUT:
        blobs = f"up to {without.max()} blobs like markers are visible that no marker has"
        yield f"{name}: in {more.sum()} of {len(rows)} frames {blobs}, the first is frame {np.argmax(more)}"
    # Where markers leave their neighbours from frame to frame, or touch another one.
    unsure = np.zeros(position.shape[:2], dtype=bool)
    unsure[1:] = _steps_alone(position, markers.neighbours) > _LEAP * markers.spacing
    for frame, here in zip(unsure, position, strict=True):
        seen_here = np.flatnonzero(np.isfinite(here[:, 0]))
        pairs = cKDTree(here[seen_here]).query_pairs(2.0 * float(np.median(markers.radius)), output_type="ndarray")
        frame[seen_here[pairs]] = True
    if unsure.any():
        leaping = f"{unsure.any(axis=0).sum()} of {position.shape[1]} markers leap past their neighbours or touch"
        first = rows[int(np.argmax(unsure.any(axis=1)))].time
        yield f"{name}: {leaping}, from {first:.2f} s on; who is who is less sure then"


def _moved_at_rest(position: Floats) -> float:
    """Return how far the markers (n_frames, n_markers, 2) move together, in the frames that show half of them."""
    visible = np.isfinite(position).all(axis=2)
    positions = position[visible.mean(axis=1) > 0.5][:, visible.any(axis=0)]
    if len(positions) <= 1:
        return 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of markers that no such frame shows
        middles = np.nanmedian(positions - np.nanmean(positions, axis=0), axis=1)
    return float(np.linalg.norm(np.ptp(middles, axis=0)))


@dataclass(frozen=True)
class Lost:
    """An interval in which a marker was not seen."""

    marker: int  # number of the marker
    first: int  # first frame without it
    last: int  # last frame without it
    returned: bool  # whether it was seen again

    @property
    def frames(self) -> int:
        """How many frames it lasted."""
        return self.last - self.first + 1


def seen_count(tracks: xr.Dataset) -> NDArray[np.intp]:
    """Return how many markers were seen in each frame, shape (n_times,)."""
    return np.asarray(seen(tracks).sum(axis=1))


def seen_share(tracks: xr.Dataset) -> float:
    """Return the share of all marker-frames that have a position, of those that were visible where it is more."""
    count = np.full(tracks.sizes["time"], tracks.sizes["marker"])
    visible = np.maximum(count, tracks["visible"].values) if "visible" in tracks else count
    return float(seen(tracks).sum() / visible.sum())


def lost_intervals(tracks: xr.Dataset) -> list[Lost]:
    """Return every interval in which a marker was not seen, by marker and time."""
    gone = ~seen(tracks)
    # A frame on either side in which all are seen makes every interval begin and end.
    edges = np.diff(np.pad(gone, ((1, 1), (0, 0))).astype(np.int8), axis=0)
    intervals = []
    for column, number in enumerate(tracks["marker"].values):
        first, behind = np.flatnonzero(edges[:, column] == 1), np.flatnonzero(edges[:, column] == -1)
        intervals += [
            Lost(int(number), int(a), int(b) - 1, bool(b < len(gone))) for a, b in zip(first, behind, strict=True)
        ]
    return intervals


def noise_at_rest(tracks: xr.Dataset) -> Floats:
    """Return the standard deviation of each marker in the rest frames, the root mean square of both axes, (n,) [px]."""
    return np.asarray(np.sqrt((tracks["rest_noise"].values ** 2).mean(axis=1)))


def jumps(tracks: xr.Dataset) -> Floats:
    """Return how far markers moved between frames beyond what their neighbours did [px], (n_times - 1, n_markers)."""
    position = tracks["position"].values
    # Markers that were not seen at rest have no neighbours by their reference: their place is far away.
    reference = np.where(np.isfinite(tracks["reference"].values), tracks["reference"].values, 1e6)
    neighbours, _ = nearest_neighbours(reference)
    return _steps_alone(position, neighbours)


def _steps_alone(position: Floats, neighbours: NDArray[np.intp]) -> Floats:
    """Return by how much steps of markers (n_times, n, 2) [px] differ from those of neighbours, (n_times - 1, n)."""
    visible = np.asarray(np.isfinite(position).all(axis=2))
    out = np.full((max(len(position) - 1, 0), position.shape[1]), np.nan)
    for t in range(len(out)):
        both = visible[t] & visible[t + 1]
        step = np.where(both[:, None], position[t + 1] - position[t], 0.0)
        expected, counts = expected_displacement(step, both, neighbours)
        determined = both & (counts > 2)
        out[t, determined] = np.linalg.norm(step - expected, axis=1)[determined]
    return out


FEWEST = 5  # frames and markers without which there is no rest and no pattern
# Rest ends where markers leave it by so many times their noise, and by this share of the distance between them.
STIRRED, _STIR = 3.0, 0.02
# Neighbours have to move by so many pixels, and a reflection moves by less than this share of what they do. On four
# real clips markers at the clamped rim move by half as much as their neighbours and more.
_MOVING, _STILL = 3.0, 0.4
_LARGEST = 90  # percentile of the displacements in all frames: a few wrong ones do not count


def rest_length(position: Floats) -> int:
    """Return in how many of the first frames the markers (n_frames, n_markers, 2) rest, as they do in five or more."""
    at_rest: Floats = np.ma.masked_invalid(position[:FEWEST]).mean(axis=0).filled(np.nan)
    is_seen = np.isfinite(at_rest).all(axis=1)
    if len(position) <= FEWEST or is_seen.sum() < FEWEST:
        return len(position)
    spacing = float(np.median(nearest_neighbours(at_rest[is_seen])[1]))
    stirred = np.sqrt(np.ma.masked_invalid(((position - at_rest) ** 2).sum(axis=2)).mean(axis=1))
    limit = max(STIRRED * float(stirred[:FEWEST].mean()), _STIR * spacing)
    later = np.flatnonzero((stirred[FEWEST:] > limit).filled(False))
    return max(FEWEST, FEWEST + int(later[0]) - 2) if later.size else len(position)


def still_markers(position: Floats) -> Flags:
    """Tell which markers (n_markers,) do not move with their neighbours, as reflections and dirt on the lens do.

    Motion of positions (n_frames, n_markers, 2) [px] counts from where they rest, whatever reference the tracks have.
    """
    reference: Floats = np.ma.masked_invalid(position[: rest_length(position)]).mean(axis=0).filled(np.nan)
    return lagging_markers(reference, position - reference, _MOVING)


def lagging_markers(reference: Floats, displacement: Floats, least: float) -> Flags:
    """Tell which markers (n,) stay while their neighbours are displaced by at least so much.

    Arrays: reference (n, 2), displacement (n_frames, n, 2).
    """
    still = np.zeros(len(reference), dtype=bool)
    seen_at_rest = np.isfinite(reference).all(axis=1)
    moved = _largest(displacement)
    while True:
        # Reflections have reflections beside them, so those that are found are neighbours no more.
        chosen = np.flatnonzero(seen_at_rest & ~still)
        if len(chosen) < FEWEST:
            return still
        neighbours = nearest_neighbours(reference[chosen])[0]
        frames = displacement[:, chosen]
        expected = [expected_displacement(each, np.isfinite(each).all(axis=1), neighbours)[0] for each in frames]
        of_neighbours = _largest(np.stack(expected))
        lagging = (of_neighbours > least) & (moved[chosen] < _STILL * of_neighbours)
        if not lagging.any():
            return still
        still[chosen[lagging]] = True


def _largest(displacement: Floats) -> Floats:
    """Return how far displacements (n_frames, n, 2) go in all but a few frames, (n,)."""
    lengths = np.linalg.norm(displacement, axis=2)
    whole, seen = np.isfinite(lengths).all(axis=0), np.isfinite(lengths).any(axis=0)
    largest = np.zeros(len(seen))
    largest[whole] = np.percentile(lengths[:, whole], _LARGEST, axis=0)  # much faster than where there are gaps
    largest[seen & ~whole] = np.nanpercentile(lengths[:, seen & ~whole], _LARGEST, axis=0)
    return largest
