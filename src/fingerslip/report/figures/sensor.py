"""Figures of an optical sensor: its markers from inside and from below, and how they move, coloured by ring."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fingerslip.report.colours import GREY
from fingerslip.report.figures.markers import ring_colours
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, with_style
from fingerslip.slip import slide_window
from fingerslip.specimens.tactip import TacTip, marker_places, skin_lines
from fingerslip.specimens.tactip.sites import modelled_places, points_at

__all__ = [
    "marker_places_figure",
    "sensor_colours",
    "slide_tracks_figure",
    "tactip_figure",
]


Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_TITLES = {"internal": "internal markers, from inside", "external": "external markers, from below"}
_MILLIMETRES = 1e3


@with_style
def marker_places_figure(tracks: xr.Dataset, title: str = "") -> Figure:
    """Draw where the markers of a sensor are at rest, coloured by ring: inside ones from above, others from below.

    Units: tracks [m].
    """
    kinds = [kind for kind in _TITLES if (tracks["kind"].values == kind).any()]
    rest = _MILLIMETRES * tracks["position"].values[0]
    across = rest[:, 2] if rest.shape[1] == 3 else np.zeros(len(rest))
    labels = ("x, along the slide [mm]", "z, across [mm]")
    figure, panels = figure_grid(len(kinds), 2, (3.6, 3.2), join_title("Markers at rest", title), labels, share="none")
    rings = tracks["ring"].values
    colours = ring_colours(int(rings.max(initial=0)) + 1)
    for axes, kind in zip(panels, kinds, strict=True):
        rows = tracks["kind"].values == kind
        axes.scatter(rest[rows, 0], across[rows], s=16, c=[colours[ring] for ring in rings[rows]])
        axes.set_title(f"{rows.sum()} {_TITLES[kind]}")
        axes.set_aspect("equal", adjustable="datalim")
        if kind == "internal":
            # As the internal camera sees them: x to the right, z downwards.
            axes.invert_yaxis()
    add_legend(figure, _ring_keys(rings))
    return figure


@with_style
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
    figure, panels = figure_grid(
        len(kinds), 2, (4.2, 3.0), join_title("Markers in the slide", title), labels, share="x"
    )
    for axes, kind in zip(panels, kinds, strict=True):
        rows = np.flatnonzero(tracks["kind"].values == kind)
        _draw_rings(axes, travel, along[:, rows], tracks["ring"].values[rows], tracks["position"].values[0, rows, 0])
        axes.plot(travel, travel, ":", color="0.5", linewidth=0.8)
        axes.set_ylim(*_limits(along[:, rows]))
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


_COLOURS: Mapping[str, str] = MappingProxyType(
    {"gel": "#d9e6f2", "skin": "#6b6b6b", "rods": "#f4f0d8", "window": "#d9d9d9"}
)
_EDGE = "#4a4a4a"


def sensor_colours() -> Mapping[str, str]:
    """Return the colour of each region of a sensor."""
    return _COLOURS


@with_style
def tactip_figure(sensor: TacTip, title: str = "") -> Figure:
    """Draw a sensor: its section through the axis, and where its markers are, coloured by ring."""
    labels = ("x [mm]", "")
    figure, panels = figure_grid(
        3, 3, (4.2, 3.6), join_title("Sensor", title), labels, share="none", widths=(1.5, 1, 1)
    )
    _draw_section(panels[0], dataclasses.replace(sensor, part="section"))
    panels[0].set_ylabel("y [mm]")
    panels[0].set_title("cut open along the axis")
    whole = dataclasses.replace(sensor, part="whole")
    depths = {"internal markers, from inside": whole.marker_depth, "external markers, from below": 0.0}
    for axes, (name, depth) in zip(panels[1:], depths.items(), strict=True):
        _draw_markers(axes, whole, depth)
        axes.set_ylabel("z [mm]")
        axes.set_title(f"{len(marker_places(whole.markers).ring)} {name}")
    keys: dict[str, Artist] = {name: Patch(facecolor=colour, edgecolor=_EDGE) for name, colour in _COLOURS.items()}
    # From inside, x to the right and z downwards, as the internal camera sees them.
    panels[1].invert_yaxis()
    add_legend(figure, keys)
    return figure


def _draw_section(axes: Axes, sensor: TacTip) -> None:
    lines, top = skin_lines(sensor.dome, sensor.skin, sensor.markers.spacing), sensor.dome.height
    half, thickness = float(lines.outer[-1, 0]), sensor.window.thickness
    places = modelled_places(sensor)
    feet, ends = (points_at(sensor, places, depth) for depth in (sensor.rod_depth, sensor.marker_depth))
    shapes = {
        "skin": [_mirror(lines.outer)],
        "gel": [_mirror(lines.inner)],
        "rods": [_strip(foot, end, sensor.rods.radius) for foot, end in zip(feet, ends, strict=True)],
        "window": [np.array([[-half, top], [half, top], [half, top + thickness], [-half, top + thickness]])],
    }
    for name, polygons in shapes.items():
        scaled = [_MILLIMETRES * polygon for polygon in polygons]
        axes.add_collection(PolyCollection(scaled, facecolor=_COLOURS[name], edgecolor=_EDGE, linewidth=0.5))
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _draw_markers(axes: Axes, sensor: TacTip, depth: float) -> None:
    places = marker_places(sensor.markers)
    points = _MILLIMETRES * points_at(sensor, places, depth)
    colours = ring_colours(int(places.ring.max(initial=0)) + 1)
    axes.scatter(points[:, 0], points[:, 2], s=10, c=[colours[ring] for ring in places.ring])
    edge = _MILLIMETRES * float(skin_lines(sensor.dome, sensor.skin, sensor.markers.spacing).outer[-1, 0])
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    axes.plot(edge * np.cos(angle), edge * np.sin(angle), color=GREY, linewidth=0.8)
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _mirror(line: Floats) -> Floats:
    """Return the polygon between a line from the axis outwards and its mirror image."""
    return np.vstack([line[::-1], (line * [-1.0, 1.0])[1:]])


def _strip(foot: Floats, end: Floats, radius: float) -> Floats:
    along = (end - foot) / np.linalg.norm(end - foot)
    side = radius * np.array([-along[1], along[0]])
    return np.array([foot - side, end - side, end + side, foot + side])
