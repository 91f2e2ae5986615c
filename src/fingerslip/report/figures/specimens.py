"""Figures of specimens at rest: fingertips and sensors from their numbers, sections with their mesh."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import Axes3D

from fingerslip.arrays import Floats
from fingerslip.history import sites_of_kinds
from fingerslip.report.colours import BLACK, GREY, RECEPTOR_COLOURS, RECEPTOR_MARKS, REGION_COLOURS, region_colours
from fingerslip.report.figures.markers import ring_colours
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, layer_keys, name_panel, with_style
from fingerslip.report.labels import of_histories
from fingerslip.report.scene.scene import CORNERS, region_names
from fingerslip.snapshot import faces_at_record
from fingerslip.specimens.fingertip import outline
from fingerslip.specimens.fingertip.fingertip import Fingertip
from fingerslip.specimens.fingertip.numbers import REGIONS, Section
from fingerslip.specimens.fingertip.phalanx import phalanx_contour, phalanx_surface
from fingerslip.specimens.fingertip.skin import pose_points, skin_grid
from fingerslip.specimens.gel_pad.gel_pad import GelPad
from fingerslip.specimens.tactip.numbers import modelled_places, points_at
from fingerslip.specimens.tactip.parts import skin_lines
from fingerslip.specimens.tactip.tactip import TacTip

_MILLIMETRES = 1e3
_EDGE = "#7d6b5d"
_SECTIONS: Mapping[Section, str] = {
    "sagittal": "along the finger (sagittal, z = 0)",
    "transverse": "across the finger (transverse, x = 0)",
}


@with_style
def fingertip_figure(fingertip: Fingertip, title: str = "") -> Figure:
    """Draw a fingertip: both sections with their layers, and the finger in 3D, to one scale within each panel."""
    count = 2 if fingertip.solid is None else 3
    heading = join_title("Fingertip", title)
    figure, panels = figure_grid(count, count, (3.9, 3.4), heading, ("x [mm]", "y [mm]"), share="none")
    for axes, (section, name) in zip(panels, _SECTIONS.items(), strict=False):
        _draw_fingertip_section(axes, dataclasses.replace(fingertip, section=section))
        axes.set_title(name)
    if fingertip.solid is not None:
        panels[1].set_xlabel("z [mm]")
        cell = panels[2].get_subplotspec()
        panels[2].remove()
        _draw_solid(figure.add_subplot(cell, projection="3d"), fingertip)
    add_legend(figure, layer_keys({name: REGION_COLOURS[name] for name in REGIONS}, _EDGE))
    return figure


def _fill(axes: Axes, polygons: Iterable[Floats], colour: str, edge: str = _EDGE, line: float = 0.6) -> None:
    """Fill polygons (n, 2) [m]."""
    scaled = [_MILLIMETRES * polygon for polygon in polygons]
    axes.add_collection(PolyCollection(scaled, facecolor=colour, edgecolor=edge, linewidth=line))


def _draw_to_scale(axes: Axes) -> None:
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _draw_fingertip_section(axes: Axes, fingertip: Fingertip) -> None:
    curve, layers = outline.outline_curve(fingertip), fingertip.layers
    depths = {"epidermis": 0.0, "dermis": layers.epidermis_thickness, "tissue": layers.skin_thickness}
    for name, mean in depths.items():
        arc_length = np.linspace(*outline.arc_length_at_cut(fingertip, curve, mean), 2000)
        depth_of = {"epidermis": outline.surface_depth, "dermis": outline.interface_depth}.get(name)
        depth = depth_of(fingertip, arc_length) if depth_of else np.full(2000, mean)
        _fill(axes, [outline.at_depth(curve, arc_length, depth)], REGION_COLOURS[name])
    _fill(axes, [phalanx_contour(fingertip)], REGION_COLOURS["phalanx"])
    axes.axhline(-1e3 * fingertip.outline.half_height, color=BLACK, linewidth=1.6)
    _draw_to_scale(axes)
    axes.autoscale_view()


def _draw_solid(axes: Axes3D, fingertip: Fingertip) -> None:
    """Draw the far half of the skin, and the phalanx before it."""
    skin, phalanx = skin_grid(fingertip), phalanx_surface(fingertip).points
    closed = np.concatenate([phalanx, phalanx[:, :1]], axis=1)
    grids = {"epidermis": skin[::4, : skin.shape[1] // 2 + 1 : 6], "phalanx": closed[::6, ::4]}
    for name, grid in grids.items():
        x, y, z = 1e3 * pose_points(fingertip, grid.reshape(-1, 3)).T.reshape(3, *grid.shape[:2])
        look = {"color": REGION_COLOURS[name], "edgecolor": _EDGE, "linewidth": 0.15, "rcount": 500, "ccount": 500}
        axes.plot_surface(x, z, y, **look)
    axes.set_title("in 3D: phalanx and one half of the skin")
    limits = axes.get_xlim(), axes.get_ylim(), axes.get_zlim()
    axes.set_box_aspect([last - first for first, last in limits], zoom=1.2)
    axes.view_init(elev=18.0, azim=-70.0)
    axes.set_axis_off()


_ZOOM_WIDTH = 3.2e-3
_SAME_GAP = 1e-9  # m


def receptor_positions(history: xr.Dataset) -> dict[str, Floats]:
    """Return the reference positions of a history's receptors by type, each (n, 2) [m]."""
    rows = {kind: sites_of_kinds(history, [kind]) for kind in RECEPTOR_MARKS}
    return {kind: history["site_position"].values[row] for kind, row in rows.items() if row.size}


