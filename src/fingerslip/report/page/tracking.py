"""A folder of tracks: netCDF, CSV, the overlay video and one page on their quality."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.files import check_replaceable, new_folder, write_bytes
from fingerslip.report.figures.markers import fields_figure
from fingerslip.report.figures.save import save_figure
from fingerslip.report.figures.tracking import count_figure, jump_figure, noise_figure
from fingerslip.report.page.page import Picture, Report, ReportSection, write_page
from fingerslip.report.tables.table import Column, Table
from fingerslip.version import __version__
from fingerslip.vision.exposure import STATES
from fingerslip.vision.fields.overlay import SHOWN_FIELDS, field_frames
from fingerslip.vision.overlay import overlay_frames
from fingerslip.vision.tables import write_tracks_csv
from fingerslip.vision.tracking.frames import Frames
from fingerslip.vision.tracking.quality import jumps, lost_intervals, noise_at_rest, seen_count, seen_share
from fingerslip.vision.tracks import write_tracks
from fingerslip.vision.video import write_video

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["quality_report", "write_tracking"]

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
