"""The figure of a fingertip: its two sections and, where it has a shape in 3D, the finger with its phalanx."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import skfem
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from fingerslip.history import sites_of_kinds
from fingerslip.report.colours import BLACK, RECEPTOR_COLOURS, RECEPTOR_MARKS, REGION_COLOURS, region_colours
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, with_style
from fingerslip.specimens.fingertip import (
    REGIONS,
    Fingertip,
    at_depth,
    interface_depth,
    outline_curve,
    phalanx_contour,
    phalanx_surface,
    pose_points,
    skin_grid,
    surface_depth,
)
from fingerslip.specimens.fingertip.numbers import Section
from fingerslip.specimens.fingertip.outline import arc_length_at_cut

__all__ = [
    "fingertip_figure",
    "receptor_positions",
    "section_figure",
]


Floats = NDArray[np.float64]

_EDGE = "#7d6b5d"
_SECTIONS: Mapping[Section, str] = MappingProxyType(
    {"sagittal": "along the finger (sagittal, z = 0)", "transverse": "across the finger (transverse, x = 0)"}
)


@with_style
def fingertip_figure(fingertip: Fingertip, title: str = "") -> Figure:
    """Draw a fingertip: both sections with their layers, and the finger in 3D, to one scale within each panel."""
    count = 2 if fingertip.solid is None else 3
    figure, panels = figure_grid(
        count, count, (3.9, 3.4), join_title("Fingertip", title), ("x [mm]", "y [mm]"), share="none"
    )
    for axes, (section, name) in zip(panels, _SECTIONS.items(), strict=False):
        _draw_section(axes, dataclasses.replace(fingertip, section=section))
        axes.set_title(name)
    if fingertip.solid is not None:
        panels[1].set_xlabel("z [mm]")
        cell = panels[2].get_subplotspec()
        panels[2].remove()
        _draw_solid(figure.add_subplot(cell, projection="3d"), fingertip)
    keys: dict[str, Artist] = {name: Patch(facecolor=c, edgecolor=_EDGE) for name, c in _colours().items()}
    add_legend(figure, keys)
    return figure


def _colours() -> dict[str, str]:
    return {name: REGION_COLOURS[name] for name in REGIONS}


def _draw_section(axes: Axes, fingertip: Fingertip) -> None:
    curve, layers = outline_curve(fingertip), fingertip.layers
    depths = {"epidermis": 0.0, "dermis": layers.epidermis_thickness, "tissue": layers.skin_thickness}
    for name, mean in depths.items():
        first, last = arc_length_at_cut(fingertip, curve, mean)
        arc_length = np.linspace(first, last, 2000)
        depth = np.full(2000, mean)
        if name == "epidermis":
            depth = surface_depth(fingertip, arc_length)
        if name == "dermis":
            depth = interface_depth(fingertip, arc_length)
        _fill(axes, at_depth(curve, arc_length, depth), REGION_COLOURS[name])
    _fill(axes, phalanx_contour(fingertip), REGION_COLOURS["phalanx"])
    axes.axhline(-1e3 * fingertip.outline.half_height, color=BLACK, linewidth=1.6)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.autoscale_view()


def _fill(axes: Axes, ring: Floats, colour: str) -> None:
    axes.add_collection(PolyCollection([1e3 * ring], facecolor=colour, edgecolor=_EDGE, linewidth=0.6))


def _draw_solid(axes: Axes3D, fingertip: Fingertip) -> None:
    """Draw the far half of the skin, and the phalanx before it."""
    skin, phalanx = skin_grid(fingertip), phalanx_surface(fingertip).points
    half = skin[::4, : skin.shape[1] // 2 + 1 : 6]
    _draw_surface(axes, fingertip, half, REGION_COLOURS["epidermis"])
    _draw_surface(
        axes, fingertip, np.concatenate([phalanx, phalanx[:, :1]], axis=1)[::6, ::4], REGION_COLOURS["phalanx"]
    )
    axes.set_title("in 3D: phalanx and one half of the skin")
    limits = axes.get_xlim(), axes.get_ylim(), axes.get_zlim()
    axes.set_box_aspect([last - first for first, last in limits], zoom=1.2)
    axes.view_init(elev=18.0, azim=-70.0)
    axes.set_axis_off()


def _draw_surface(axes: Axes3D, fingertip: Fingertip, grid: Floats, colour: str) -> None:
    points = grid.reshape(-1, 3)
    x, y, z = 1e3 * pose_points(fingertip, points).T.reshape(3, *grid.shape[:2])
    axes.plot_surface(x, z, y, color=colour, edgecolor=_EDGE, linewidth=0.15, rcount=500, ccount=500)


_RECEPTOR_MARKS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {kind: (mark, RECEPTOR_COLOURS[kind]) for kind, mark in RECEPTOR_MARKS.items()}
)
_ZOOM_WIDTH = 3.2e-3


def receptor_positions(history: xr.Dataset) -> dict[str, NDArray[np.float64]]:
    """Return the reference positions of a history's receptors by type, each (n, 2) [m]."""
    rows = {kind: sites_of_kinds(history, [kind]) for kind in _RECEPTOR_MARKS}
    return {kind: history["site_position"].values[row] for kind, row in rows.items() if row.size}