@with_style
def mesh_figure(history: xr.Dataset, title: str = "") -> Figure:
    """Draw the section of a history at rest: layers, elements, receptors and counterfaces, and the skin closer."""
    labels, heading = ("x [mm]", "y [mm]"), join_title("Section", title)
    figure, (whole, close) = figure_grid(2, 2, (4.6, 3.5), heading, labels, share="none", widths=(1.75, 1.0))
    points, of_cells = history["node_position"].values, history["cell_region"].values
    corners = points[history["cell_nodes"].values[:, : CORNERS[history.attrs["element"]]]]
    regions = {name: corners[of_cells == number] for number, name in enumerate(region_names(history))}
    colours = region_colours([name for name, shapes in regions.items() if len(shapes)])
    box = np.array([points.min(axis=0), points.max(axis=0)])
    size, first, normal, gap = float(np.ptp(box)), points[np.argmin(points[:, 1])], np.array([0.0, 1.0]), 0.0
    lines = [line[:, :2] for face in faces_at_record(history, 0, size) for line in face.outline]
    if history.sizes.get("contact_node"):
        first, normal, gap = _first_touched(history)
    receptors = receptor_positions(history)
    # The skin round the point that touches first, which is near the edge, and a frame around that part in the whole.
    middle = first + 0.49 * _ZOOM_WIDTH * normal
    corner, width = 1e3 * (middle - np.array([0.5, 0.55]) * _ZOOM_WIDTH), 1e3 * _ZOOM_WIDTH
    for axes, line, size in ((whole, 0.12, 1.6), (close, 0.3, 5.0)):
        for name, colour in colours.items():
            shapes = _MILLIMETRES * regions[name]
            if axes is close:  # the cells in its frame, and some beside them
                shapes = shapes[(np.abs(shapes - corner) < 3.0 * width).any(axis=1).all(axis=1)]
            axes.add_collection(PolyCollection(shapes, facecolor=colour, edgecolor=_EDGE, linewidth=line))
        for points_of_line in lines:
            axes.add_line(Line2D(*1e3 * points_of_line.T, color=BLACK, linewidth=1.6, zorder=3))
        _draw_to_scale(axes)
        for kind, values in receptors.items():
            look: dict[str, Any] = {"markeredgecolor": "white", "markeredgewidth": 0.15 * size / 2, "markersize": size}
            colour = RECEPTOR_COLOURS.get(kind, BLACK)
            axes.plot(*1e3 * values.T, RECEPTOR_MARKS.get(kind, "x"), color=colour, **look)
    plate_and_body = np.array([*box, first - gap * normal])
    whole.dataLim = Bbox(1e3 * np.array([plate_and_body.min(axis=0), plate_and_body.max(axis=0)]))
    whole.autoscale_view()
    close.set(xlim=(corner[0], corner[0] + width), ylim=(corner[1], corner[1] + 1.1 * width))
    name_panel(close, "close view of the framed part")
    whole.add_patch(Rectangle(tuple(corner), width, 1.1 * width, fill=False, linewidth=0.9, zorder=6))
    keys = layer_keys(colours, _EDGE, linewidth=0.4)
    for kind in receptors:
        mark, colour = RECEPTOR_MARKS.get(kind, "x"), RECEPTOR_COLOURS.get(kind, BLACK)
        keys[kind] = Line2D([], [], linestyle="", marker=mark, color=colour, markersize=5)
    if lines:
        keys[of_histories("plate", [history])] = Line2D([], [], color=BLACK, linewidth=1.6)
    add_legend(figure, keys)
    return figure


def _first_touched(history: xr.Dataset) -> tuple[Floats, Floats, float]:
    """Return position (dim,), counterface normal and gap [m] of the node that is nearest at the start.

    Of several it is the one in the middle.
    """
    gaps = history["gap"].values[0]
    nearest = np.flatnonzero(gaps <= gaps.min() + _SAME_GAP)
    positions = history["contact_position"].values[nearest]
    middle = int(np.linalg.norm(positions - positions.mean(axis=0), axis=1).argmin())
    normals = history["counterface_normal"].values[history["contact_counterface"].values[nearest]]
    return positions[middle], normals[middle], float(gaps[nearest[middle]])


