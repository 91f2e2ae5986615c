"""What a report adds for sensors and fingers with markers: where these are, how they move, and what cameras saw."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fingerslip.history import sites_of_kinds
from fingerslip.marker_tracks import marker_tracks
from fingerslip.report.figures.filming import frames_figure, slip_order_figure
from fingerslip.report.figures.sensor import marker_places_figure, slide_tracks_figure
from fingerslip.report.page.content import ReportContent
from fingerslip.report.page.films import Film
from fingerslip.report.page.page import Picture, ReportSection
from fingerslip.report.page.pictures import RunToDraw
from fingerslip.report.tables.table import Column, Table
from fingerslip.slip import slide_window
from fingerslip.slip.skin_markers import touching_markers

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["cameras_section", "has_markers", "marker_pictures", "place_pictures"]

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
