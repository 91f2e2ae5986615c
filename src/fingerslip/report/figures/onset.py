"""Figure of when every place of the contact begins to slip, for several runs in space side by side."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingerslip.contact.frames import sliding_direction
from fingerslip.history import OPEN, STICK
from fingerslip.report.figures.style import BLACK, figure_grid, styled
from fingerslip.slip import Patch, contact_patch, slide_window
from fingerslip.slip.patch import triangle_states

__all__ = ["slip_onset_figure"]

Floats = NDArray[np.float64]

_COLUMNS, _WIDTH, _ROOM = 4, 2.0, 0.8
_STUCK = (0.12, 0.16, 0.2, 1.0)
_ARROW = 0.3


@styled
def slip_onset_figure(histories: Mapping[str, xr.Dataset], counterface: int = 0) -> Figure:
    """Draw when every place of the contact slips for good, a panel for each run, all in the same axes of the plate.

    Parameters
    ----------
    histories : mapping of str to xarray.Dataset
        Histories in space by label, of runs with a slide on the same plate.
    counterface : int, optional
        The counterface.

    Returns
    -------
    matplotlib.figure.Figure
        Colours count from the start of each run's slide; what sticks to its end is dark, an arrow shows the way of
        the plate.
    """
    onsets = {label: _onsets(history, contact_patch(history, counterface)) for label, history in histories.items()}
    latest = max((float(np.nanmax(times, initial=0.0)) for _, times in onsets.values()), default=0.0)
    colours = ScalarMappable(Normalize(0.0, latest or 1.0), "viridis_r")
    axes_of_plate = _plate_axes(next(iter(histories.values())), counterface)
    patches = {label: patch for label, (patch, _) in onsets.items()}
    low, high = _frame(histories, patches, axes_of_plate)
    size = _WIDTH, min(_WIDTH * (high[1] - low[1]) / (high[0] - low[0]), 3.0) + 0.4
    columns = min(_COLUMNS, len(histories))
    labels = tuple(f"{'xyz'[int(np.abs(axis).argmax())]} [mm]" for axis in axes_of_plate)
    title = "When each place slips for good, seen from below"
    figure, panels = figure_grid(len(histories), columns, size, title, (labels[0], labels[1]))
    for axes, (label, (patch, times)) in zip(panels, onsets.items(), strict=True):
        paint = colours.to_rgba(times)
        paint[np.isnan(times)] = _STUCK
        corners = (1e3 * _places(histories[label], patch, axes_of_plate))[patch.triangles]
        touched = times >= 0.0
        touched |= np.isnan(times)
        axes.add_collection(
            PolyCollection(list(corners[touched]), facecolors=paint[touched], edgecolors="face", linewidths=0.2)
        )
        _draw_arrow(axes, patch.axes[0] @ axes_of_plate.T, low, high)
        axes.grid(visible=False)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        axes.set_title(label, fontsize=8.5)
    figure.colorbar(colours, ax=list(panels), label="time into the slide [s]", shrink=0.8)
    return figure


def _onsets(history: xr.Dataset, patch: Patch) -> tuple[Patch, Floats]:
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
    return patch, onset


def _plate_axes(history: xr.Dataset, counterface: int) -> Floats:
    """Return two axes of the plate that do not depend on the slide, shape (2, 3)."""
    normal = history["counterface_normal"].values[counterface]
    first = sliding_direction(normal)
    return np.array([first, np.cross(first, normal)])


def _places(history: xr.Dataset, patch: Patch, axes: Floats) -> Floats:
    places: Floats = history["contact_position"].values[patch.nodes] @ axes.T
    return places


def _frame(histories: Mapping[str, xr.Dataset], patches: Mapping[str, Patch], axes: Floats) -> tuple[Floats, Floats]:
    """Return the corners of a frame round all that ever touches in any run [mm]."""
    found = []
    for label, history in histories.items():
        patch = patches[label]
        ever = (history["contact_state"].values[:, patch.nodes] != OPEN).any(axis=0)
        places = _places(history, patch, axes)
        found.append(places[ever] if ever.any() else places)
    places = 1e3 * np.vstack(found)
    return places.min(axis=0) - _ROOM, places.max(axis=0) + _ROOM


def _draw_arrow(axes: Axes, way: Floats, low: Floats, high: Floats) -> None:
    """Draw the way of the plate over the middle of the panel."""
    middle, length = 0.5 * (low + high), _ARROW * float(np.min(high - low))
    start = middle - 0.5 * length * way
    axes.annotate(
        "",
        xy=tuple(start + length * way),
        xytext=tuple(start),
        arrowprops={"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.6},
        zorder=5,
    )
