"""Figures of films: frames beside the computed picture of the same moment, and the order in which markers slip."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingerslip.history import is_solid, nearest_snapshot
from fingerslip.report.colours import BLACK, GREY
from fingerslip.report.figures.cut import cropped
from fingerslip.report.figures.style import figure_grid, say, styled, titled
from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.scene.viewer import stills

__all__ = ["MOVED", "film_times", "frames_figure", "onsets", "slip_order_figure"]

Floats = NDArray[np.float64]
Frame = NDArray[np.uint8]

#: Distance in the image from where a marker was when the slide began, from which on it counts as slipping [px].
MOVED = 1.0
_PANELS = 4
_SIZE = (960, 660)
_REFERENCE = 5  # frames before the slide whose mean is where markers were
_PANEL = (2.7, 2.1)


def film_times(start: float, end: float, first: float) -> tuple[float, ...]:
    """Return the times of the frames that a report shows [s]: at rest, at the start of the slide, in it, at its end."""
    return (first, start, start + (end - start) / 3.0, end)


@styled
def frames_figure(history: xr.Dataset, frames: Mapping[float, Frame], title: str = "") -> Figure:
    """Draw frames of a camera above the computed body at the snapshots that are nearest in time.

    Arrays: frames (height, width) [s].
    """
    times = list(frames)[:_PANELS]
    shown = titled("What the camera sees, and the body at that time", title)
    figure, panels = figure_grid(2 * len(times), len(times), _PANEL, shown, ("", ""), share="none")
    numbers = [nearest_snapshot(history, max(time, 0.0)) for time in times]
    options = SceneOptions(scalar="region", cut="z" if is_solid(history) else "none", camera="side", written=False)
    bodies = cropped(stills(history, numbers, options, _SIZE))
    for number, time in enumerate(times):
        above, below = panels[number], panels[len(times) + number]
        above.imshow(frames[time], cmap="gray", vmin=0, vmax=255)
        above.set_title("frame at rest" if time < 0.0 else f"frame at {time:.2f} s")
        below.imshow(bodies[number])
        below.set_title(f"snapshot at {float(history['snapshot_time'][numbers[number]]):.2f} s")
        for axes in (above, below):
            axes.set_axis_off()
    return figure


def onsets(tracks: xr.Dataset, start: float) -> tuple[Floats, Floats]:
    """Return when each marker starts to move in the image, and how far it is from the middle one.

    Parameters
    ----------
    tracks : xarray.Dataset
        Tracks [px] of an external camera that goes with the plate: a marker that sticks stands still.
    start : float
        Start of the slide [s].

    Returns
    -------
    (n,) array, (n,) array
        Time after `start` from which a marker is more than `MOVED` from where it was [s], NaN for one that is not; its
        distance from the marker of ring 0 at the start [px].
    """
    times, position = tracks["time"].values, tracks["position"].values
    first = int(np.searchsorted(times, start - 1e-9))
    before = np.nanmean(position[max(first - _REFERENCE, 0) : first + 1], axis=0)
    away = np.linalg.norm(position[first:] - before, axis=2) > MOVED
    found = np.where(away.any(axis=0), times[first + away.argmax(axis=0)] - start, np.nan)
    centre = before[int(np.argmin(tracks["ring"].values))]
    return found, np.linalg.norm(before - centre, axis=1)


@styled
def slip_order_figure(tracks: xr.Dataset, start: float, touching: NDArray[np.bool_], title: str = "") -> Figure:
    """Draw how markers of the skin move in the image of the external camera, and when each starts to.

    Arrays: tracks [px]; start [s]; touching (n,).
    """
    labels = ("time since the slide began [s]", "")
    shown = titled("Order of slip, seen through the plate", title)
    figure, (moved, where) = figure_grid(2, 2, (4.2, 3.1), shown, labels, share="none")
    when, distance = onsets(tracks, start)
    chosen = np.flatnonzero(touching)
    if not chosen.size:
        say(moved, "no marker touches the plate")
        return figure
    times, position = tracks["time"].values - start, tracks["position"].values
    first = int(np.searchsorted(times, -1e-9))
    colour = _colours(distance, chosen)
    for marker in map(int, chosen[np.argsort(-distance[chosen])]):
        path = np.linalg.norm(position[first:, marker] - position[first, marker], axis=1)
        moved.plot(times[first:], path, color=colour[marker], linewidth=0.8)
    latest = float(np.nanmax(when[chosen], initial=0.1))
    moved.set_xlim(0.0, 1.6 * latest)
    moved.set_ylim(0.0, 12.0 * MOVED)
    moved.axhline(MOVED, color=GREY, linewidth=0.8, linestyle="--")
    moved.set_ylabel("distance from where it stuck [px]")
    where.scatter(distance[chosen], when[chosen], s=14, c=[colour[marker] for marker in map(int, chosen)])
    where.set_xlabel("distance from the central marker [px]")
    where.set_ylabel(f"moved by {MOVED:g} px after [s]")
    where.axhline(float(when[int(np.argmin(tracks["ring"].values))]), color=BLACK, linewidth=0.8, linestyle=":")
    return figure


def _colours(distance: Floats, chosen: NDArray[np.intp]) -> dict[int, tuple[float, float, float, float]]:
    """Return a colour for each chosen marker, from the middle outwards."""
    from matplotlib import colormaps

    largest = float(distance[chosen].max(initial=1.0)) or 1.0
    return {int(marker): colormaps["viridis"](0.9 * distance[marker] / largest) for marker in chosen}
