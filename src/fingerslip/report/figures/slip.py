"""Figures of slip along the contact: maps of stick and slip, displacement of nodes relative to the plate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import phase_times
from fingerslip.report.colours import BLACK, STATE_COLOURS, STATE_NAMES
from fingerslip.report.figures.marks import (
    limit_to_slides,
    mark_events,
    mark_run,
    name_events,
    run_keys,
    shown_until,
)
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, run_panels, say, with_style
from fingerslip.slip import Events, SlideWindow, slide_tangent, slide_window

__all__ = [
    "ShownTime",
    "contact_displacement_figure",
    "draw_states",
    "shown_time",
    "shown_times",
    "slip_maps_figure",
]


# Records of steps that follow a hold grow apart by orders of magnitude, even ones by rounding.
_GROWTH = 20.0


@dataclass(frozen=True)
class ShownTime:
    """The time of a history's records as a figure shows it."""

    values: NDArray[np.float64]  # (n_times,), [s]
    logarithmic: bool = False  # whether the axis is
    held: bool = False  # whether the time is counted from the start of a hold

    @property
    def label(self) -> str:
        """Label of the axis."""
        return "time since the hold began [s]" if self.held else "time [s]"

    def fit(self, axes: Axes) -> None:
        """Give a panel its axis of time, from the first record that is shown to the last."""
        if self.logarithmic:
            axes.set_xscale("log")
        axes.set_xlim(np.nanmin(self.values), np.nanmax(self.values))


def shown_time(history: xr.Dataset) -> ShownTime:
    """Return the time that figures of a history show.

    It is logarithmic where the time between records grows twentyfold and more and nothing slides then: from the start
    of the last hold, or of the run where there is none.
    """
    times, held = history["time"].values, _last_hold(history)
    since = times - (held or 0.0)
    later = since > 1e-9 * times[-1]
    lengths = np.diff(since[later])
    if lengths.size < 2 or lengths.max() < _GROWTH * lengths.min():
        return ShownTime(times)
    return ShownTime(np.where(later, since, np.nan), logarithmic=True, held=held is not None)


def shown_times(histories: Sequence[xr.Dataset]) -> tuple[ShownTime, ...]:
    """Return the times of histories that share an axis: logarithmic where those of all are, from holds or from none."""
    time_axes = tuple(map(shown_time, histories))
    if all(time_axis.logarithmic for time_axis in time_axes) and len({time_axis.held for time_axis in time_axes}) == 1:
        return time_axes
    return tuple(ShownTime(history["time"].values) for history in histories)


def _last_hold(history: xr.Dataset) -> float | None:
    """Return when the last hold began [s], None where there is none or something slides after it."""
    holds, slides = phase_times(history, "hold"), phase_times(history, "slide")
    if not holds or any(end > holds[-1][0] for _, end in slides):
        return None
    return holds[-1][0]


_STATES = {STATE_NAMES[state]: STATE_COLOURS[state] for state in (OPEN, STICK, SLIP)}
_MOST_COLUMNS = 700
_NODES_SHOWN = 9


@with_style
def slip_maps_figure(histories: Mapping[str, xr.Dataset], events: Mapping[str, Events]) -> Figure:
    """Draw stick and slip along the surface over time, a panel for each run."""
    time_axes = shown_times(tuple(histories.values()))
    labels = (time_axes[0].label, "position along the plate [mm]")
    figure, panels = run_panels(tuple(histories), "Stick and slip along the contact", labels)
    for axes, (name, history), time in zip(panels, histories.items(), time_axes, strict=True):
        draw_states(axes, history, time)
        events_of_run = events.get(name)
        mark_run(axes, history, events_of_run.slip if events_of_run else None)
    limit_to_slides(panels[0], histories, events, before=0.3)
    patches = {n: Patch(facecolor=c, edgecolor="#999999", linewidth=0.5) for n, c in _STATES.items()}
    add_legend(figure, {**patches, **run_keys(histories, events)})
    return figure


@with_style
def contact_displacement_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw the displacement of contact nodes along the plate against the plate's own."""
    labels = ("time [s]", "displacement since the slide began [mm]")
    figure, (axes,) = figure_grid(1, 1, (6.6, 3.6), join_title("Contact nodes against the plate", title), labels)
    window = slide_window(history)
    nodes = _shown_nodes(history, window) if window else np.empty(0, dtype=np.intp)
    if window is None or nodes.size == 0:
        say(axes, "no slide in contact")
        return figure
    positions = 1e3 * history["contact_position"].values[nodes] @ slide_tangent(history)
    colours = ScalarMappable(Normalize(float(positions.min()), float(positions.max())), "viridis")
    times = history["time"].values[window.records]
    skin, plate = _displacements(history, window, nodes)
    for displacement, position in zip(skin.T, positions, strict=True):
        axes.plot(times, displacement, color=colours.to_rgba(np.array(position)), linewidth=1.2)
    axes.plot(times, plate, color=BLACK, linestyle=(0, (5, 2)), linewidth=1.6, label="plate")
    top = 1.25 * float(np.abs(skin).max())
    axes.set_ylim(*((-top, 0.08 * top) if plate[-1] < 0.0 else (-0.08 * top, top)))
    axes.set_xlim(times[0], shown_until([window], [events.displacement if events else None]))
    axes.legend(loc="upper left", frameon=True, facecolor="white", edgecolor="none").set_zorder(5)
    figure.colorbar(colours, ax=axes, label="position of the node\nalong the plate [mm]", pad=0.02)
    if events is not None:
        mark_events(axes, events.displacement)
        name_events(axes, None, events.displacement)
    return figure


def draw_states(axes: Axes, history: xr.Dataset, time: ShownTime) -> None:
    """Draw stick and slip along the surface over time."""
    state = history["contact_state"].values
    along = 1e3 * history["contact_position"].values @ slide_tangent(history)
    touched = np.flatnonzero((state != OPEN).any(axis=0))
    if touched.size == 0:
        say(axes, "no contact")
        return
    order = touched[np.argsort(along[touched])]
    every = max(history.sizes["time"] // _MOST_COLUMNS, 1)
    chosen = np.flatnonzero(np.isfinite(time.values))[::every]
    axes.pcolormesh(
        np.exp(_borders(np.log(time.values[chosen]))) if time.logarithmic else _borders(time.values[chosen]),
        _borders(along[order]),
        state[chosen][:, order].T,
        cmap=ListedColormap(list(_STATES.values())),
        norm=BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3),
        rasterized=True,
    )
    if time.logarithmic:
        time.fit(axes)
    axes.grid(visible=False)


def _borders(centres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the borders between cells round rising centres."""
    if centres.size == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate(([2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]))


def _shown_nodes(history: xr.Dataset, window: SlideWindow) -> NDArray[np.intp]:
    """Choose nodes evenly over the contact at the start of the slide, both edges among them."""
    touching = np.flatnonzero(history["contact_state"].values[window.first] != OPEN)
    along = history["contact_position"].values[touching] @ slide_tangent(history)
    chosen = np.linspace(0, touching.size - 1, min(_NODES_SHOWN, touching.size)).round().astype(int)
    nodes: NDArray[np.intp] = touching[np.argsort(along)][chosen]
    return nodes


def _displacements(
    history: xr.Dataset, window: SlideWindow, nodes: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the displacements of nodes and plate along the plate since the slide began [mm]."""
    tangent = slide_tangent(history)
    skin = 1e3 * history["contact_displacement"].values[window.records][:, nodes] @ tangent
    plate = 1e3 * history["counterface_displacement"].values[window.records, 0] @ tangent
    return skin - skin[0], plate - plate[0]
