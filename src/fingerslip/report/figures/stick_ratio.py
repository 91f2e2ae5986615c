"""The figure of the stick ratio against the tangential force, as optical studies of fingertips draw it."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from fingerslip.report.figures.style import figure_grid, styled, titled
from fingerslip.slip import patch_series, slide_window

__all__ = ["stick_ratio_figure"]


@styled
def stick_ratio_figure(histories: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Draw the stick ratio against the tangential force over the normal force."""
    shown = titled("Stick ratio against tangential force", title)
    labels = ("tangential force / normal force", "sticking share of the contact area")
    figure, (axes,) = figure_grid(1, 1, (5.2, 3.4), shown, labels)
    for name, history in histories.items():
        window = slide_window(history)
        series = patch_series(history)
        chosen = series.isel(time=window.records) if window else series
        axes.plot(chosen["force_ratio"], chosen["stick_ratio"], label=name, linewidth=1.4)
    axes.set_ylim(-0.03, 1.03)
    if len(histories) > 1:
        axes.legend(fontsize=8)
    return figure
