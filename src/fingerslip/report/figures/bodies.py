"""The deformed body in 2D and 3D: sections and lit views with a field, cuts, its nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import ResultError
from fingerslip.history import is_solid, nearest_record, reference_kinds, site_kinds, sites_of_kinds
from fingerslip.report import colours as palette
from fingerslip.report.figures import style, time_axis
from fingerslip.report.figures.patches import fill_states, slide_moments
from fingerslip.report.labels import of_histories
from fingerslip.report.scene import scene
from fingerslip.report.scene.names import Scalar
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import Events, contact_patch, slide_tangent, slide_window
from fingerslip.slip.windows import EVENTS, MAIN_EVENTS, travel_direction
from fingerslip.snapshot import curved_points, faces_at

_SKIN_WIDTH = 3.2
_MARGIN = 0.06
_CURVED = 0.2  # of the largest extent of the body: how far below its contact a curved counterface is seen
_MOVES = 1e-3  # share of its way from which on a plate is drawn as one that slides


def has_pictures(history: xr.Dataset) -> bool:
    """Tell whether there is something to see of the contact: records do in 3D, sections need snapshots."""
    return is_solid(history) or history.sizes.get("snapshot_time", 0) > 0


def picture_axis(history: xr.Dataset) -> str:
    """Return the times at which :func:`draw_contact` can: of records in 3D, of snapshots in 2D."""
    return "time" if is_solid(history) else "snapshot_time"


def draw_contact(axes: Axes, history: xr.Dataset, number: int, *, scaled: bool = True) -> None:
    """Draw the contact at one of its times: the section that is pressed in 2D, in 3D what sticks, from below."""
    if is_solid(history):
        fill_states(axes, contact_patch(history), history, number)
        axes.set_axis_off()
    else:
        draw_section(axes, history, number, "von_mises", scene.field_limits(history, SceneOptions()), scaled=False)
    if scaled:
        _draw_scale(axes, above=True)


def add_field_bar(figure: Figure, panels: Sequence[Axes], label: str, limits: tuple[float, float], **look: Any) -> None:
    """Put a bar of the colours of a field beside panels."""
    colours = ScalarMappable(Normalize(*limits), palette.field_map(limits))
    extend = "both" if limits[0] else "max"
    figure.colorbar(colours, ax=list(panels), label=label, extend=extend, shrink=0.8, **look)


def add_stress_bar(figure: Figure, pictures: Sequence[Axes], history: xr.Dataset) -> None:
    """Put a bar of the stress beside pictures of :func:`draw_contact`, where they show it: in 2D."""
    if not is_solid(history):
        add_field_bar(figure, pictures, "von Mises\n[kPa]", scene.field_limits(history, SceneOptions()), pad=0.01)


def frame_times(history: xr.Dataset, events: Events, names: Sequence[str] = MAIN_EVENTS) -> dict[float, str]:
    """Return times to show [s] and what happens then: the start of the slide and events; none without a slide."""
    window = slide_window(history)
    times = time_axis.event_times(events.slip, names)
    return {} if window is None else {window.start: "start of slide", **{times[name]: EVENTS[name] for name in times}}


def picture_keys(history: xr.Dataset) -> dict[str, Artist]:
    """Return keys of the states that :func:`draw_contact` shows, for a legend."""
    return style.state_keys((STICK, SLIP, OPEN) if is_solid(history) else (STICK, SLIP))


@style.with_style
def deformed_figure(
    history: xr.Dataset,
    events: Events = time_axis.NO_EVENTS,
    options: SceneOptions | None = None,
    times: Sequence[float] | Floats | None = None,
    heading: str = "",
) -> Figure:
    """Draw the deformed body with a field, a panel for each time [s]: sections to scale, or lit views of a solid."""
    solid = is_solid(history)
    options = options or SceneOptions(cut=scene.middle_cut(history), receptors=False, written=False)
    scene.check_options(history, options)
    moments, every = dict.fromkeys([] if times is None else times, ""), history["snapshot_time"].values
    if times is None:
        even = every[-1:] if solid else np.linspace(every[0], every[-1], min(4, every.size))
        named = ("incipient", "overall") if solid else MAIN_EVENTS
        moments = frame_times(history, events, named) or {float(time): "" for time in even}
    numbers, field = time_axis.titles_at(history, moments, "snapshot_time"), SCALARS[options.scalar][0]
    words = f"Deformed {'body' if solid else 'section'}, {field.partition(' [')[0]}"
    columns = style.columns_for(len(numbers))
    letters = columns if style.is_narrow() else 1
    pictures = style.crop(stills(history, list(numbers), options, (1200, 900), letters)) if solid else []
    low, high = (np.zeros(2), pictures[0].shape[1::-1]) if solid else section_frame(history)
    wide, titled, share = (3.2, 0.35, "none") if solid else (3.4, 0.05, "all")
    wide = wide if columns > 1 else 6.0
    size = (wide, wide * float((high - low)[1] / (high - low)[0]) + titled)
    figure, panels = style.figure_grid(len(numbers), columns, size, heading or words, ("", ""), share=share)
    limits = scene.field_limits(history, options)
    for index, (axes, (number, name)) in enumerate(zip(panels, numbers.items(), strict=True)):
        if solid:
            style.show_picture(axes, pictures[index])
        else:
            draw_section(axes, history, number, options.scalar, limits, scaled=axes is panels[-1])
        style.name_panel(axes, name)
    keys: dict[str, Artist] = {}
    if options.scalar == "region":
        keys = style.layer_keys(palette.region_colours(scene.region_names(history)), palette.BLACK, linewidth=0.3)
    else:
        add_field_bar(figure, panels, field, limits, pad=0.01)
    if options.contact or not solid:
        keys |= style.state_keys((STICK, SLIP))
    if solid and options.receptors and site_kinds(history).size:
        keys["recorded sites"] = Line2D([], [], color=palette.BLACK, marker="o", markersize=4.0, linestyle="none")
    style.add_legend(figure, keys)
    return figure


def extent(history: xr.Dataset) -> tuple[Floats, Floats]:
    """Return two corners (dim,) [mm] around the body at all snapshots, and a part of curved counterfaces."""
    moving = history["node_position"].values + history["snapshot_displacement"].values
    depth = _CURVED * float(np.ptp(history["node_position"].values, axis=0).max())
    points = np.concatenate([moving.min(axis=0), moving.max(axis=0), curved_points(history, depth)])
    return 1e3 * points.min(axis=0), 1e3 * points.max(axis=0)


def section_frame(history: xr.Dataset) -> tuple[Floats, Floats]:
    """Return two corners (2,) [mm] around a section and its plate at all snapshots: panels compare, no film jumps."""
    low, high = extent(history)
    margin = _MARGIN * (high - low).max()
    return low - margin * np.array([1.0, 2.5]), high + margin


def draw_section(
    axes: Axes, history: xr.Dataset, number: int, scalar: Scalar, limits: tuple[float, float], *, scaled: bool = True
) -> None:
    """Draw a snapshot of a section: its field, layers, the state of its contact, the plate and a scale bar."""
    points = 1e3 * (history["node_position"].values + history["snapshot_displacement"].values[number])
    cells = history["cell_nodes"].values[:, : scene.CORNERS[history.attrs["element"]]]
    names, regions = scene.region_names(history), history["cell_region"].values
    colours, soft = palette.region_colours(names), scene.soft_regions(history)
    of_cells = scalar in scene.OF_CELLS
    for region, name in enumerate(names):
        corners = cells[regions == region]
        if scalar == "region" or (of_cells and region not in soft):
            colour = colours[name] if scalar == "region" else palette.STIFF_COLOUR
            look: dict[str, Any] = {"facecolors": colour, "edgecolors": "face", "linewidth": 0.2, "rasterized": True}
            axes.add_collection(PolyCollection(points[corners], **look))
        elif corners.size:
            values = SCALARS[scalar][1] * scene.field_values(history, scalar, number)
            if of_cells:
                # Means at the nodes of a layer, of what its cells have.
                nodes, weights = corners.ravel(), np.repeat(values[regions == region], corners.shape[1])
                counts, sums = (np.bincount(nodes, each, len(points)) for each in (None, weights))
                field = sums / np.maximum(counts, 1)
            else:
                field = np.linalg.norm(values, axis=1)
            triangles = np.concatenate([corners[:, [0, at, at + 1]] for at in range(1, corners.shape[1] - 1)])
            look = {"shading": "gouraud", "cmap": palette.field_map(limits), "norm": Normalize(*limits)}
            look["rasterized"] = True
            axes.tripcolor(Triangulation(points[:, 0], points[:, 1], triangles), field, **look)
    lines = points[_layer_edges(cells, regions)]
    axes.add_collection(LineCollection(list(lines), colors=palette.LAYER_LINE, linewidths=0.5, capstyle="round"))
    axes.set_aspect("equal")
    axes.set_axis_off()
    low, high = section_frame(history)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    _draw_plates(axes, history, number)
    _draw_skin(axes, history, number, points)
    if scaled:
        _draw_scale(axes)


def _layer_edges(cells: NDArray[np.integer], regions: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return the edges (m, 2) of cells (n, k) that bound a region: no second cell of it has them."""
    size = np.int64(cells.max()) + 1
    low, high = np.sort([cells, np.roll(cells, -1, axis=1)], axis=0)
    # As numbers, which sort ten times as fast as rows.
    numbers, counts = np.unique((regions[:, None] * size + low) * size + high, return_counts=True)
    return np.stack(divmod(np.unique(numbers[counts == 1] % size**2), size), axis=1)


