"""Figures of markers: how far each has moved over time, coloured by ring, and their fields at one time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from fingerslip.report.colours import BLACK, BLUE, GREY, VERMILLION
from fingerslip.report.figures.style import add_legend, figure_grid, say, styled, titled
from fingerslip.vision.fields.triangles import larger_principal

__all__ = ["fields_figure", "marker_tracks_figure", "ring_colours"]

Floats = NDArray[np.float64]

# What lengths are shown in, and how many of it there are to the unit of the tracks.
_SHOWN = {"m": ("mm", 1e3), "px": ("px", 1.0)}
_SHARE = 0.8  # of the distance between markers that the longest arrow of a panel takes
_PERCENT = 100.0


def ring_colours(rings: int) -> list[tuple[float, float, float, float]]:
    """Return a colour for each ring, from the centre outwards."""
    return [colormaps["viridis"](0.85 * ring / max(rings - 1, 1)) for ring in range(rings)]


@styled
def marker_tracks_figure(tracks: xr.Dataset, title: str = "") -> Figure:
    """Draw how far each marker has moved along each axis since it was first seen, over time, coloured by ring."""
    unit, scale = _SHOWN[str(tracks["position"].attrs["units"])]
    axes_names = [str(name) for name in tracks["axis"].values]
    labels = ("time [s]", f"displacement [{unit}]")
    shown = titled("Markers over time", title)
    figure, panels = figure_grid(len(axes_names), 3, (3.6, 2.8), shown, labels, share="x")
    rings = tracks["ring"].values if "ring" in tracks.coords else np.zeros(tracks.sizes["marker"], dtype=int)
    colours = ring_colours(int(rings.max(initial=0)) + 1)
    keys: dict[str, Artist] = {}
    for number, (axes, name) in enumerate(zip(panels, axes_names, strict=True)):
        moved = scale * _since_first_seen(tracks["position"].values[:, :, number])
        axes.set_title(f"along {name}")
        # The centre is drawn last, above all others.
        for marker in np.argsort(-rings, kind="stable"):
            ring = int(rings[marker])
            (line,) = axes.plot(tracks["time"], moved[:, marker], color=colours[ring], linewidth=0.8)
            keys[f"ring {ring}" if ring else "centre"] = line
    add_legend(figure, dict(sorted(keys.items())) if "ring" in tracks.coords else {})
    return figure


def _since_first_seen(values: Floats) -> Floats:
    """Return values (n_times, n_markers) less the first of each marker that is known."""
    if not values.size:
        return values
    first = (~np.isnan(values)).argmax(axis=0)
    moved: Floats = values - values[first, np.arange(values.shape[1])]
    return moved


@styled
def fields_figure(fields: xr.Dataset, time: float, title: str = "") -> Figure:
    """Draw the fields of markers at one time.

    Units: time [s].
    """
    now = fields.isel(time=int(np.abs(fields["time"].values - time).argmin()))
    unit, scale = _SHOWN[str(fields["position"].attrs["units"])]
    shown = titled(f"Fields from markers at {float(now['time']):.3g} s", title)
    figure, panels = figure_grid(6, 3, (3.3, 3.1), shown, (f"x at rest [{unit}]", f"y at rest [{unit}]"))
    arrows = {"displacement": unit, "velocity": f"{unit}/s", "rigid_residual": unit}
    for axes, (name, of) in zip(panels, arrows.items(), strict=False):
        axes.set_title(name.replace("_", " "))
        _draw_arrows(axes, scale * now["rest"].values, scale * now[name].values, of)
    _draw_centroid(panels[0], scale * now["contact_centroid"].values)
    surfaces = {"divergence": now["divergence"].values, "curl": now["curl"].values}
    for axes, (name, values) in zip(panels[3:], surfaces.items(), strict=False):
        axes.set_title(f"{name} [%]")
        _draw_surface(axes, now, scale, _PERCENT * values, figure.colorbar)
    panels[5].set_title("larger principal strain [%]")
    _draw_surface(panels[5], now, scale, _PERCENT * larger_principal(now["strain"].values), figure.colorbar)
    for axes in panels:
        axes.set_aspect("equal")
    # In pictures y points down.
    if unit == "px":
        panels[0].invert_yaxis()
    return figure


def _draw_arrows(axes: Axes, rest: Floats, vectors: Floats, unit: str) -> None:
    """Draw arrows from the markers at rest, the longest as long as the markers are apart, and say how long that is."""
    plane, moves = rest[:, :2], vectors[:, :2]
    axes.scatter(plane[:, 0], plane[:, 1], s=4, color=GREY, zorder=2)
    longest = float(np.nanmax(np.hypot(*moves.T), initial=0.0))
    if longest > 0:
        grown = moves * (_SHARE * _spacing(plane) / longest)
        axes.quiver(*plane.T, *grown.T, angles="xy", scale_units="xy", scale=1, color=BLUE, width=0.006, zorder=3)
    axes.text(0.02, 0.02, f"longest {longest:.3g} {unit}", transform=axes.transAxes, fontsize=7.5, color=BLACK)
    lost = np.isnan(moves).any(axis=1)
    axes.scatter(plane[lost, 0], plane[lost, 1], s=18, marker="x", color=VERMILLION, linewidths=0.9, zorder=4)


def _spacing(plane: Floats) -> float:
    """Return the median distance of markers from their nearest neighbours, in the units of the positions."""
    from scipy.spatial import KDTree

    known = plane[~np.isnan(plane).any(axis=1)]
    if len(known) < 2:
        return 1.0
    return float(np.median(KDTree(known).query(known, k=2)[0][:, 1]))


def _draw_centroid(axes: Axes, centroid: Floats) -> None:
    if not np.isnan(centroid).any():
        axes.scatter(centroid[0], centroid[1], marker="+", s=90, color=VERMILLION, linewidths=1.6, zorder=5)


def _draw_surface(axes: Axes, now: xr.Dataset, scale: float, values: Floats, colorbar: Callable[..., object]) -> None:
    """Draw values at markers or in triangles as colours, the same to both sides of zero."""
    corners = now["triangle_marker"].values
    by_marker = values.size == now.sizes["marker"] and values.size != len(corners)
    lost = np.isnan(values[corners]).any(axis=1) if by_marker else np.isnan(values)
    if not len(corners) or lost.all():
        say(axes, "no triangle of markers")
        return
    largest = float(np.nanmax(np.abs(values))) or 1.0
    given: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -largest, "vmax": largest, "rasterized": True}
    plane = scale * now["rest"].values
    mesh = Triangulation(plane[:, 0], plane[:, 1], corners)
    mesh.set_mask(lost)
    if by_marker:
        drawn = axes.tripcolor(mesh, np.nan_to_num(values), shading="gouraud", **given)
    else:
        drawn = axes.tripcolor(mesh, facecolors=np.nan_to_num(values), **given)
    colorbar(drawn, ax=axes, shrink=0.75)
