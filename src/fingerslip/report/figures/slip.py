"""Figures of slip along the contact: maps of stick and slip, nodes leaving the plate's line."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fingerslip.history import OPEN
from fingerslip.report.figures.style import (
    BLACK,
    add_legend,
    columns_for,
    event_keys,
    figure_grid,
    limit_to_slides,
    mark_events,
    mark_run,
    name_events,
    shown_until,
    styled,
    titled,
)
from fingerslip.slip import Events, SlideWindow, slide_window
from fingerslip.slip.receptors import plate_tangent

__all__ = ["contact_displacement_figure", "slip_maps_figure"]

_STATE_COLOURS = {"no contact": "#f4f4f4", "stick": "#a9d0ec", "slip": "#f7c56b"}
_MOST_COLUMNS = 700
_NODES_SHOWN = 9


@styled
def slip_maps_figure(histories: Mapping[str, xr.Dataset], events: Mapping[str, Events]) -> Figure:
    """Draw stick and slip along the surface over time, a panel for each run.

    Parameters
    ----------
    histories : mapping of str to xarray.Dataset
        Histories by the runs' labels.
    events : mapping of str to Events
        Their events; those from accumulated slip are marked. Runs without events are drawn without marks.

    Returns
    -------
    matplotlib.figure.Figure
        Time in seconds to the right, tangential position in millimetres upwards, colour for the state.
    """
    columns = columns_for(len(histories))
    panel = {1: (6.6, 3.2), 2: (3.8, 2.5)}.get(columns, (3.3, 2.5))
    labels = ("time [s]", "position along the plate [mm]")
    figure, panels = figure_grid(len(histories), columns, panel, "Stick and slip along the contact", labels)
    for axes, (label, history) in zip(panels, histories.items(), strict=True):
        _draw_states(axes, history)
        axes.set_title(label)
        own = events.get(label)
        mark_run(axes, history, own.slip if own else None)
    limit_to_slides(panels[0], histories, events, before=0.3)
    patches = {n: Patch(facecolor=c, edgecolor="#999999", linewidth=0.5) for n, c in _STATE_COLOURS.items()}
    add_legend(figure, {**patches, **event_keys()})
    return figure


@styled
def contact_displacement_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw the displacement of contact nodes along the plate against the plate's own.

    Parameters
    ----------
    history : xarray.Dataset
        A history.
    events : Events, optional
        Its events; those from displacement are marked.
    title : str, optional
        What the title adds, such as the run's label.

    Returns
    -------
    matplotlib.figure.Figure
        Nine nodes evenly over the contact, both displacements in millimetres since the slide began.
    """
    labels = ("time [s]", "displacement since the slide began [mm]")
    figure, (axes,) = figure_grid(1, 1, (6.6, 3.6), titled("Contact nodes against the plate", title), labels)
    window = slide_window(history)
    nodes = _shown_nodes(history, window) if window else np.empty(0, dtype=np.intp)
    if window is None or nodes.size == 0:
        axes.text(0.5, 0.5, "no slide in contact", transform=axes.transAxes, ha="center")
        return figure
    places = 1e3 * history["contact_position"].values[nodes] @ plate_tangent(history)
    colours = ScalarMappable(Normalize(float(places.min()), float(places.max())), "viridis")
    times = history["time"].values[window.records]
    skin, plate = _ways(history, window, nodes)
    for way, place in zip(skin.T, places, strict=True):
        axes.plot(times, way, color=colours.to_rgba(np.array(place)), linewidth=1.2)
    axes.plot(times, plate, color=BLACK, linestyle=(0, (5, 2)), linewidth=1.6, label="plate")
    top = 1.25 * float(np.abs(skin).max())
    axes.set_ylim(*((-top, 0.08 * top) if plate[-1] < 0.0 else (-0.08 * top, top)))
    axes.set_xlim(times[0], shown_until([window], [events.displacement if events else None]))
    axes.legend(loc="upper left")
    figure.colorbar(colours, ax=axes, label="position of the node along the plate [mm]", pad=0.02)
    if events is not None:
        mark_events(axes, events.displacement)
        name_events(axes, None, events.displacement)
    return figure


def _draw_states(axes: Axes, history: xr.Dataset) -> None:
    state = history["contact_state"].values
    along = 1e3 * history["contact_position"].values @ plate_tangent(history)
    touched = np.flatnonzero((state != OPEN).any(axis=0))
    if touched.size == 0:
        axes.text(0.5, 0.5, "no contact", transform=axes.transAxes, ha="center")
        return
    order = touched[np.argsort(along[touched])]
    every = max(history.sizes["time"] // _MOST_COLUMNS, 1)
    times = history["time"].values[::every]
    axes.pcolormesh(
        _borders(times),
        _borders(along[order]),
        state[::every][:, order].T,
        cmap=ListedColormap(list(_STATE_COLOURS.values())),
        norm=BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3),
        rasterized=True,
    )
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
    along = history["contact_position"].values[touching] @ plate_tangent(history)
    places = np.linspace(0, touching.size - 1, min(_NODES_SHOWN, touching.size)).round().astype(int)
    shown: NDArray[np.intp] = touching[np.argsort(along)][places]
    return shown


def _ways(
    history: xr.Dataset, window: SlideWindow, nodes: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ways along the plate of nodes and plate since the slide began [mm]."""
    tangent = plate_tangent(history)
    skin = 1e3 * history["contact_displacement"].values[window.records][:, nodes] @ tangent
    plate = 1e3 * history["counterface_displacement"].values[window.records, 0] @ tangent
    return skin - skin[0], plate - plate[0]