#: Colours of the regions of a sensor.
SENSOR_COLOURS: Mapping[str, str] = {"gel": "#d9e6f2", "skin": "#6b6b6b", "rods": "#f4f0d8", "window": "#d9d9d9"}
_SENSOR_EDGE = "#4a4a4a"


@with_style
def tactip_figure(sensor: TacTip, title: str = "") -> Figure:
    """Draw a sensor: its section through the axis, and where its markers are, coloured by ring."""
    labels, heading = ("x [mm]", ""), join_title("Sensor", title)
    figure, panels = figure_grid(3, 3, (4.2, 3.6), heading, labels, share="none", widths=(1.5, 1, 1))
    _draw_sensor_section(panels[0], dataclasses.replace(sensor, part="section"))
    panels[0].set_ylabel("y [mm]")
    panels[0].set_title("cut open along the axis")
    whole = dataclasses.replace(sensor, part="whole")
    places, angle = whole.markers.places, np.linspace(0.0, 2.0 * np.pi, 121)
    edge = _MILLIMETRES * float(skin_lines(whole.dome, whole.skin, whole.markers.spacing).outer[-1, 0])
    depths = {"internal markers, from inside": whole.marker_depth, "external markers, from below": 0.0}
    for axes, (name, depth) in zip(panels[1:], depths.items(), strict=True):
        points = _MILLIMETRES * points_at(whole, places, depth)
        axes.scatter(points[:, 0], points[:, 2], s=10, c=ring_colours(places.ring))
        axes.plot(edge * np.cos(angle), edge * np.sin(angle), color=GREY, linewidth=0.8)
        _draw_to_scale(axes)
        axes.set_ylabel("z [mm]")
        axes.set_title(f"{len(places.ring)} {name}")
    # From inside, x to the right and z downwards, as the internal camera sees them.
    panels[1].invert_yaxis()
    add_legend(figure, layer_keys(SENSOR_COLOURS, _SENSOR_EDGE))
    return figure


def _draw_sensor_section(axes: Axes, sensor: TacTip) -> None:
    lines, top = skin_lines(sensor.dome, sensor.skin, sensor.markers.spacing), sensor.dome.height
    half, thickness = float(lines.outer[-1, 0]), sensor.window.thickness
    places = modelled_places(sensor)
    feet, ends = (points_at(sensor, places, depth) for depth in (sensor.rod_depth, sensor.marker_depth))
    along = (ends - feet) / np.linalg.norm(ends - feet, axis=1)[:, None]
    side = sensor.rods.radius * np.stack([-along[:, 1], along[:, 0]], axis=1)
    shapes: dict[str, Iterable[Floats]] = {
        "skin": [_mirror(lines.outer)],
        "gel": [_mirror(lines.inner)],
        "rods": np.stack([feet - side, ends - side, ends + side, feet + side], axis=1),
        "window": [np.array([[-half, top], [half, top], [half, top + thickness], [-half, top + thickness]])],
    }
    for name, polygons in shapes.items():
        _fill(axes, polygons, SENSOR_COLOURS[name], _SENSOR_EDGE, 0.5)
    axes.autoscale_view()
    _draw_to_scale(axes)


def _mirror(line: Floats) -> Floats:
    """Return the polygon between a line from the axis outwards and its mirror image."""
    return np.vstack([line[::-1], (line * [-1.0, 1.0])[1:]])


@with_style
def gel_pad_figure(pad: GelPad, title: str = "") -> Figure:
    """Draw a gel pad: its section, and where its markers are, coloured by ring."""
    figure, panels = figure_grid(2, 2, (4.6, 3.4), join_title("Sensor", title), ("x [mm]", ""), share="none")
    whole = dataclasses.replace(pad, part="whole")
    points, ring = whole.marker_points, whole.layout.ring
    row = points[:, 2] == points[np.abs(points[:, 2]).argmin(), 2]
    for axes, chosen, axis, low, side, name in (
        (panels[0], row, 1, 0.0, pad.thickness, "cut open along the middle"),
        (panels[1], np.ones_like(row), 2, -0.5 * pad.width, pad.width, f"{len(ring)} internal markers, from inside"),
    ):
        x = 0.5 * pad.length
        _fill(axes, [np.array([[-x, low], [x, low], [x, low + side], [-x, low + side]])], SENSOR_COLOURS["gel"])
        x, y = _MILLIMETRES * points[chosen][:, [0, axis]].T
        axes.scatter(x, y, s=14, c=ring_colours(ring)[chosen], zorder=2)
        axes.autoscale_view()
        _draw_to_scale(axes)
        axes.set_title(name)
        axes.set_ylabel("yz"[axis - 1] + " [mm]")
    panels[1].invert_yaxis()
    return figure


#: The figure of a specimen by its kind.
SPECIMEN_FIGURES: Mapping[str, Callable[..., Figure]] = {
    "fingertip": fingertip_figure,
    "tactip": tactip_figure,
    "gel_pad": gel_pad_figure,
}
