"""The deformed body in 2D and 3D: sections and lit views with a field, cuts, its contact seen from below, its nodes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
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
from matplotlib.patches import Patch
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from fingerslip.contact.frames import sliding_direction
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import ResultError
from fingerslip.history import is_solid, nearest_record, nearest_snapshot, site_kinds, sites_of_kinds
from fingerslip.report import colours as palette
from fingerslip.report.figures import style
from fingerslip.report.scene.names import Scalar
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import (
    CORNERS,
    OF_CELLS,
    check_options,
    contact_levels,
    field_limits,
    middle_cut,
    region_names,
    scale_length,
    soft_regions,
)
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import (
    Events,
    contact_patch,
    patch_series,
    slide_tangent,
    slide_window,
    surface_strain_rates,
    surface_strains,
)
from fingerslip.slip.patch import Patch as ContactPatch
from fingerslip.slip.patch import triangle_states
from fingerslip.slip.windows import EVENTS, MAIN_EVENTS, counterface_normal
from fingerslip.snapshot import flat_faces

Floats = NDArray[np.float64]
Pixels = NDArray[np.uint8]

_SKIN_WIDTH = 3.2
_MARGIN = 0.06


def has_pictures(history: xr.Dataset) -> bool:
    """Tell whether there is something to see of the contact: records do in 3D, sections need snapshots."""
    return is_solid(history) or history.sizes.get("snapshot_time", 0) > 0


def draw_contact(axes: Axes, history: xr.Dataset, moment: float, *, scaled: bool = True) -> None:
    """Draw the contact at about a time [s]: the section that is pressed in 2D, in 3D what sticks, from below."""
    if is_solid(history):
        fill_states(axes, contact_patch(history), history, nearest_record(history, moment))
        axes.set_axis_off()
    else:
        limits = field_limits(history, SceneOptions())
        draw_section(axes, history, nearest_snapshot(history, moment), "von_mises", limits, scaled=False)
    if scaled:
        _draw_scale(axes)


def contact_keys(history: xr.Dataset) -> dict[str, Artist]:
    """Return the keys of what :func:`draw_contact` draws; the stress of sections is light at zero, dark at its end."""
    keys = style.state_keys((STICK, SLIP))
    if not is_solid(history):
        _, top = field_limits(history, SceneOptions())
        keys[f"von Mises stress, light 0 to dark {top:.2g} kPa"] = Patch(color=mpl.colormaps[palette.FIELD_MAP](0.5))
    return keys


def frame_times(history: xr.Dataset, events: Events, names: Sequence[str] = MAIN_EVENTS) -> dict[float, str]:
    """Return times to show [s] and what happens then: the start of the slide and events; none without a slide."""
    window = slide_window(history)
    times = style.event_times(events.slip, names)
    return {} if window is None else {window.start: "start of slide", **{times[name]: EVENTS[name] for name in times}}


def snapshots_at(history: xr.Dataset, moments: Mapping[float, str]) -> dict[int, str]:
    """Return the snapshots nearest to times [s], each once: their own times, how far from what happens."""
    titles: dict[int, str] = {}
    for moment, words in moments.items():
        number = nearest_snapshot(history, float(moment))
        time = float(history["snapshot_time"][number])
        apart = round(1e3 * (time - moment))
        away = f"{abs(apart)} ms {'before' if apart < 0 else 'after'} " if apart else ""
        titles[number] = ", ".join(filter(None, (titles.get(number, f"{time:.3f} s"), words and away + words)))
    return titles


@style.with_style
def deformed_figure(
    history: xr.Dataset,
    events: Events = style.NO_EVENTS,
    options: SceneOptions | None = None,
    times: Sequence[float] | Floats | None = None,
    title: str = "",
    *,
    heading: str = "",
) -> Figure:
    """Draw the deformed body with a field, a panel for each time [s]: sections to scale, or lit views of a solid."""
    solid, options = is_solid(history), options or SceneOptions(cut=middle_cut(history), receptors=False, written=False)
    check_options(history, options)
    moments, every = dict.fromkeys([] if times is None else times, ""), history["snapshot_time"].values
    if times is None:
        even = every[-1:] if solid else np.linspace(every[0], every[-1], min(4, every.size))
        named = ("incipient", "overall") if solid else MAIN_EVENTS
        moments = frame_times(history, events, named) or {float(time): "" for time in even}
    numbers, field = snapshots_at(history, moments), SCALARS[options.scalar][0]
    words = f"Deformed {'body' if solid else 'section'}, {field.partition(' [')[0]}"
    heading = heading or style.join_title(words, title)
    figure, panels = (_draw_views if solid else _draw_sections)(history, list(numbers), options, heading)
    for axes, name in zip(panels, numbers.values(), strict=True):
        style.name_panel(axes, name, style.columns_for(len(numbers)))
    keys = style.region_keys(region_names(history)) if options.scalar == "region" else {}
    if options.scalar != "region":
        style.add_field_bar(figure, panels, field, field_limits(history, options))
    if options.contact or not solid:
        keys |= style.state_keys((STICK, SLIP))
    if solid and options.receptors and site_kinds(history).size:
        keys["recorded sites"] = Line2D([], [], color=palette.BLACK, marker="o", markersize=4.0, linestyle="none")
    style.add_legend(figure, keys)
    return figure


def _draw_views(
    history: xr.Dataset, numbers: Sequence[int], options: SceneOptions, heading: str
) -> tuple[Figure, list[Axes]]:
    pictures, columns = crop(stills(history, numbers, options, (1200, 900))), style.columns_for(len(numbers))
    (height, width, _), wide = pictures[0].shape, 3.2 if columns > 1 else 6.0
    size = (wide, wide * height / width + 0.35)
    figure, panels = style.figure_grid(len(numbers), columns, size, heading, ("", ""), share="none")
    for axes, picture in zip(panels, pictures, strict=True):
        style.show_picture(axes, picture)
    return figure, panels


def _draw_sections(
    history: xr.Dataset, numbers: Sequence[int], options: SceneOptions, heading: str
) -> tuple[Figure, list[Axes]]:
    columns, (low, high) = style.columns_for(len(numbers)), section_frame(history)
    wide, limits = 3.4 if columns > 1 else 6.0, field_limits(history, options)
    size = (wide, wide * float((high - low)[1] / (high - low)[0]) + 0.3)
    figure, panels = style.figure_grid(len(numbers), columns, size, heading, ("", ""))
    for axes, number in zip(panels, numbers, strict=True):
        draw_section(axes, history, number, options.scalar, limits)
    return figure, panels


def section_frame(history: xr.Dataset) -> tuple[Floats, Floats]:
    """Return two corners (2,) [mm] around a section and its plate at all snapshots: panels compare, no film jumps."""
    moving = 1e3 * (history["node_position"].values + history["snapshot_displacement"].values)
    low, high = moving.min(axis=(0, 1)), moving.max(axis=(0, 1))
    margin = _MARGIN * (high - low).max()
    return low - margin * np.array([1.0, 2.5]), high + margin


def draw_section(
    axes: Axes, history: xr.Dataset, number: int, scalar: Scalar, limits: tuple[float, float], *, scaled: bool = True
) -> None:
    """Draw a snapshot of a section: its field, layers, the state of its contact, the plate and a scale bar."""
    points = 1e3 * (history["node_position"].values + history["snapshot_displacement"].values[number])
    cells = history["cell_nodes"].values[:, : CORNERS[history.attrs["element"]]]
    names, regions = region_names(history), history["cell_region"].values
    colours, soft = palette.region_colours(names), soft_regions(history)
    of_cells = scalar in OF_CELLS
    for region, name in enumerate(names):
        corners = cells[regions == region]
        if scalar == "region" or (of_cells and region not in soft):
            colour = colours[name] if scalar == "region" else palette.STIFF_COLOUR
            look: dict[str, Any] = {"facecolors": colour, "edgecolors": "face", "linewidth": 0.2, "rasterized": True}
            axes.add_collection(PolyCollection(list(points[corners]), **look))
        elif corners.size:
            values = SCALARS[scalar][1] * history[f"snapshot_{scalar}"].values[number]
            if of_cells:
                field = _node_means(corners, values[regions == region], len(points))
            else:
                field = np.linalg.norm(values, axis=1)
            triangles = np.concatenate([corners[:, [0, at, at + 1]] for at in range(1, corners.shape[1] - 1)])
            look = {"shading": "gouraud", "cmap": palette.FIELD_MAP, "norm": Normalize(*limits), "rasterized": True}
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


def _node_means(corners: NDArray[np.integer], values: Floats, count: int) -> Floats:
    """Return the means at nodes (count,) of values (n,) of cells with corners (n, k)."""
    nodes, weights = corners.ravel(), np.repeat(values, corners.shape[1])
    return np.bincount(nodes, weights, count) / np.maximum(np.bincount(nodes, minlength=count), 1)


def _layer_edges(cells: NDArray[np.integer], regions: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return the edges (m, 2) of cells (n, k) that bound a region: no second cell of it has them."""
    edges = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    named, counts = np.unique(np.column_stack([edges, np.repeat(regions, cells.shape[1])]), axis=0, return_counts=True)
    return np.unique(named[counts == 1, :2], axis=0)


