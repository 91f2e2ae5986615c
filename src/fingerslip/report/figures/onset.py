"""The figure of when each part of the contact begins to slip for good, for several runs in space side by side."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingerslip.contact.frames import sliding_direction
from fingerslip.contact.states import OPEN, STICK
from fingerslip.report.colours import BLACK
from fingerslip.report.figures.patch import fill_patch, touched_frame
from fingerslip.report.figures.style import figure_grid, styled
from fingerslip.slip import Patch, contact_patch, slide_window
from fingerslip.slip.counterface import counterface_normal
from fingerslip.slip.patch import triangle_states

__all__ = ["slip_onset_figure"]

Floats = NDArray[np.float64]

_COLUMNS, _WIDTH = 4, 2.0
_STUCK = (0.12, 0.16, 0.2, 1.0)
_ARROW = 0.3


@styled
def slip_onset_figure(histories: Mapping[str, xr.Dataset], counterface: int = 0) -> Figure:
    """Draw when each part of the contact slips for good, a panel for each run, all in the same axes of the plate."""
    patches = {title: contact_patch(history, counterface) for title, history in histories.items()}
    onsets = {title: _onsets(history, patches[title]) for title, history in histories.items()}
    latest = max((float(np.nanmax(times, initial=0.0)) for times in onsets.values()), default=0.0)
    colours = ScalarMappable(Normalize(0.0, latest or 1.0), "viridis_r")
    axes_of_plate = _plate_axes(next(iter(histories.values())), counterface)
    points = {title: _points(history, patches[title], axes_of_plate) for title, history in histories.items()}
    frames = [touched_frame(history, patches[title], points[title]) for title, history in histories.items()]
    low, high = np.min([first for first, _ in frames], axis=0), np.max([last for _, last in frames], axis=0)
    size = _WIDTH, min(_WIDTH * (high[1] - low[1]) / (high[0] - low[0]), 3.0) + 0.4
    labels = tuple(f"{'xyz'[int(np.abs(axis).argmax())]} [mm]" for axis in axes_of_plate)
    shown = "When each part of the contact slips for good, seen from below"
    figure, panels = figure_grid(len(histories), min(_COLUMNS, len(histories)), size, shown, (labels[0], labels[1]))
    for axes, (title, times) in zip(panels, onsets.items(), strict=True):
        _draw_onsets(axes, 1e3 * points[title][patches[title].triangles], times, colours)
        _draw_arrow(axes, patches[title].axes[0] @ axes_of_plate.T, low, high)
        axes.grid(visible=False)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        axes.set_title(title)
    figure.colorbar(colours, ax=list(panels), label="time into the slide [s]", shrink=0.8)
    return figure


def _draw_onsets(axes: Axes, corners: Floats, times: Floats, colours: ScalarMappable) -> None:
    """Fill the triangles that touch; those that stick to the end have no time."""
    stuck, touched = np.isnan(times), ~(times < 0.0)
    paint = colours.to_rgba(times)
    paint[stuck] = _STUCK
    fill_patch(axes, corners[touched], paint[touched])


def _onsets(history: xr.Dataset, patch: Patch) -> Floats:
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


def _plate_axes(history: xr.Dataset, counterface: int) -> Floats:
    """Return two axes of the plate that do not depend on the slide, shape (2, 3)."""
    normal = counterface_normal(history, counterface)
    first = sliding_direction(normal)
    return np.array([first, np.cross(first, normal)])


def _points(history: xr.Dataset, patch: Patch, axes: Floats) -> Floats:
    """Return the coordinates of the nodes of a patch in axes of the plate [m], shape (n, 2)."""
    points: Floats = history["contact_position"].values[patch.nodes] @ axes.T
    return points


def _draw_arrow(axes: Axes, direction: Floats, low: Floats, high: Floats) -> None:
    """Draw the direction of the plate over the middle of the panel."""
    middle, length = 0.5 * (low + high), _ARROW * float(np.min(high - low))
    start = middle - 0.5 * length * direction
    axes.annotate(
        "",
        xy=tuple(start + length * direction),
        xytext=tuple(start),
        arrowprops={"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.6},
        zorder=5,
    )
