"""The figure of a fingertip: its two sections and, where it has a shape in space, the finger with its phalanx."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from fingerslip.report.colours import BLACK, REGION_COLOURS
from fingerslip.report.figures.style import add_legend, figure_grid, styled, titled
from fingerslip.specimens.fingertip import (
    REGIONS,
    Fingertip,
    at_depth,
    interface_depth,
    outline_curve,
    phalanx_contour,
    phalanx_surface,
    posed,
    skin_grid,
    surface_depth,
)
from fingerslip.specimens.fingertip.numbers import Section
from fingerslip.specimens.fingertip.outline import arc_length_at_cut

__all__ = ["fingertip_figure"]

Floats = NDArray[np.float64]

_EDGE = "#7d6b5d"
_SECTIONS: Mapping[Section, str] = MappingProxyType(
    {"sagittal": "along the finger (sagittal, z = 0)", "transverse": "across the finger (transverse, x = 0)"}
)


@styled
def fingertip_figure(fingertip: Fingertip, title: str = "") -> Figure:
    """Draw a fingertip: both sections with their layers, and the finger in space, to one scale within each panel."""
    count = 2 if fingertip.solid is None else 3
    figure, panels = figure_grid(
        count, count, (3.9, 3.4), titled("Fingertip", title), ("x [mm]", "y [mm]"), share="none"
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
    axes.set_title("in space: phalanx and one half of the skin")
    limits = axes.get_xlim(), axes.get_ylim(), axes.get_zlim()
    axes.set_box_aspect([last - first for first, last in limits], zoom=1.2)
    axes.view_init(elev=18.0, azim=-70.0)
    axes.set_axis_off()


def _draw_surface(axes: Axes3D, fingertip: Fingertip, grid: Floats, colour: str) -> None:
    points = grid.reshape(-1, 3)
    x, y, z = 1e3 * posed(fingertip, points).T.reshape(3, *grid.shape[:2])
    axes.plot_surface(x, z, y, color=colour, edgecolor=_EDGE, linewidth=0.15, rcount=500, ccount=500)