def _draw_scale(axes: Axes, *, above: bool = False) -> None:
    """Draw a bar of a round length in millimetres at the lower right, or at the right above a small panel."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    length = scene.scale_length(right - left)
    end = right - 0.02 * (right - left)
    level = bottom + (1.04 if above else 0.03) * (top - bottom)
    line: dict[str, Any] = {"color": palette.BLACK, "linewidth": 2.0, "solid_capstyle": "butt", "zorder": 6}
    axes.plot([end - length, end], [level, level], clip_on=not above, **line)
    axes.set(xlim=(left, right), ylim=(bottom, top))
    look = {"ha": "right" if above else "center", "va": "bottom", "fontsize": mpl.rcParams["legend.fontsize"]}
    across = end if above else end - 0.5 * length
    axes.text(across, level + 0.02 * (top - bottom), f"{length:g} mm", **look)


def _draw_skin(axes: Axes, history: xr.Dataset, number: int, points: Floats) -> None:
    """Draw the touching skin as a smooth line in the colours of stick and slip, lonely nodes as dots."""
    nodes = history["contact_node"].values
    states = history["contact_state"].values[nearest_record(history, float(history["snapshot_time"][number]))]
    order = np.argsort(history["contact_position"].values[:, 0])
    joined = np.stack([order[:-1], order[1:]], axis=1)
    joined = joined[(states[joined] != OPEN).all(axis=1)]
    for state in (STICK, SLIP):
        lines = points[nodes[joined[states[joined].max(axis=1) == state]]]
        look: dict[str, Any] = {"zorder": 4 + state}
        dots = points[nodes[states == state]]
        axes.plot(*dots.T, "o", color=palette.STATE_COLOURS[state], markersize=_SKIN_WIDTH, markeredgewidth=0.0, **look)
        axes.add_collection(
            LineCollection(list(lines), colors=palette.STATE_COLOURS[state], linewidths=_SKIN_WIDTH, **look)
        )


def _draw_plates(axes: Axes, history: xr.Dataset, number: int) -> None:
    left, right = axes.get_xlim()
    for face in faces_at(history, number, 1e-3 * (right - left)):
        along = travel_direction(history, face.number)
        for line in face.outline:
            axes.plot(*1e3 * line[:, :2].T, color=palette.BLACK, linewidth=1.4, zorder=3)
        travel = history["counterface_displacement"].values[:, face.number] @ along
        now = travel[nearest_record(history, float(history["snapshot_time"][number]))]
        if abs(now) > _MOVES * np.abs(travel).max():
            middle = 1e3 * face.centre[:2] - 0.06 * (right - left) * face.normal[:2]
            half = 0.09 * (right - left) * along
            look = {"arrowstyle": "-|>", "color": palette.BLACK, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", xy=tuple(middle + half), xytext=tuple(middle - half), arrowprops=look)


_CUT_FRAMES = 6


def cut_frames_figure(history: xr.Dataset, events: Events = time_axis.NO_EVENTS, title: str = "") -> Figure:
    """Draw the inside of the finger at six snapshots from the end of the press to after overall slip."""
    options = SceneOptions(cut=scene.middle_cut(history), camera="side", receptors=False, written=False)
    heading = style.join_title("Stress on a cut along the finger", title)
    moments = time_axis.times_near(history, slide_moments(history, events, _CUT_FRAMES), "snapshot_time")
    return deformed_figure(history, events, options, moments, heading)


def scene_figure(history: xr.Dataset, title: str) -> Figure:
    """Draw the layers of a solid, cut open, at the start."""
    options = SceneOptions(scalar="region", cut=scene.middle_cut(history), edges=True, written=False)
    heading = style.join_title("Layers and mesh at the start, cut open", title)
    return deformed_figure(history, time_axis.NO_EVENTS, options, [0.0], heading)


_JERK = 0.05  # s
_NODE_COLUMNS = 4
# Darker than the lines, so that small letters can be read.
ORANGE_TEXT = "#8a5a00"


@style.with_style
def reference_nodes_figure(history: xr.Dataset, events: Events = time_axis.NO_EVENTS, title: str = "") -> Figure:
    """Draw displacement and acceleration of the recorded reference nodes along the slide, a panel for each node."""
    rows = sites_of_kinds(history, reference_kinds(history))
    if not rows.size:
        raise ResultError("the result has no reference nodes; write record: {reference_nodes: true} and run again")
    labels = ("time [s]", "displacement along the slide [mm]")
    heading = style.join_title("Reference nodes along the slide", title)
    figure, panels = style.figure_grid(len(rows), _NODE_COLUMNS, (2.2, 1.35), heading, labels)
    tangent, window, times = slide_tangent(history), slide_window(history), history["time"].values
    along = 1e3 * history["displacement"].values @ tangent
    acceleration = np.array(history["acceleration"].values @ tangent)
    plate = 1e3 * history["counterface_displacement"].values[:, 0] @ tangent
    # Accelerations in the jerk at the start of the slide are far larger than others.
    jerk = (times >= window.start) & (times <= window.start + _JERK) if window else np.zeros(times.size, dtype=bool)
    acceleration[jerk & ~jerk.all()] = np.nan
    top = 1.3 * float(np.nanmax(np.abs(acceleration[:, rows]), initial=0.0)) or 1.0
    for number, (axes, row) in enumerate(zip(panels, rows, strict=True)):
        axes.plot(times, along[:, row], color=palette.BLUE)
        axes.plot(times, plate, color=palette.BLACK, linestyle=":", linewidth=1.0)
        kind = str(site_kinds(history)[row]).removesuffix(" surface")
        axes.set_title(f"{str(history['site'].values[row]).rpartition('-')[2]}, {kind}")
        time_axis.mark_panels([axes], history, events.slip, named=0)
        # Accelerations have their axis at the right, which is labelled beside the first row.
        right: Axes = axes.twinx()
        right.set_ylim(-top, top)
        right.grid(visible=False)
        right.spines["right"].set_visible(True)
        is_labelled = number == min(_NODE_COLUMNS, len(rows)) - 1
        right.tick_params(colors=ORANGE_TEXT, labelright=is_labelled)
        right.set_ylabel("acceleration [m/s²]" if is_labelled else "", color=ORANGE_TEXT)
        right.plot(times, acceleration[:, row], color=palette.ORANGE, linewidth=0.7)
    reach = 1.2 * float(np.abs(along[:, rows]).max()) or 1.0
    panels[0].set_ylim(*((-reach, 0.1 * reach) if plate.sum() < 0.0 else (-0.1 * reach, reach)))
    keys: dict[str, Artist] = {
        "displacement": Line2D([], [], color=palette.BLUE),
        of_histories("plate", [history]): Line2D([], [], color=palette.BLACK, linestyle=":", linewidth=1.0),
        "acceleration (without the jerk at the start)": Line2D([], [], color=palette.ORANGE, linewidth=0.9),
    }
    style.add_legend(figure, keys | (time_axis.event_keys([events.slip]) if window else {}))
    return figure