def _draw_scale(axes: Axes) -> None:
    """Draw a bar of a round length in millimetres below at the right."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    length = scale_length(right - left)
    end, level = right - 0.02 * (right - left), bottom + 0.03 * (top - bottom)
    axes.plot([end - length, end], [level, level], color=palette.BLACK, linewidth=2.0, solid_capstyle="butt", zorder=6)
    look = {"ha": "center", "va": "bottom", "fontsize": mpl.rcParams["legend.fontsize"]}
    axes.text(end - 0.5 * length, level + 0.01 * (top - bottom), f"{length:g} mm", **look)


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
    for face in flat_faces(history, number):
        along = np.array([face.normal[1], -face.normal[0]])
        ends = 1e3 * face.centre[:2] + (right - left) * np.array([[-1.0], [1.0]]) * along
        axes.plot(ends[:, 0], ends[:, 1], color=palette.BLACK, linewidth=1.4, zorder=3)
        travel = history["counterface_displacement"].values[:, face.number] @ along
        sign = float(np.sign(np.round(travel[np.abs(travel).argmax()], 9)))
        if sign:
            middle = 1e3 * face.centre[:2] - 0.06 * (right - left) * face.normal[:2]
            half = 0.09 * (right - left) * sign * along
            look = {"arrowstyle": "-|>", "color": palette.BLACK, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", xy=tuple(middle + half), xytext=tuple(middle - half), arrowprops=look)


_CUT_FRAMES = 6
_WHITE = 250


def cut_frames_figure(history: xr.Dataset, events: Events = style.NO_EVENTS, title: str = "") -> Figure:
    """Draw the inside of the finger at six snapshots from the end of the press to after overall slip."""
    options = SceneOptions(cut=middle_cut(history), camera="side", receptors=False, written=False)
    heading = style.join_title("Stress on a cut along the finger", title)
    return deformed_figure(history, events, options, slide_moments(history, events, _CUT_FRAMES), heading=heading)


def scene_figure(history: xr.Dataset, title: str) -> Figure:
    """Draw the layers of a solid, cut open, at the start."""
    options = SceneOptions(scalar="region", cut=middle_cut(history), edges=True, written=False)
    heading = style.join_title("Layers and mesh at the start, cut open", title)
    return deformed_figure(history, options=options, times=[0.0], heading=heading)


def crop(pictures: Iterable[Pixels]) -> list[Pixels]:
    """Cut the white margins off pictures (height, width, 3) of one size, the same off all of them."""
    whole = list(pictures)
    inked = np.any([(picture < _WHITE).any(axis=2) for picture in whole], axis=0)
    rows, columns = np.flatnonzero(inked.any(axis=1)), np.flatnonzero(inked.any(axis=0))
    if rows.size == 0:
        return whole
    return [picture[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] for picture in whole]


_STRAIN_NAMES = {"along": "strain along the slide", "across": "strain across the slide", "shear": "shear strain"}
_APART = (0.92, 0.93, 0.94, 1.0)
_LABELS = ("along the slide [mm]", "across the slide [mm]")
_FRAMES = 9
_STRAIN_FRAMES = 4
_AROUND = 0.8  # mm


@style.with_style
def slip_frames_figure(
    history: xr.Dataset, events: Events = style.NO_EVENTS, times: Sequence[float] | None = None, title: str = ""
) -> Figure:
    """Draw where the contact sticks and slips, in frames over time [s]."""
    patch = contact_patch(history)
    moments = _moments_with_events(history, events) if times is None else np.asarray(times, dtype=float)
    heading = style.join_title("Stick and slip of the contact, seen from below", title)
    figure, panels = style.figure_grid(len(moments), 3, _panel_size(history, patch, 2.6), heading, _LABELS)
    events_read = style.event_times(events.slip)
    for axes, moment, before in zip(panels, moments, [np.inf, *moments[:-1]], strict=True):
        fill_states(axes, patch, history, nearest_record(history, moment))
        passed = ", ".join(EVENTS[name] for name, time in events_read.items() if before < time <= moment)
        axes.set_title(f"{moment:.3f} s{f', after {passed}' if passed else ''}")
    style.add_legend(figure, style.state_keys((STICK, SLIP, OPEN)))
    return figure


@style.with_style
def surface_strain_figure(
    history: xr.Dataset, events: Events = style.NO_EVENTS, component: str = "along", title: str = ""
) -> Figure:
    """Draw the Green-Lagrange strain of the skin surface and its rate over the contact at four times of the slide."""
    patch = contact_patch(history)
    strains = surface_strains(history, patch).sel(strain_component=component)
    moments, name = slide_moments(history, events, _STRAIN_FRAMES), _STRAIN_NAMES[component]
    heading = style.join_title(f"Green-Lagrange {name}, and its rate, seen from below", title)
    size = _panel_size(history, patch, 2.5)
    figure, panels = style.figure_grid(2 * len(moments), len(moments), size, heading, _LABELS)
    fields = ((strains, f"{name} [%]"), (surface_strain_rates(strains), "its rate [%/s]"))
    for row, (field, label) in enumerate(fields):
        row_panels = panels[row * len(moments) : (row + 1) * len(moments)]
        colours = _draw_fields(row_panels, history, patch, 100.0 * field, moments)
        figure.colorbar(colours, ax=list(row_panels), label=label, shrink=0.9, extend="both")
    return figure


def _draw_fields(
    panels: Sequence[Axes], history: xr.Dataset, patch: ContactPatch, field: xr.DataArray, moments: Floats
) -> ScalarMappable:
    """Draw a field on the triangles in contact at some times, in colours that share one scale about zero."""
    steps = [nearest_record(history, moment) for moment in moments]
    touching = field["touching"].values
    sizes = np.concatenate([np.abs(field.values[step][touching[step]]) for step in steps] + [np.zeros(1)])
    top = float(np.quantile(sizes, 0.98)) or 1.0
    colours = ScalarMappable(Normalize(-top, top), "RdBu_r")
    for axes, moment, step in zip(panels, moments, steps, strict=True):
        paint = colours.to_rgba(field.values[step])
        paint[~touching[step]] = _APART
        _fill_patch(axes, patch, history, paint)
        axes.set_title(f"{moment:.3f} s")
    return colours


def fill_states(axes: Axes, patch: ContactPatch, history: xr.Dataset, step: int) -> None:
    """Fill what is open, slips and sticks; the edges are where pressure ends and the tractions reach their limit."""
    touch, stick = contact_levels(history, patch, step)
    _fill_patch(axes, patch, history, palette.STATE_COLOURS[OPEN])
    for state, level in ((SLIP, touch), (STICK, stick)):
        if level.max() > 0.0:
            levels, colour = [0.0, level.max()], palette.STATE_COLOURS[state]
            mesh = Triangulation(1e3 * patch.points[:, 0], 1e3 * patch.points[:, 1], patch.triangles)
            axes.tricontourf(mesh, level, levels=levels, colors=[colour])


def _fill_patch(axes: Axes, patch: ContactPatch, history: xr.Dataset, colours: str | Floats) -> None:
    """Fill the triangles of the patch and frame what ever touches."""
    _fill_triangles(axes, 1e3 * patch.points[patch.triangles], colours)
    _set_frame(axes, *_touched_frame(history, patch, patch.points))


def _fill_triangles(axes: Axes, corners: Floats, colours: str | Floats) -> None:
    """Fill triangles (n, 3, 2) [mm] without borders between them."""
    axes.add_collection(PolyCollection(list(corners), facecolors=colours, edgecolors="face", linewidths=0.2))


def _set_frame(axes: Axes, low: Floats, high: Floats) -> None:
    axes.grid(visible=False)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")


def _touched_frame(history: xr.Dataset, patch: ContactPatch, points: Floats) -> tuple[Floats, Floats]:
    """Return two corners (2,) [mm] around all points (n, 2) [m] that ever touch, or around all where none does."""
    ever = (history["contact_state"].values[:, patch.nodes] != OPEN).any(axis=0)
    framed = 1e3 * (points[ever] if ever.any() else points)
    return framed.min(axis=0) - _AROUND, framed.max(axis=0) + _AROUND


def _panel_size(history: xr.Dataset, patch: ContactPatch, width: float) -> tuple[float, float]:
    """Return the size of a panel [inch] that the patch fills, with room for title and labels."""
    low, high = _touched_frame(history, patch, patch.points)
    return width, min(max((width - 0.4) * (high[1] - low[1]) / (high[0] - low[0]), 1.0), 3.0) + 0.5


def slide_moments(history: xr.Dataset, events: Events, count: int) -> Floats:
    """Return times of records from the start of the slide to shortly after overall slip, or all of a run without it."""
    times = history["time"].values
    window = slide_window(history)
    start, end = (window.start, window.end) if window else (float(times[0]), float(times[-1]))
    if events.overall is not None:
        end = min(end, events.overall + 0.1 * (events.overall - start))
    moments: Floats = times[[nearest_record(history, moment) for moment in np.linspace(start, end, count)]]
    return moments


def _moments_with_events(history: xr.Dataset, events: Events) -> Floats:
    """Return evenly spaced times, the nearest ones moved to the first records after the events."""
    moments, times = slide_moments(history, events, _FRAMES), history["time"].values
    free = np.arange(1, moments.size)
    for event in style.event_times(events.slip).values():
        if not moments[0] < event <= moments[-1] or free.size == 0:
            continue
        record = times[min(int(np.searchsorted(times, event)), times.size - 1)]
        chosen = free[np.abs(moments[free] - record).argmin()]
        moments[chosen] = record
        free = free[free != chosen]
    return np.sort(moments)


_COLUMNS, _WIDTH = 4, 2.0
_STUCK = (0.12, 0.16, 0.2, 1.0)
_ARROW = 0.3


@style.with_style
def slip_onset_figure(histories: Mapping[str, xr.Dataset], counterface: int = 0) -> Figure:
    """Draw when each part of the contact slips for good, a panel for each run, all in the same axes of the plate."""
    patches = {title: contact_patch(history, counterface) for title, history in histories.items()}
    onsets = {title: _onsets(history, patches[title]) for title, history in histories.items()}
    latest = max((float(np.nanmax(times, initial=0.0)) for times in onsets.values()), default=0.0)
    colours = ScalarMappable(Normalize(0.0, latest or 1.0), "viridis_r")
    # Two axes of the plate that do not depend on the slide.
    normal = counterface_normal(next(iter(histories.values())), counterface)
    plate = np.array([first := sliding_direction(normal), np.cross(first, normal)])
    points = {
        title: history["contact_position"].values[patches[title].nodes] @ plate.T
        for title, history in histories.items()
    }
    frames = [_touched_frame(history, patches[title], points[title]) for title, history in histories.items()]
    low, high = np.min([first for first, _ in frames], axis=0), np.max([last for _, last in frames], axis=0)
    size = _WIDTH, min(_WIDTH * (high[1] - low[1]) / (high[0] - low[0]), 3.0) + 0.4
    along, across = (f"{'xyz'[int(np.abs(axis).argmax())]} [mm]" for axis in plate)
    heading = "When each part of the contact slips for good, seen from below"
    figure, panels = style.figure_grid(len(histories), min(_COLUMNS, len(histories)), size, heading, (along, across))
    for axes, (title, times) in zip(panels, onsets.items(), strict=True):
        paint, touched = colours.to_rgba(times), ~(times < 0.0)
        paint[np.isnan(times)] = _STUCK
        _fill_triangles(axes, 1e3 * points[title][patches[title].triangles][touched], paint[touched])
        # The direction of the plate over the middle of the panel.
        half = 0.5 * _ARROW * float(np.min(high - low)) * (patches[title].axes[0] @ plate.T)
        start, end = (tuple(0.5 * (low + high) + sign * half) for sign in (-1.0, 1.0))
        look = {"arrowstyle": "-|>", "color": palette.BLACK, "linewidth": 1.6}
        axes.annotate("", xy=end, xytext=start, arrowprops=look, zorder=5)
        _set_frame(axes, low, high)
        axes.set_title(title)
    figure.colorbar(colours, ax=list(panels), label="time into the slide [s]", shrink=0.8)
    return figure


def _onsets(history: xr.Dataset, patch: ContactPatch) -> Floats:
    """Return the time from the start of the slide at which each triangle has stuck for the last time [s].

    NaN where it sticks to the end, minus one where it never touches during the slide.
    """
    window = slide_window(history)
    times = history["time"].values
    records = np.arange(times.size)[window.records] if window else np.arange(times.size)
    states = np.stack([triangle_states(history, patch, int(record)) for record in records])
    sticks = states == STICK
    last = sticks.shape[0] - 1 - sticks[::-1].argmax(axis=0)
    following = np.minimum(last + 1, records.size - 1)
    onset = np.where(sticks.any(axis=0), times[records[following]] - times[records[0]], 0.0)
    onset[sticks[-1]] = np.nan
    onset[(states == OPEN).all(axis=0)] = -1.0
    return np.asarray(onset, dtype=float)


@style.with_style
def stick_ratio_figure(histories: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Draw the stick ratio against the tangential force over the normal force."""
    heading = style.join_title("Stick ratio against tangential force", title)
    labels = ("tangential force / normal force", "sticking share of the contact area")
    figure, (axes,) = style.figure_grid(1, 1, (5.2, 3.4), heading, labels)
    for name, history in histories.items():
        window, series = slide_window(history), patch_series(history)
        chosen = series.isel(time=window.records) if window else series
        axes.plot(chosen["force_ratio"], chosen["stick_ratio"], label=name, linewidth=1.4)
    axes.set_ylim(-0.03, 1.03)
    if len(histories) > 1:
        axes.legend(fontsize=8)
    return figure


_JERK = 0.05  # s
_NODE_COLUMNS = 4
# Darker than the lines, so that small letters can be read.
ORANGE_TEXT = "#8a5a00"


def reference_kinds(history: xr.Dataset) -> list[str]:
    """Return the kinds of the recorded reference nodes, those that end in ``surface``."""
    return [kind for kind in dict.fromkeys(map(str, site_kinds(history))) if kind.endswith("surface")]


@style.with_style
def reference_nodes_figure(history: xr.Dataset, events: Events = style.NO_EVENTS, title: str = "") -> Figure:
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
        style.mark_run(axes, history, events.slip)
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
        "plate": Line2D([], [], color=palette.BLACK, linestyle=":", linewidth=1.0),
        "acceleration (without the jerk at the start)": Line2D([], [], color=palette.ORANGE, linewidth=0.9),
    }
    style.add_legend(figure, keys | (style.event_keys([events.slip]) if window else {}))
    return figure
