"""The deformed body at several times: sections with a field, lit views in 3D, cuts with their stress."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import is_solid, nearest_record, nearest_snapshot, site_kinds
from fingerslip.report.colours import BLACK, FIELD_MAP, STATE_COLOURS, region_colours
from fingerslip.report.figures.marks import NO_EVENTS, event_times
from fingerslip.report.figures.style import (
    add_field_bar,
    add_legend,
    columns_for,
    figure_grid,
    join_title,
    name_panel,
    region_keys,
    show_picture,
    state_keys,
    with_style,
)
from fingerslip.report.scene.names import Scalar
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import check_options, field_limits, region_names
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import Events, slide_window
from fingerslip.slip.windows import EVENTS, MAIN_EVENTS
from fingerslip.snapshot import flat_faces

Floats = NDArray[np.float64]
Pixels = NDArray[np.uint8]

#: Nodes of a cell of a section that are its corners.
CORNERS = {"Q4": 4, "T3": 3, "T6": 3}
_SKIN_WIDTH = 3.2
_MARGIN = 0.06


def has_frames(history: xr.Dataset) -> bool:
    """Tell whether a history is one of a section with snapshots."""
    return not is_solid(history) and history.sizes.get("snapshot_time", 0) > 0


def frame_times(history: xr.Dataset, events: Events, names: Sequence[str] = MAIN_EVENTS) -> dict[float, str]:
    """Return times to show [s] and what happens then: the start of the slide and events; none without a slide."""
    window = slide_window(history)
    times = event_times(events.slip, names)
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


@with_style
def deformed_figure(
    history: xr.Dataset,
    events: Events = NO_EVENTS,
    options: SceneOptions | None = None,
    times: Sequence[float] | None = None,
    title: str = "",
) -> Figure:
    """Draw the deformed body with a field, a panel for each time [s]: sections to scale, or lit views of a solid."""
    solid, options = is_solid(history), options or SceneOptions(cut="z", written=False)
    check_options(history, options)
    moments = dict.fromkeys(times or (), "")
    if times is None:
        named = MAIN_EVENTS if not solid else ("incipient", "overall")
        moments = frame_times(history, events, named)
    every = history["snapshot_time"].values
    even = every[-1:] if solid else np.linspace(every[0], every[-1], min(4, every.size))
    numbers = snapshots_at(history, moments or {float(time): "" for time in even})
    pictures = crop(stills(history, list(numbers), options, (1200, 900))) if solid else []
    columns, (width, height) = columns_for(len(numbers)), np.ptp(history["node_position"].values, axis=0)[:2]
    ratio, room = (pictures[0].shape[0] / pictures[0].shape[1], 0.35) if solid else (float(height / width), 0.75)
    wide = 6.0 if columns == 1 else 3.2 if solid else 3.4
    field = SCALARS[options.scalar][0]
    share, labels = ("none", ("", "")) if solid else ("all", ("x [mm]", "y [mm]"))
    heading = join_title(f"Deformed {'body' if solid else 'section'}, {field.partition(' [')[0]}", title)
    figure, panels = figure_grid(len(numbers), columns, (wide, wide * ratio + room), heading, labels, share=share)
    limits = field_limits(history, options)
    for index, (axes, (number, name)) in enumerate(zip(panels, numbers.items(), strict=True)):
        if solid:
            show_picture(axes, pictures[index])
        else:
            draw_section(axes, history, number, options.scalar, limits)
        name_panel(axes, name, columns)
    keys = region_keys(region_names(history)) if options.scalar == "region" else {}
    if options.scalar != "region":
        add_field_bar(figure, panels, field, limits)
    add_legend(figure, keys | ({} if solid and not options.contact else state_keys((STICK, SLIP))))
    return figure


def draw_section(axes: Axes, history: xr.Dataset, number: int, scalar: Scalar, limits: tuple[float, float]) -> None:
    """Draw a snapshot of a section: its field, the skin by the state of its contact, and the plate with its motion."""
    moving = 1e3 * (history["node_position"].values + history["snapshot_displacement"].values)
    points = moving[number]
    cells = history["cell_nodes"].values[:, : CORNERS[history.attrs["element"]]]
    if scalar == "region":
        palette = region_colours(region_names(history))
        colours = np.array([to_rgba(palette[name]) for name in region_names(history)])[history["cell_region"].values]
    else:
        values = SCALARS[scalar][1] * history[f"snapshot_{scalar}"].values[number]
        if scalar in {"displacement", "velocity"}:
            values = np.linalg.norm(values, axis=1)[cells].mean(axis=1)
        colours = ScalarMappable(Normalize(*limits), FIELD_MAP).to_rgba(values)
    axes.add_collection(
        PolyCollection(list(points[cells]), facecolors=colours, edgecolors="none", antialiaseds=False, rasterized=True)
    )
    axes.set_aspect("equal")
    axes.grid(visible=False)
    _draw_skin(axes, history, number, points)
    # All snapshots have the same frame, so that panels compare and nothing jumps in a film.
    low, high = moving.min(axis=(0, 1)), moving.max(axis=(0, 1))
    margin = _MARGIN * (high - low).max()
    axes.set_xlim(low[0] - margin, high[0] + margin)
    _draw_plates(axes, history, number)
    axes.set_ylim(low[1] - 2.5 * margin, high[1] + margin)


def _draw_skin(axes: Axes, history: xr.Dataset, number: int, points: Floats) -> None:
    """Draw the touching skin as a line in the colours of stick and slip."""
    nodes = history["contact_node"].values
    states = history["contact_state"].values[nearest_record(history, float(history["snapshot_time"][number]))]
    order = np.argsort(history["contact_position"].values[:, 0])
    joined = np.stack([order[:-1], order[1:]], axis=1)
    facets = joined[(states[joined] != OPEN).all(axis=1)]
    colours = [STATE_COLOURS[int(state)] for state in states[facets].max(axis=1)] if facets.size else []
    lines = list(points[nodes[facets]])
    axes.add_collection(LineCollection(lines, colors=BLACK, linewidths=_SKIN_WIDTH + 1.2, zorder=4))
    axes.add_collection(LineCollection(lines, colors=colours, linewidths=_SKIN_WIDTH, antialiaseds=False, zorder=5))


def _draw_plates(axes: Axes, history: xr.Dataset, number: int) -> None:
    left, right = axes.get_xlim()
    for face in flat_faces(history, number):
        along = np.array([face.normal[1], -face.normal[0]])
        ends = 1e3 * face.centre[:2] + (right - left) * np.array([[-1.0], [1.0]]) * along
        axes.plot(ends[:, 0], ends[:, 1], color=BLACK, linewidth=1.4, zorder=3)
        travel = history["counterface_displacement"].values[:, face.number] @ along
        sign = float(np.sign(np.round(travel[np.abs(travel).argmax()], 9)))
        if sign:
            middle = 1e3 * face.centre[:2] - 0.06 * (right - left) * face.normal[:2]
            half = 0.09 * (right - left) * sign * along
            style = {"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", xy=tuple(middle + half), xytext=tuple(middle - half), arrowprops=style)


_CUT_FRAMES = 6
_WHITE = 250


@with_style
def cut_frames_figure(history: xr.Dataset, events: Events = NO_EVENTS, title: str = "") -> Figure:
    """Draw the inside of the finger at six snapshots from the end of the press to after overall slip."""
    options = SceneOptions(cut="z", camera="side", receptors=False, written=False)
    times, window, overall = history["snapshot_time"].values, slide_window(history), events.overall
    start, end = window.start if window else float(times[0]), float(times[-1])
    if overall is not None:
        end = min(end, overall + 0.1 * (overall - start))
    numbers = sorted({nearest_snapshot(history, moment) for moment in np.linspace(start, end, _CUT_FRAMES)})
    heading = join_title("Stress on a cut along the finger", title)
    figure, panels = figure_grid(len(numbers), 3, (3.2, 1.75), heading, ("", ""), share="none")
    pictures = crop(stills(history, numbers, options, (960, 660)))
    for axes, number, picture in zip(panels, numbers, pictures, strict=True):
        show_picture(axes, picture)
        name_panel(axes, f"{float(times[number]):.3f} s", 3)
    add_field_bar(figure, panels, SCALARS[options.scalar][0], field_limits(history, options))
    return figure


@with_style
def scene_figure(history: xr.Dataset, title: str) -> Figure:
    """Draw the layers of a solid, cut open, at the start."""
    heading = join_title("Layers and mesh at the start, cut open", title)
    figure, (axes,) = figure_grid(1, 1, (7.0, 3.4), heading, ("", ""))
    options = SceneOptions(scalar="region", cut="z", edges=True, written=False)
    show_picture(axes, crop(stills(history, [nearest_snapshot(history, 0.0)], options))[0])
    keys: dict[str, Artist] = {
        name: Patch(color=colour) for name, colour in region_colours(region_names(history)).items()
    }
    if site_kinds(history).size:
        keys["recorded sites"] = Line2D([], [], color=BLACK, marker="o", markersize=4.0, linestyle="none")
    add_legend(figure, keys)
    return figure


def crop(pictures: Iterable[Pixels]) -> list[Pixels]:
    """Cut the white margins off pictures (height, width, 3) of one size, the same off all of them."""
    whole = list(pictures)
    inked = np.any([(picture < _WHITE).any(axis=2) for picture in whole], axis=0)
    rows, columns = np.flatnonzero(inked.any(axis=1)), np.flatnonzero(inked.any(axis=0))
    if rows.size == 0:
        return whole
    return [picture[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] for picture in whole]
