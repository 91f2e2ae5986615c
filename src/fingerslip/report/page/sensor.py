"""What a report adds for sensors and fingers with markers: where these are, how they move, and what cameras saw."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.history import sites_of_kinds
from fingerslip.marker_tracks import marker_tracks
from fingerslip.report.figures.film import frames_figure, slip_order_figure
from fingerslip.report.figures.markers import count_figure, fields_figure, jump_figure, noise_figure
from fingerslip.report.figures.sensor import marker_places_figure, slide_tracks_figure
from fingerslip.report.figures.style import save_figure
from fingerslip.report.page.content import ReportContent
from fingerslip.report.page.films import Film
from fingerslip.report.page.page import Picture, Report, ReportSection, write_page
from fingerslip.report.page.pictures import RunToDraw
from fingerslip.slip import slide_window
from fingerslip.slip.skin_markers import touching_markers
from fingerslip.storage.files import check_replaceable, new_folder, write_bytes
from fingerslip.tables.table import Column, Table
from fingerslip.version import __version__
from fingerslip.vision.overlay import SHOWN_FIELDS, field_frames, overlay_frames
from fingerslip.vision.tables import write_tracks_csv
from fingerslip.vision.tracking.track import jumps, lost_intervals, noise_at_rest, seen_count, seen_share
from fingerslip.vision.tracks import write_tracks
from fingerslip.vision.video import STATES, Frames, write_video

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "cameras_section",
    "has_markers",
    "marker_pictures",
    "place_pictures",
    "quality_report",
    "write_tracking",
]


_KINDS = ("internal marker", "external marker")
_SAID = (
    "Every camera filmed the markers of a run, and the tracker followed them without knowing where they were. The "
    "internal camera is fixed to the sensor; the external one goes with the plate, so that a marker that sticks stands "
    "still in its image. 'kept' is the share of the marker-frames within 1 px of the truth, 'swapped' counts those "
    "nearer to another marker."
)


def has_markers(history: xr.Dataset) -> bool:
    """Tell whether markers were recorded."""
    return sites_of_kinds(history, _KINDS).size > 0


def place_pictures(run: RunToDraw) -> list[Picture]:
    """Return the picture of the markers at rest; none without markers."""
    if not has_markers(run.history):
        return []
    said = f"Markers at rest, from inside and from below: {run.title}."
    return [Picture(f"markers-{run.name}", said, marker_places_figure(marker_tracks(run.history), run.title))]


def marker_pictures(run: RunToDraw) -> list[Picture]:
    """Return the picture of the markers in the slide; none without markers or slide."""
    if not has_markers(run.history) or slide_window(run.history) is None:
        return []
    said = "How far each marker moves along the slide, coloured by ring; dashed are those at x < 0."
    figure = slide_tracks_figure(marker_tracks(run.history), run.history, run.title)
    return [Picture(f"{run.name}-markers", said, figure)]


def cameras_section(content: ReportContent) -> ReportSection:
    """Return the section on what cameras saw; empty without films."""
    pictures = [picture for film in content.films for picture in _film_pictures(content, film)]
    tables = (_errors_table(content.films),) if content.films else ()
    return ReportSection("Cameras", (_SAID,) if content.films else (), tables, tuple(pictures))


def _errors_table(films: Sequence[Film]) -> Table:
    columns = (
        Column("run"),
        Column("camera"),
        Column("frames"),
        Column("markers"),
        Column("error, rms", "px", digits=4),
        Column("largest error", "px", digits=3),
        Column("kept", "%", digits=2),
        Column("swapped"),
    )
    rows = tuple((film.run, film.kind, *_numbers(film)) for film in films)
    return Table("Tracks beside the truth", columns, rows)


def _numbers(film: Film) -> tuple[float | int | None, ...]:
    own = film.numbers
    kept = None if own["kept"] is None else 100.0 * own["kept"]
    return own["frames"], own["markers"], own["rms"], own["largest"], kept, own["swapped"]


def _film_pictures(content: ReportContent, film: Film) -> list[Picture]:
    if film.run not in content.histories:
        return []
    history, title = content.histories[film.run], f"{content.titles[film.run]}, {film.kind} camera"
    name, pictures = f"{film.run}-{film.kind}-camera", []
    if film.frames and history.sizes.get("snapshot_time", 0):
        said = "Frames of the camera above the computed body at the snapshot nearest in time."
        pictures.append(Picture(name, said, frames_figure(history, film.frames, title)))
    window = slide_window(history)
    if film.kind == "external" and window is not None and (touching := touching_markers(history)).any():
        said = "Markers of the skin in the image, coloured by their distance from the central one, and when each slips."
        figure = slip_order_figure(film.tracks, window.start, np.asarray(touching), title)
        pictures.append(Picture(f"{name}-order", said, figure))
    return pictures


_LONGEST_LIST = 40
_TRACKS = "tracks.nc"


def write_tracking(tracks: xr.Dataset, frames: Frames, folder: str | Path, *, fields: xr.Dataset | None = None) -> Path:
    """Write tracks and what shows their quality to a folder, whole or not at all."""
    final = Path(folder)
    check_replaceable(final, _TRACKS)
    with new_folder(final) as partial:
        write_tracks(tracks, partial / _TRACKS)
        write_tracks_csv(tracks, partial / "tracks.csv")
        # Tracks of a truncated video end before the frames do, or with them.
        shown = itertools.islice(frames.read(), tracks.sizes["time"])
        write_video(partial / "overlay.avi", overlay_frames(shown, _in_the_image(tracks)), frames.frame_rate)
        first = next(iter(frames.read()))
        write_page(quality_report(tracks, first), partial / "quality.html")
        if fields is not None:
            _write_fields(fields, _in_the_image(tracks), frames, partial)
    return final


def _write_fields(fields: xr.Dataset, tracks: xr.Dataset, frames: Frames, folder: Path) -> None:
    """Write fields, a picture, and videos with the fields at the places of tracks in the image."""
    write_bytes(folder / "fields.nc", bytes(fields.to_netcdf(engine="h5netcdf")))
    left = np.nan_to_num(fields["rigid_residual_rms"].values)
    save_figure(fields_figure(fields, float(fields["time"][int(left.argmax())])), folder / "fields.png")
    placed = fields.assign(position=tracks["position"])
    for name in SHOWN_FIELDS:
        shown = itertools.islice(frames.read(), tracks.sizes["time"])
        write_video(folder / f"{name}.avi", field_frames(shown, placed, name), frames.frame_rate)


def _in_the_image(tracks: xr.Dataset) -> xr.Dataset:
    """Return tracks at the pixels of the video, from before the calibration."""
    if "image_position" not in tracks:
        return tracks
    return tracks.assign(position=tracks["image_position"].assign_attrs(tracks["position"].attrs))


def quality_report(tracks: xr.Dataset, frame: NDArray[np.uint8] | None = None) -> Report:
    """Return the page on the quality of tracks.

    Arrays: frame (height, width).
    """
    warnings = tuple(filter(None, str(tracks.attrs.get("warnings", "")).split("\n")))
    if tracks.attrs.get("partial"):
        warnings = ("These tracks are partial.", *warnings)
    pictures = (
        Picture("count", "Markers seen over time, and the intervals in which markers were lost.", count_figure(tracks)),
        Picture("noise", "Markers at rest with their numbers, coloured by their noise.", noise_figure(tracks, frame)),
        Picture("jumps", "A swap of identities would stand far to the right.", jump_figure(tracks)),
    )
    sections = (
        ReportSection("Summary", (), (_summary(tracks),), warnings=warnings),
        ReportSection("Markers over time", pictures=pictures[:1]),
        ReportSection("Noise at rest", pictures=pictures[1:2]),
        ReportSection("Jumps", pictures=pictures[2:]),
        ReportSection("Lost markers", tables=(_lost(tracks),)),
    )
    source = str(tracks.attrs.get("source", ""))
    return Report(f"Tracks of {Path(source).name}", sections, {"fingerslip": __version__, "source": source})


def _summary(tracks: xr.Dataset) -> Table:
    count, noise, jumped = seen_count(tracks), noise_at_rest(tracks), jumps(tracks)
    states = [f"{int((tracks['frame_state'] == n).sum())} {name}" for n, name in enumerate(STATES) if n]
    known = noise[np.isfinite(noise)]
    rows = (
        ("frames", tracks.sizes["time"], ""),
        ("frame rate", float(tracks.attrs["frame_rate"]), "1/s"),
        ("markers", tracks.sizes["marker"], ""),
        ("fewest markers in a frame", int(count.min()), ""),
        ("marker-frames with a position", 100.0 * seen_share(tracks), "%"),
        ("intervals in which a marker was lost", len(lost_intervals(tracks)), ""),
        ("mean quality", float(tracks["quality"].mean()), ""),
        ("median noise at rest", float(np.median(known)) if known.size else None, "px"),
        ("largest noise at rest", float(known.max()) if known.size else None, "px"),
        ("largest jump", float(np.nanmax(jumped)) if np.isfinite(jumped).any() else None, "px"),
        ("frames marked", ", ".join(states), ""),
    )
    return Table("", (Column("what"), Column("value", significant=5), Column("unit")), rows)


def _lost(tracks: xr.Dataset) -> Table:
    longest = sorted(lost_intervals(tracks), key=lambda one: -one.frames)
    time = tracks["time"].values
    rows = tuple(
        (one.marker, float(time[one.first]), float(time[one.last]), one.frames, one.returned)
        for one in longest[:_LONGEST_LIST]
    )
    columns = (
        Column("marker"),
        Column("from", "s", digits=3),
        Column("to", "s", digits=3),
        Column("frames"),
        Column("found again"),
    )
    note = f"The longest {_LONGEST_LIST} of {len(longest)}." if len(longest) > _LONGEST_LIST else ""
    return Table("" if rows else "No marker was lost", columns, rows, note)
