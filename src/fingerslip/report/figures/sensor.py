"""Figures of an optical sensor: its markers from inside and from below, and how they move, coloured by ring."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from fingerslip.report.figures.markers import ring_colours
from fingerslip.report.figures.style import add_legend, figure_grid, styled, titled
from fingerslip.slip import slide_window

__all__ = ["marker_places_figure", "slide_tracks_figure"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_TITLES = {"internal": "internal markers, from inside", "external": "external markers, from below"}
_MILLIMETRES = 1e3


@styled
def marker_places_figure(tracks: xr.Dataset, title: str = "") -> Figure:
    """Draw where the markers of a sensor are at rest, coloured by ring: inside ones from above, others from below.

    Units: tracks [m].
    """
    kinds = [kind for kind in _TITLES if (tracks["kind"].values == kind).any()]
    rest = _MILLIMETRES * tracks["position"].values[0]
    across = rest[:, 2] if rest.shape[1] == 3 else np.zeros(len(rest))
    labels = ("x, along the slide [mm]", "z, across [mm]")
    figure, panels = figure_grid(len(kinds), 2, (3.6, 3.2), titled("Markers at rest", title), labels, share="none")
    rings = tracks["ring"].values
    colours = ring_colours(int(rings.max(initial=0)) + 1)
    for axes, kind in zip(panels, kinds, strict=True):
        own = tracks["kind"].values == kind
        axes.scatter(rest[own, 0], across[own], s=16, c=[colours[ring] for ring in rings[own]])
        axes.set_title(f"{own.sum()} {_TITLES[kind]}")
        axes.set_aspect("equal", adjustable="datalim")
        if kind == "internal":
            # As the internal camera sees them: x to the right, z downwards.
            axes.invert_yaxis()
    add_legend(figure, _ring_keys(rings))
    return figure


@styled
def slide_tracks_figure(tracks: xr.Dataset, history: xr.Dataset, title: str = "") -> Figure:
    """Draw how far markers move along the slide in the first slide, coloured by ring, over the travel of the plate.

    Units: tracks [m].
    """
    window = slide_window(history)
    if window is None:
        raise ValueError("the history has no slide")
    records = window.records
    plate = history["counterface_displacement"].values[records, 0]
    direction = plate[-1] - plate[0]
    direction = direction / np.linalg.norm(direction)
    travel = _MILLIMETRES * (plate - plate[0]) @ direction
    moved = tracks["position"].values[records]
    along = _MILLIMETRES * (moved - moved[0]) @ direction
    kinds = [kind for kind in _TITLES if (tracks["kind"].values == kind).any()]
    labels = ("travel of the plate [mm]", "displacement along the slide [mm]")
    figure, panels = figure_grid(len(kinds), 2, (4.2, 3.0), titled("Markers in the slide", title), labels, share="x")
    for axes, kind in zip(panels, kinds, strict=True):
        own = np.flatnonzero(tracks["kind"].values == kind)
        _draw_rings(axes, travel, along[:, own], tracks["ring"].values[own], tracks["position"].values[0, own, 0])
        axes.plot(travel, travel, ":", color="0.5", linewidth=0.8)
        axes.set_ylim(*_limits(along[:, own]))
        axes.set_title(f"{kind} markers")
    add_legend(figure, _ring_keys(tracks["ring"].values))
    return figure


def _draw_rings(axes: Axes, travel: Floats, along: Floats, rings: Integers, start: Floats) -> None:
    colours = ring_colours(int(rings.max(initial=0)) + 1)
    # The centre is drawn last, above all others.
    for marker in np.argsort(-rings, kind="stable"):
        style = "-" if start[marker] >= -1e-9 else "--"
        axes.plot(travel, along[:, marker], style, color=colours[int(rings[marker])], linewidth=0.9)


def _limits(values: Floats) -> tuple[float, float]:
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = 0.06 * max(high - low, 1e-3)
    return low - room, high + room


def _ring_keys(rings: Integers) -> dict[str, Artist]:
    colours = ring_colours(int(rings.max(initial=0)) + 1)
    return {
        f"ring {ring}" if ring else "centre": Line2D([], [], color=colour, linewidth=2.0)
        for ring, colour in enumerate(colours)
        if (rings == ring).any()
    }
