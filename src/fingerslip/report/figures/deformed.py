"""Deformed sections with a field at several times: small multiples from the start of the slide to overall slip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import ResultError
from fingerslip.history import is_solid, nearest_record, nearest_snapshot, phase_times
from fingerslip.report.colours import (
    BLACK,
    BLUE,
    FIELD_MAP,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    STATE_COLOURS,
    STATE_NAMES,
    VERMILLION,
    region_colours,
)
from fingerslip.report.figures.slip import shown_times
from fingerslip.report.figures.style import add_legend, columns_for, figure_grid, join_title, name_panel, with_style
from fingerslip.report.scene.names import Scalar
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import field_limits, region_names
from fingerslip.slip import Events, contact_forces, slide_window
from fingerslip.slip.windows import EVENTS
from fingerslip.snapshot import flat_faces

__all__ = [
    "deformed_frames_figure",
    "draw_section",
    "has_frames",
    "held_figure",
    "is_held",
    "snapshots_at",
]


Floats = NDArray[np.float64]

_OF_NODES = ("displacement", "velocity")
_CORNERS: Mapping[str, int] = MappingProxyType({"Q4": 4, "T3": 3, "T6": 3})
_SKIN_WIDTH = 3.2
_MARGIN = 0.06


def has_frames(history: xr.Dataset) -> bool:
    """Tell whether a history is one of a section with snapshots."""
    return not is_solid(history) and history.sizes.get("snapshot_time", 0) > 0


@with_style
def deformed_frames_figure(
    history: xr.Dataset,
    events: Events | None = None,
    scalar: Scalar = "von_mises",
    times: Sequence[float] | None = None,
    title: str = "",
) -> Figure:
    """Draw the deformed section with a field, to scale, a panel for each time.

    Units: times [s].
    """
    if not has_frames(history):
        raise ResultError(
            "the result has no deformed section: it needs two dimensions and record: {snapshots_every: 50 ms}"
        )
    numbers = snapshots_at(history, _moments(history, events) if times is None else dict.fromkeys(times, ""))
    label = SCALARS[scalar][0]
    heading = join_title(f"Deformed section, {label.partition(' [')[0]}", title)
    columns = columns_for(len(numbers))
    size = _panel_size(history, 3.4 if columns > 1 else 6.0)
    figure, panels = figure_grid(len(numbers), columns, size, heading, ("x [mm]", "y [mm]"))
    limits = field_limits(history, SceneOptions(scalar=scalar))
    for axes, (number, name) in zip(panels, numbers.items(), strict=True):
        draw_section(axes, history, number, scalar, limits)
        name_panel(axes, name, columns)
    _add_keys(figure, panels, history, scalar, limits)
    return figure


def snapshots_at(history: xr.Dataset, moments: Mapping[float, str]) -> dict[int, str]:
    """Return the snapshots nearest to times [s], each once: their own times, how far from what happens.

    Units: moments [s].
    """
    titles: dict[int, str] = {}
    for moment, words in moments.items():
        number = nearest_snapshot(history, float(moment))
        time = float(history["snapshot_time"][number])
        apart = round(1e3 * (time - moment))
        away = f"{abs(apart)} ms {'before' if apart < 0 else 'after'} " if apart else ""
        words_of_title = (titles.get(number, f"{time:.3f} s"), words and away + words)
        titles[number] = ", ".join(filter(None, words_of_title))
    return titles


def draw_section(axes: Axes, history: xr.Dataset, number: int, scalar: Scalar, limits: tuple[float, float]) -> None:
    """Draw a snapshot of a section: its field, the skin by the state of its contact, and the plate with its motion."""
    moving = 1e3 * (history["node_position"].values + history["snapshot_displacement"].values)
    points = moving[number]
    cells = history["cell_nodes"].values[:, : _CORNERS[history.attrs["element"]]]
    colours = _cell_colours(history, number, cells, scalar, limits)
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


def _cell_colours(
    history: xr.Dataset, number: int, cells: NDArray[np.integer], scalar: Scalar, limits: tuple[float, float]
) -> Floats:
    if scalar == "region":
        names = region_names(history)
        colour_of_region = region_colours(names)
        colours = np.array([to_rgba(colour_of_region[name]) for name in names])
        return np.asarray(colours[history["cell_region"].values])
    values = SCALARS[scalar][1] * history[f"snapshot_{scalar}"].values[number]
    if scalar in _OF_NODES:
        values = np.linalg.norm(values, axis=1)[cells].mean(axis=1)
    return np.asarray(ScalarMappable(Normalize(*limits), FIELD_MAP).to_rgba(values))


def _draw_skin(axes: Axes, history: xr.Dataset, number: int, points: Floats) -> None:
    """Draw the touching skin as a line in the colours of stick and slip."""
    nodes = history["contact_node"].values
    states = history["contact_state"].values[nearest_record(history, float(history["snapshot_time"][number]))]
    order = np.argsort(history["contact_position"].values[:, 0])
    joined = np.stack([order[:-1], order[1:]], axis=1)
    both = states[joined]
    facets = joined[(both != OPEN).all(axis=1)]
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


def _moments(history: xr.Dataset, events: Events | None) -> dict[float, str]:
    """Return the times of the panels and what happens then: the start of the slide and the events, or even times."""
    window = slide_window(history)
    if window is None or events is None:
        times = history["snapshot_time"].values
        return {float(time): "" for time in np.linspace(times[0], times[-1], min(4, times.size))}
    named = {window.start: "start of slide"}
    for name, words in EVENTS.items():
        time = events.slip.time(name)
        if time is not None and name != "noticed":
            named[time] = words
    return named


def _panel_size(history: xr.Dataset, width: float) -> tuple[float, float]:
    extent = np.ptp(history["node_position"].values, axis=0)
    return width, width * float(extent[1] / extent[0]) + 0.75


def _add_keys(
    figure: Figure, panels: Sequence[Axes], history: xr.Dataset, scalar: Scalar, limits: tuple[float, float]
) -> None:
    keys: dict[str, Artist] = {STATE_NAMES[state]: Patch(color=STATE_COLOURS[state]) for state in (STICK, SLIP)}
    if scalar == "region":
        colour_of_region = region_colours(region_names(history))
        keys |= {
            name: Patch(facecolor=colour, edgecolor=BLACK, linewidth=0.3) for name, colour in colour_of_region.items()
        }
    else:
        colours = ScalarMappable(Normalize(*limits), FIELD_MAP)
        figure.colorbar(colours, ax=list(panels), label=SCALARS[scalar][0], extend="max", shrink=0.8, pad=0.01)
    add_legend(figure, keys)


_COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, BLACK)


def is_held(history: xr.Dataset) -> bool:
    """Tell whether a counterface presses and nothing slides."""
    return bool(history.sizes.get("counterface", 0)) and not phase_times(history, "slide")


@with_style
def held_figure(histories: Mapping[str, xr.Dataset]) -> Figure:
    """Draw the normal force over time, and how far rigid bodies move where they are free, a line for each run.

    Units: returns [mN].
    """
    time_axes = shown_times(tuple(histories.values()))
    drawn = {"normal force [mN]": _forces}
    if all(history.sizes.get("rigid_body", 0) for history in histories.values()):
        drawn["displacement of the body [mm]"] = _displacements
    labels, title = (time_axes[0].label, ""), "Normal force and motion while nothing slides"
    figure, panels = figure_grid(len(drawn), 1, (6.6, 2.6), title, labels, share="x")
    for axes, (label, values_of) in zip(panels, drawn.items(), strict=True):
        axes.set_prop_cycle(color=_COLOURS)
        for (name, history), time in zip(histories.items(), time_axes, strict=True):
            for part, values in values_of(history).items():
                axes.plot(time.values, values, label=", ".join(filter(None, (name, part))))
        axes.set_ylabel(label)
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        if len(axes.lines) > 1:
            axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    max(time_axes, key=lambda time: float(np.nanmax(time.values))).fit(panels[0])
    return figure


def _forces(history: xr.Dataset) -> dict[str, Floats]:
    return {"": 1e3 * contact_forces(history).normal}


def _displacements(history: xr.Dataset) -> dict[str, Floats]:
    """Return the distances from where the bodies were at the start [mm], named where there are several."""
    moved = 1e3 * np.linalg.norm(history["rigid_body_displacement"].values, axis=-1)
    names = [str(name) for name in history["rigid_body"].values] if moved.shape[1] > 1 else [""]
    return dict(zip(names, moved.T, strict=True))
