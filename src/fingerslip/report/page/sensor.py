"""What a page shows of markers: what the cameras of a study saw, and how good the tracks of a video are."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.errors import FingerslipError
from fingerslip.report.content import Film, ReportContent
from fingerslip.report.figures import markers
from fingerslip.report.figures.style import save_figure
from fingerslip.report.labels import prose
from fingerslip.report.page.page import Picture, Report, ReportSection, write_page
from fingerslip.slip import slide_window
from fingerslip.slip.front import touching_markers
from fingerslip.storage.files import check_replaceable, new_folder, write_bytes
from fingerslip.tables.table import Column, Table
from fingerslip.version import __version__
from fingerslip.vision.overlay import SHOWN_FIELDS, field_frames, overlay_frames
from fingerslip.vision.tracking.track import jumps, lost_intervals, noise_at_rest, seen_count, seen_share
from fingerslip.vision.tracks import read_tracks, write_tracks, write_tracks_csv
from fingerslip.vision.video import STATES, Frames, write_video


def cameras_section(content: ReportContent) -> ReportSection:
    """Return the section on what cameras saw."""
    pixels = (Column("error, rms", "px", digits=4), Column("largest error", "px", digits=3))
    names = ("frames", "markers", "rms", "largest", "kept", "swapped")
    columns = (*map(Column, ("run", "camera", *names[:2])), *pixels, Column("kept", "%", digits=2), Column("swapped"))
    rows = []
    for film in content.films:
        share = film.numbers["kept"]
        numbers = {**film.numbers, "kept": None if share is None else 100.0 * share}
        rows.append((film.run, film.kind, *(numbers[name] for name in names)))
    table = Table("Tracks beside the truth", columns, tuple(rows))
    pictures = [picture for film in content.films for picture in _film_pictures(content, film)]
    return ReportSection("Cameras", (prose("sections", "cameras"),), (table,), tuple(pictures))


def _film_pictures(content: ReportContent, film: Film) -> Iterator[Picture]:
    if film.run not in content.histories:
        return
    history, title = content.histories[film.run], f"{content.titles[film.run]}, {film.kind} camera"
    name, window = f"{film.run}-{film.kind}-camera", slide_window(history)
    if film.frames and history.sizes.get("snapshot_time", 0):
        yield Picture(name, prose("captions", "camera-frames"), markers.frames_figure(history, film.frames, title))
    if film.kind == "external" and window is not None and (touching := touching_markers(history)).any():
        figure = markers.slip_order_figure(film.tracks, window.start, np.asarray(touching), title)
        yield Picture(f"{name}-order", prose("captions", "camera-order"), figure)


_LONGEST_LIST = 40
_TRACKS = "tracks.nc"


def source_of_tracking(folder: Path) -> str:
    """Return of which video a folder has the tracks; empty where that is not known."""
    try:
        return str(read_tracks(folder / _TRACKS).attrs.get("source", ""))
    except (OSError, FingerslipError):
        return ""


def write_tracking(tracks: xr.Dataset, frames: Frames, folder: str | Path, *, fields: xr.Dataset | None = None) -> Path:
    """Write tracks and what shows their quality to a folder, whole or not at all."""
    final = Path(folder)
    check_replaceable(final, _TRACKS)
    with new_folder(final) as partial:
        write_tracks(tracks, partial / _TRACKS)
        write_tracks_csv(tracks, partial / "tracks.csv")
        placed = tracks
        if "image_position" in tracks:
            # The pixels of the video, from before the calibration.
            placed = tracks.assign(position=tracks["image_position"].assign_attrs(tracks["position"].attrs))
        # Tracks of a truncated video end before the frames do, or with them.
        seen = itertools.islice(frames.read(), tracks.sizes["time"])
        write_video(partial / "overlay.avi", overlay_frames(seen, placed), frames.frame_rate)
        write_page(quality_report(tracks, next(iter(frames.read()))), partial / "quality.html")
        if fields is not None:
            write_bytes(partial / "fields.nc", bytes(fields.to_netcdf(engine="h5netcdf")))
            time = float(fields["time"][int(np.nan_to_num(fields["rigid_residual_rms"].values).argmax())])
            save_figure(markers.fields_figure(fields, time), partial / "fields.png")
            # Videos with the fields at the places of tracks in the image.
            on_image = fields.assign(position=placed["position"])
            for name in SHOWN_FIELDS:
                seen = itertools.islice(frames.read(), tracks.sizes["time"])
                write_video(partial / f"{name}.avi", field_frames(seen, on_image, name), frames.frame_rate)
    return final


def quality_report(tracks: xr.Dataset, frame: NDArray[np.uint8] | None = None) -> Report:
    """Return the page on the quality of tracks, with a frame (height, width) of the video."""
    warnings = tuple(filter(None, str(tracks.attrs.get("warnings", "")).split("\n")))
    if tracks.attrs.get("partial"):
        warnings = ("These tracks are partial.", *warnings)
    pictures = {
        "Markers over time": Picture("count", prose("captions", "seen"), markers.count_figure(tracks)),
        "Noise at rest": Picture("noise", prose("captions", "noise"), markers.noise_figure(tracks, frame)),
        "Jumps": Picture("jumps", prose("captions", "jumps"), markers.jump_figure(tracks)),
    }
    sections = (
        ReportSection("Summary", (), (_summary(tracks),), warnings=warnings),
        *(ReportSection(title, pictures=(picture,)) for title, picture in pictures.items()),
        ReportSection("Lost markers", tables=(_lost(tracks),)),
    )
    source = str(tracks.attrs.get("source", ""))
    return Report(f"Tracks of {Path(source).name}", sections, {"fingerslip": __version__, "source": source})


def _summary(tracks: xr.Dataset) -> Table:
    count, noise, jumped = seen_count(tracks), noise_at_rest(tracks), jumps(tracks)
    states = [f"{int((tracks['frame_state'] == n).sum())} {name}" for n, name in enumerate(STATES) if n]
    noise, still = noise[np.isfinite(noise)], int(tracks["still"].sum()) if "still" in tracks else None
    rows = (
        ("frames", tracks.sizes["time"], ""),
        ("frame rate", float(tracks.attrs["frame_rate"]), "1/s"),
        ("markers", tracks.sizes["marker"], ""),
        ("markers that do not move with their neighbours", still, ""),
        ("fewest markers in a frame", int(count.min()), ""),
        (
            "marker-frames with a position, of followed markers",
            100.0 * float(count.mean()) / tracks.sizes["marker"],
            "%",
        ),
        ("the same, of all visible markers", 100.0 * seen_share(tracks), "%"),
        ("intervals in which a marker was lost", len(lost_intervals(tracks)), ""),
        ("mean quality", float(tracks["quality"].mean()), ""),
        ("median noise at rest", float(np.median(noise)) if noise.size else None, "px"),
        ("largest noise at rest", float(noise.max()) if noise.size else None, "px"),
        ("largest jump", float(np.nanmax(jumped)) if np.isfinite(jumped).any() else None, "px"),
        ("frames marked", ", ".join(states), ""),
    )
    return Table("", (Column("what"), Column("value", significant=5), Column("unit")), rows)


def _lost(tracks: xr.Dataset) -> Table:
    longest, time = sorted(lost_intervals(tracks), key=lambda lost: -lost.frames), tracks["time"].values
    rows = tuple(
        (lost.marker, float(time[lost.first]), float(time[lost.last]), lost.frames, lost.returned)
        for lost in longest[:_LONGEST_LIST]
    )
    times = (Column("from", "s", digits=3), Column("to", "s", digits=3))
    columns = (Column("marker"), *times, Column("frames"), Column("found again"))
    note = f"The longest {_LONGEST_LIST} of {len(longest)}." if len(longest) > _LONGEST_LIST else ""
    return Table("" if rows else "No marker was lost", columns, rows, note)
