"""The figure of the reference nodes of the fingertip in space."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from fingerslip.history import site_kinds, sites_of_kinds
from fingerslip.report.colours import BLACK, BLUE, ORANGE
from fingerslip.report.figures.marks import event_keys, happened, mark_run
from fingerslip.report.figures.style import add_legend, figure_grid, styled, titled
from fingerslip.slip import Events, slide_tangent, slide_window

__all__ = ["reference_kinds", "reference_nodes_figure"]

Floats = NDArray[np.float64]

_JERK = 0.05  # s
_COLUMNS = 4
# Darker than the lines, so that small letters can be read.
ORANGE_TEXT = "#8a5a00"


def reference_kinds(history: xr.Dataset) -> list[str]:
    """Return the kinds of the recorded reference nodes, those that end in ``surface``."""
    return [kind for kind in dict.fromkeys(map(str, site_kinds(history))) if kind.endswith("surface")]


@styled
def reference_nodes_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw displacement and acceleration of the recorded reference nodes along the slide, a panel for each node.

    Units: returns [mm].
    """
    rows = sites_of_kinds(history, reference_kinds(history))
    labels = ("time [s]", "displacement along the slide [mm]")
    shown = titled("Reference nodes along the slide", title)
    figure, panels = figure_grid(len(rows), _COLUMNS, (2.2, 1.35), shown, labels)
    tangent = slide_tangent(history)
    moved = 1e3 * history["displacement"].values @ tangent
    pushed = np.array(history["acceleration"].values @ tangent)
    plate = 1e3 * history["counterface_displacement"].values[:, 0] @ tangent
    pushed[_in_jerk(history)] = np.nan
    top = 1.3 * float(np.nanmax(np.abs(pushed[:, rows]), initial=0.0)) or 1.0
    for axes, row in zip(panels, rows, strict=True):
        axes.plot(history["time"], moved[:, row], color=BLUE)
        axes.plot(history["time"], plate, color=BLACK, linestyle=":", linewidth=1.0)
        axes.set_title(_name(history, int(row)))
        mark_run(axes, history, events.slip if events else None)
        right = _right_axis(axes, top, is_labelled=axes is panels[min(_COLUMNS, len(rows)) - 1])
        right.plot(history["time"], pushed[:, row], color=ORANGE, linewidth=0.7)
    reach = 1.2 * float(np.abs(moved[:, rows]).max()) or 1.0
    panels[0].set_ylim(*((-reach, 0.1 * reach) if plate.sum() < 0.0 else (-0.1 * reach, reach)))
    happening = event_keys(happened([events.slip] if events else ()))
    add_legend(figure, {**_keys(), **(happening if slide_window(history) else {})})
    return figure


def _name(history: xr.Dataset, row: int) -> str:
    """Return the name of a node, and the kind of surface on which it is."""
    kind = str(site_kinds(history)[row])
    return f"{str(history['site'].values[row]).rpartition('-')[2]}, {kind.removesuffix(' surface')}"


def _right_axis(axes: Axes, top: float, is_labelled: bool) -> Axes:
    """Return the axis of accelerations of a panel."""
    right: Axes = axes.twinx()
    right.set_ylim(-top, top)
    right.grid(visible=False)
    right.spines["right"].set_visible(True)
    right.tick_params(colors=ORANGE_TEXT, labelright=is_labelled)
    if is_labelled:
        right.set_ylabel("acceleration [m/s²]", color=ORANGE_TEXT)
    return right


def _keys() -> dict[str, Artist]:
    return {
        "displacement": Line2D([], [], color=BLUE),
        "plate": Line2D([], [], color=BLACK, linestyle=":", linewidth=1.0),
        "acceleration (without the jerk at the start)": Line2D([], [], color=ORANGE, linewidth=0.9),
    }


def _in_jerk(history: xr.Dataset) -> NDArray[np.bool_]:
    """Tell which records lie in the jerk at the start of the slide, whose accelerations are far larger than others."""
    window, times = slide_window(history), history["time"].values
    start = window.start if window else np.inf
    found: NDArray[np.bool_] = (times >= start) & (times <= start + _JERK)
    return found if not found.all() else np.zeros_like(found)
