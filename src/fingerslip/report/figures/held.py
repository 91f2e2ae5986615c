"""The figure of runs in which nothing slides: how force falls, and how far bodies move, while a fingertip is held."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingerslip.history import phase_times
from fingerslip.report.colours import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION
from fingerslip.report.figures.style import figure_grid, styled
from fingerslip.report.figures.times import shown_times
from fingerslip.slip import contact_forces

__all__ = ["held_figure", "is_held"]

Floats = NDArray[np.float64]

_COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, BLACK)


def is_held(history: xr.Dataset) -> bool:
    """Tell whether a counterface presses and nothing slides."""
    return bool(history.sizes.get("counterface", 0)) and not phase_times(history, "slide")


@styled
def held_figure(histories: Mapping[str, xr.Dataset]) -> Figure:
    """Draw the normal force over time, and how far rigid bodies move where they are free, a line for each run.

    Units: returns [mN].
    """
    shown = shown_times(tuple(histories.values()))
    drawn = {"normal force [mN]": _forces}
    if all(history.sizes.get("rigid_body", 0) for history in histories.values()):
        drawn["displacement of the body [mm]"] = _displacements
    labels, title = (shown[0].label, ""), "Normal force and motion while nothing slides"
    figure, panels = figure_grid(len(drawn), 1, (6.6, 2.6), title, labels, share="x")
    for axes, (label, values_of) in zip(panels, drawn.items(), strict=True):
        axes.set_prop_cycle(color=_COLOURS)
        for (name, history), time in zip(histories.items(), shown, strict=True):
            for part, values in values_of(history).items():
                axes.plot(time.values, values, label=", ".join(filter(None, (name, part))))
        axes.set_ylabel(label)
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        if len(axes.lines) > 1:
            axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    max(shown, key=lambda time: float(np.nanmax(time.values))).fit(panels[0])
    return figure


def _forces(history: xr.Dataset) -> dict[str, Floats]:
    return {"": 1e3 * contact_forces(history).normal}


def _displacements(history: xr.Dataset) -> dict[str, Floats]:
    """Return the distances from where the bodies were at the start [mm], named where there are several."""
    moved = 1e3 * np.linalg.norm(history["rigid_body_displacement"].values, axis=-1)
    names = [str(name) for name in history["rigid_body"].values] if moved.shape[1] > 1 else [""]
    return dict(zip(names, moved.T, strict=True))
