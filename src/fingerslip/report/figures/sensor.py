"""Figures of an optical sensor: its markers from inside and from below, how they move, and what its cameras see."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingerslip.history import is_solid, nearest_snapshot
from fingerslip.report.colours import BLACK, GREY
from fingerslip.report.figures.deformed import crop
from fingerslip.report.figures.markers import centre_last, ring_colours, ring_keys
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, say, show_picture, with_style
from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import slide_window

Floats = NDArray[np.float64]

_TITLES = {"internal": "internal markers, from inside", "external": "external markers, from below"}
_MILLIMETRES = 1e3


@with_style
def marker_places_figure(tracks: xr.Dataset, title: str = "") -> Figure:
    """Draw where the markers of tracks [m] are at rest, coloured by ring: inside ones from above, others from below."""
    kinds = [kind for kind in _TITLES if (tracks["kind"].values == kind).any()]
    rest = _MILLIMETRES * tracks["position"].values[0]
    across = rest[:, 2] if rest.shape[1] == 3 else np.zeros(len(rest))
    labels, heading = ("x, along the slide [mm]", "z, across [mm]"), join_title("Markers at rest", title)
    figure, panels = figure_grid(len(kinds), 2, (3.6, 3.2), heading, labels, share="none")
    colours = ring_colours(int(tracks["ring"].values.max(initial=0)) + 1)
    for axes, kind in zip(panels, kinds, strict=True):
        rows = np.flatnonzero(tracks["kind"].values == kind)
        axes.scatter(rest[rows, 0], across[rows], s=16, c=[colours[ring] for ring in tracks["ring"].values[rows]])
        axes.set_title(f"{rows.size} {_TITLES[kind]}")
        axes.set_aspect("equal", adjustable="datalim")
        if kind == "internal":
            # As the internal camera sees them: x to the right, z downwards.
            axes.invert_yaxis()
    add_legend(figure, ring_keys(tracks["ring"].values))
    return figure


@with_style
def slide_tracks_figure(tracks: xr.Dataset, history: xr.Dataset, title: str = "") -> Figure:
    """Draw how far markers [m] move along the first slide, coloured by ring, over the travel of the plate."""
    window = slide_window(history)
    if window is None:
        raise ValueError("the history has no slide")
    plate = history["counterface_displacement"].values[window.records, 0]
    direction = (plate[-1] - plate[0]) / np.linalg.norm(plate[-1] - plate[0])
    travel = _MILLIMETRES * (plate - plate[0]) @ direction
    positions = tracks["position"].values[window.records]
    along = _MILLIMETRES * (positions - positions[0]) @ direction
    kinds = [kind for kind in _TITLES if (tracks["kind"].values == kind).any()]
    labels, heading = ("travel of the plate [mm]", "displacement along the slide [mm]"), "Markers in the slide"
    figure, panels = figure_grid(len(kinds), 2, (4.2, 3.0), join_title(heading, title), labels, share="x")
    rings, start = tracks["ring"].values, tracks["position"].values[0, :, 0]
    for axes, kind in zip(panels, kinds, strict=True):
        rows = np.flatnonzero(tracks["kind"].values == kind)
        colours = ring_colours(int(rings[rows].max(initial=0)) + 1)
        for marker in rows[centre_last(rings[rows])]:
            style = "-" if start[marker] >= -1e-9 else "--"
            axes.plot(travel, along[:, marker], style, color=colours[int(rings[marker])], linewidth=0.9)
        axes.plot(travel, travel, ":", color="0.5", linewidth=0.8)
        low, high = float(np.nanmin(along[:, rows])), float(np.nanmax(along[:, rows]))
        room = 0.06 * max(high - low, 1e-3)
        axes.set_ylim(low - room, high + room)
        axes.set_title(f"{kind} markers")
    add_legend(figure, ring_keys(rings))
    return figure


#: Distance in the image from where a marker was when the slide began, from which on it counts as slipping [px].
MOVED = 1.0
_PANELS = 4
_SIZE = (960, 660)
_REFERENCE = 5  # frames before the slide whose mean is where markers were
_PANEL = (2.7, 2.1)


def film_times(start: float, end: float, first: float) -> tuple[float, ...]:
    """Return the times of the frames that a report shows [s]: at rest, at the start of the slide, in it, at its end."""
    return (first, start, start + (end - start) / 3.0, end)


@with_style
def frames_figure(history: xr.Dataset, frames: Mapping[float, NDArray[np.uint8]], title: str = "") -> Figure:
    """Draw frames (height, width) of a camera, by their times [s], above the body at the snapshots nearest in time."""
    times = list(frames)[:_PANELS]
    heading = join_title("What the camera sees, and the body at that time", title)
    figure, panels = figure_grid(2 * len(times), len(times), _PANEL, heading, ("", ""), share="none")
    numbers = [nearest_snapshot(history, max(time, 0.0)) for time in times]
    options = SceneOptions(scalar="region", cut="z" if is_solid(history) else "none", camera="side", written=False)
    bodies = crop(stills(history, numbers, options, _SIZE))
    for number, time in enumerate(times):
        above, below = panels[number], panels[len(times) + number]
        above.imshow(frames[time], cmap="gray", vmin=0, vmax=255)
        above.set_title("frame at rest" if time < 0.0 else f"frame at {time:.2f} s")
        above.set_axis_off()
        show_picture(below, bodies[number], f"snapshot at {float(history['snapshot_time'][numbers[number]]):.2f} s")
    return figure


def onsets(tracks: xr.Dataset, start: float) -> tuple[Floats, Floats]:
    """Return when each marker starts to move in the image, and how far it is from the middle one.

    Tracks [px] are those of a camera that goes with the plate, in which a marker that sticks stands still. Times (n,)
    count from the start of the slide [s], NaN for a marker that never is more than `MOVED` from where it was; distances
    (n,) are those from the marker of ring 0 at the start [px].
    """
    times, position = tracks["time"].values, tracks["position"].values
    first = int(np.searchsorted(times, start - 1e-9))
    before = np.nanmean(position[max(first - _REFERENCE, 0) : first + 1], axis=0)
    away = np.linalg.norm(position[first:] - before, axis=2) > MOVED
    onset_times = np.where(away.any(axis=0), times[first + away.argmax(axis=0)] - start, np.nan)
    centre = before[int(np.argmin(tracks["ring"].values))]
    return onset_times, np.linalg.norm(before - centre, axis=1)


@with_style
def slip_order_figure(tracks: xr.Dataset, start: float, touching: NDArray[np.bool_], title: str = "") -> Figure:
    """Draw how the touching markers of the skin move in the image of the external camera, and when each starts to."""
    labels = ("time since the slide began [s]", "")
    heading = join_title("Order of slip, seen through the plate", title)
    figure, (moved, where) = figure_grid(2, 2, (4.2, 3.1), heading, labels, share="none")
    when, distance = onsets(tracks, start)
    chosen = np.flatnonzero(touching)
    if not chosen.size:
        say(moved, "no marker touches the plate")
        return figure
    times, position = tracks["time"].values - start, tracks["position"].values
    first = int(np.searchsorted(times, -1e-9))
    # From the middle outwards.
    colours = colormaps["viridis"](0.9 * distance / (float(distance[chosen].max(initial=1.0)) or 1.0))
    for marker in chosen[np.argsort(-distance[chosen])]:
        path = np.linalg.norm(position[first:, marker] - position[first, marker], axis=1)
        moved.plot(times[first:], path, color=colours[marker], linewidth=0.8)
    latest = float(np.nanmax(when[chosen], initial=0.1))
    moved.set_xlim(0.0, 1.6 * latest)
    moved.set_ylim(0.0, 12.0 * MOVED)
    moved.axhline(MOVED, color=GREY, linewidth=0.8, linestyle="--")
    moved.set_ylabel("distance from where it stuck [px]")
    where.scatter(distance[chosen], when[chosen], s=14, c=colours[chosen])
    where.set_xlabel("distance from the central marker [px]")
    where.set_ylabel(f"moved by {MOVED:g} px after [s]")
    where.axhline(float(when[int(np.argmin(tracks["ring"].values))]), color=BLACK, linewidth=0.8, linestyle=":")
    return figure
