"""The figure of a convergence study: slip events against element size, time step and contact compliance."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.report.colours import BLACK, EVENT_COLOURS
from fingerslip.report.figures.style import add_legend, figure_grid, styled
from fingerslip.slip.names import EVENTS, MAIN_EVENTS
from fingerslip.uncertainty import SETTINGS, Convergence, Refinement, Series

__all__ = ["convergence_figure"]


@styled
def convergence_figure(quantities: Mapping[str, Convergence], title: str) -> Figure:
    """Draw how the slip events of a run change as settings are refined.

    Units: returns [ms].
    """
    events = {event: quantities[f"slip.{event}"] for event in MAIN_EVENTS}
    settings = [
        setting
        for setting in SETTINGS
        if setting.order is not None and any(setting.name in one.sources for one in events.values())
    ]
    labels = ("", "change of the event [ms]")
    figure, panels = figure_grid(len(settings), 3, (3.1, 3.0), f"Convergence of the slip events, {title}", labels)
    for axes, setting in zip(panels, settings, strict=True):
        _draw_setting(axes, setting.name, events)
        axes.set_xlabel(setting.label)
    keys = {EVENTS[event]: Line2D([], [], color=EVENT_COLOURS[event], linewidth=2.0) for event in MAIN_EVENTS}
    keys["limit"] = Line2D([], [], color=BLACK, marker="D", markerfacecolor="none", linestyle="")
    add_legend(figure, keys)
    return figure


def _draw_setting(axes: Axes, setting: str, events: Mapping[str, Convergence]) -> None:
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    for index, (event, one) in enumerate(events.items()):
        series, found = one.sources.get(setting), one.refinements.get(setting)
        if series is None or found is None or found.uncertainty is None or one.value is None:
            continue
        _draw_series(axes, series, found, one.value, EVENT_COLOURS[event])
        # Bars of different events at one size would hide each other.
        bar_at = 1.0 + 0.04 * (index + 1)
        axes.errorbar([bar_at], [0.0], yerr=[1e3 * found.uncertainty], color=EVENT_COLOURS[event], capsize=3)
    axes.set_xlim(left=-0.05)


def _draw_series(axes: Axes, series: Series, found: Refinement, value: float, colour: str) -> None:
    sizes = np.array(series.sizes)
    changes = 1e3 * (np.array(series.values, dtype=float) - value)
    rising = np.argsort(sizes)
    if found.limit is None or found.order is None:
        axes.plot(sizes[rising], changes[rising], marker="o", color=colour, linestyle=(0, (1, 1.5)))
        return
    axes.plot(sizes[rising], changes[rising], marker="o", color=colour, linestyle="")
    # The curve of the observed order from the coarsest value down to the limit.
    limit, coarsest = 1e3 * (found.limit - value), rising[-1]
    along = np.linspace(0.0, 1.0, 100)
    axes.plot(along * sizes[coarsest], limit + (changes[coarsest] - limit) * along**found.order, color=colour)
    axes.plot([0.0], [limit], marker="D", markerfacecolor="none", color=colour, linestyle="")