@with_style
def section_figure(
    mesh: skfem.Mesh,
    receptors: Mapping[str, NDArray[np.float64]],
    displacement: NDArray[np.float64] | None = None,
    plate: float | None = None,
    title: str = "",
) -> Figure:
    """Draw a section with its layers, elements, receptors and the plate, and a close view of the skin.

    Arrays: mesh [m]; receptors (n, 2) [m]; displacement (n_nodes, 2) [m]; plate [m].
    """
    figure, (whole, close) = figure_grid(
        2, 2, (4.6, 3.5), join_title("Section", title), ("x [mm]", "y [mm]"), share="none", widths=(1.75, 1.0)
    )
    points = mesh.p.T[:, :2] if displacement is None else mesh.p.T[:, :2] + displacement[: mesh.p.shape[1]]
    moved = {kind: _move_receptors(mesh, positions, points) for kind, positions in receptors.items()}
    lowest = points[np.argmin(points[:, 1])]
    level = float(lowest[1]) if plate is None else plate
    colours = region_colours(tuple(mesh.subdomains or {}))
    for axes, line in ((whole, 0.12), (close, 0.3)):
        _draw_regions(axes, mesh, points, colours, line)
        axes.axhline(1e3 * level, color=BLACK, linewidth=1.6, zorder=3)
        axes.set_aspect("equal")
        axes.grid(visible=False)
    _draw_receptors(whole, moved, 1.6)
    _draw_receptors(close, moved, 5.0)
    whole.autoscale_view()
    _zoom(whole, close, lowest, level)
    add_legend(figure, _keys(colours, moved))
    return figure


def _move_receptors(
    mesh: skfem.Mesh, positions: NDArray[np.float64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Move receptors with the nearest nodes of the mesh."""
    distance = np.linalg.norm(mesh.p.T[None, :, :2] - positions[:, None], axis=2)
    nearest = np.argmin(distance, axis=1)
    moved: NDArray[np.float64] = positions + points[nearest] - mesh.p.T[nearest, :2]
    return moved


def _draw_regions(
    axes: Axes, mesh: skfem.Mesh, points: NDArray[np.float64], colours: Mapping[str, str], line: float
) -> None:
    corners = mesh.t.T[:, : 4 if mesh.t.shape[0] in (4, 9) else 3]
    regions: Mapping[str, NDArray[np.int64]] = mesh.subdomains or {"body": np.arange(mesh.t.shape[1])}
    for name, cells in regions.items():
        polygons = 1e3 * points[corners[cells]]
        colour = colours.get(name, REGION_COLOURS["tissue"])
        axes.add_collection(PolyCollection(list(polygons), facecolor=colour, edgecolor="#7d6b5d", linewidth=line))


def _draw_receptors(axes: Axes, receptors: Mapping[str, NDArray[np.float64]], size: float) -> None:
    for kind, positions in receptors.items():
        mark, colour = _RECEPTOR_MARKS.get(kind, ("x", BLACK))
        x, y = 1e3 * positions.T
        axes.plot(x, y, mark, color=colour, markersize=size, markeredgecolor="white", markeredgewidth=0.15 * size / 2)


def _zoom(whole: Axes, close: Axes, lowest: NDArray[np.float64], level: float) -> None:
    """Show the skin round the lowest point in `close`, and frame that part in `whole`."""
    left, bottom = 1e3 * (lowest[0] - _ZOOM_WIDTH / 2), 1e3 * (level - 0.06 * _ZOOM_WIDTH)
    width = 1e3 * _ZOOM_WIDTH
    close.set_xlim(left, left + width)
    close.set_ylim(bottom, bottom + 1.1 * width)
    close.set_title("close view of the framed part")
    whole.add_patch(Rectangle((left, bottom), width, 1.1 * width, fill=False, linewidth=0.9, zorder=6))


def _keys(colours: Mapping[str, str], receptors: Mapping[str, NDArray[np.float64]]) -> dict[str, Artist]:
    keys: dict[str, Artist] = {n: Patch(facecolor=c, edgecolor="#7d6b5d", linewidth=0.4) for n, c in colours.items()}
    for kind in receptors:
        mark, colour = _RECEPTOR_MARKS.get(kind, ("x", BLACK))
        keys[kind] = Line2D([], [], linestyle="", marker=mark, color=colour, markersize=5)
    return {**keys, "plate": Line2D([], [], color=BLACK, linewidth=1.6)}
