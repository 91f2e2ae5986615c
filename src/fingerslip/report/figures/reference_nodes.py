"""The figure of the reference nodes of the fingertip in space."""

from __future__ import annotations

from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from fingerslip.history import site_kinds, sites_of_kinds
from fingerslip.report.figures.marks import event_keys, mark_run
from fingerslip.report.figures.style import BLACK, GREY, add_legend, figure_grid, styled, titled
from fingerslip.slip import Events, slide_tangent, slide_window

__all__ = ["reference_kinds", "reference_nodes_figure"]

Floats = NDArray[np.float64]

_LINE_STYLES = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)))
_JERK = 0.05  # s


def reference_kinds(history: xr.Dataset) -> list[str]:
    """Return the kinds of the recorded reference nodes, those that end in ``surface``."""
    return [kind for kind in dict.fromkeys(map(str, site_kinds(history))) if kind.endswith("surface")]


@styled
def reference_nodes_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw displacement and acceleration of the recorded reference nodes along the slide, over time.

    Parameters
    ----------
    history : xarray.Dataset
        A history whose sites have kinds that end in ``surface``, as the reference nodes of the fingertip have.
    events : Events, optional
        Slip events, which are marked.
    title : str, optional
        What the title adds, such as the title of the run.

    Returns
    -------
    matplotlib.figure.Figure
        A row for each kind: displacement on the left with that of the plate, acceleration on the right.
    """
    kinds = reference_kinds(history)
    shown = titled("Reference nodes along the slide", title)
    labels = ("time from the start of the run [s]", "")
    figure, panels = figure_grid(2 * len(kinds), 2, (4.4, 2.5), shown, labels, share="x")
    keys: dict[str, Artist] = {}
    tangent = slide_tangent(history)
    for row, kind in enumerate(kinds):
        left, right = panels[2 * row], panels[2 * row + 1]
        keys |= _draw_nodes(left, history, kind, 1e3 * history["displacement"].values @ tangent)
        _draw_nodes(right, history, kind, history["acceleration"].values @ tangent)
        left.plot(
            history["time"],
            1e3 * history["counterface_displacement"].values[:, 0] @ tangent,
            color=BLACK,
            linestyle=":",
        )
        left.set_ylabel("displacement [mm]")
        right.set_ylabel("acceleration [m/s²]")
        left.set_title(kind, fontsize=8.5)
        for axes in (left, right):
            mark_run(axes, history, events.slip if events else None)
        _leave_jerk_out(right, history, kind)
    keys["plate"] = Line2D([], [], color=BLACK, linestyle=":")
    add_legend(figure, keys | event_keys())
    return figure


def _draw_nodes(axes: Axes, history: xr.Dataset, kind: str, signals: Floats) -> dict[str, Artist]:
    """Draw the nodes of a kind, a line style for each line of nodes and a colour for each node of it."""
    rows = sites_of_kinds(history, [kind])
    names = [str(name).rpartition("-")[2] for name in history["site"].values[rows]]
    lines = [name.rstrip("0123456789") for name in names]
    styles = dict(zip(dict.fromkeys(lines), cycle(_LINE_STYLES), strict=False))
    keys: dict[str, Artist] = {}
    for index, (row, name, line) in enumerate(zip(rows, names, lines, strict=True)):
        number, count = lines[:index].count(line), lines.count(line)
        colour = colormaps["plasma"](0.9 * number / max(count - 1, 1))
        (keys[name],) = axes.plot(history["time"], signals[:, row], linewidth=1.0, color=colour, linestyle=styles[line])
    return keys


def _leave_jerk_out(axes: Axes, history: xr.Dataset, kind: str) -> None:
    """Fit the scale to the accelerations after the jerk at the start of the slide, which is far larger."""
    window = slide_window(history)
    times = history["time"].values
    if window is None or window.start + _JERK >= times[-1]:
        return
    signals = history["acceleration"].values[:, sites_of_kinds(history, [kind])] @ slide_tangent(history)
    later = (times < window.start) | (times > window.start + _JERK)
    top, largest = float(np.abs(signals[later]).max()), float(np.abs(signals).max())
    if 0.0 < 2.0 * top < largest:
        axes.set_ylim(-1.3 * top, 1.3 * top)
        said = f"start of the slide cut off: up to {largest:.1f} m/s²"
        axes.set_title(said, fontsize=7.5, color=GREY, loc="right")
