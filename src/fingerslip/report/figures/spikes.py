"""Figure of the spikes of afferents: a raster of every type, and their mean rates."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerslip.afferents.model import Spikes
from fingerslip.report.colours import BLACK, RECEPTOR_COLOURS
from fingerslip.report.figures.marks import mark_run, name_run
from fingerslip.report.figures.style import figure_grid, styled, titled
from fingerslip.slip import Events

__all__ = ["spike_figure"]


@styled
def spike_figure(
    spikes: Spikes, history: xr.Dataset, events: Events | None = None, title: str = "", window: float = 0.05
) -> Figure:
    """Draw when afferents fire, a panel for each type with a row for each afferent, and their mean rates below.

    Parameters
    ----------
    spikes : Spikes
        The spikes.
    history : xarray.Dataset
        The history that they come from.
    events : Events, optional
        Its events; those from accumulated slip are marked.
    title : str, optional
        What the title adds, such as the title of the run.
    window : float, optional
        Length of the windows that rates are counted in [s].

    Returns
    -------
    matplotlib.figure.Figure
        Panels of one width over time [s]; rows of a raster are ordered as the history orders its sites.
    """
    kinds = tuple(dict.fromkeys(spikes.kinds))
    own, rates = events.slip if events else None, spikes.rates(window)
    heading = titled("Spikes of afferents", title)
    figure, panels = figure_grid(len(kinds) + 1, 1, (6.8, 1.2), heading, ("time [s]", ""), share="x")
    for axes, kind in zip(panels, kinds, strict=False):
        _draw_raster(axes, spikes, kind)
        panels[-1].step(
            rates["time"], rates.sel(kind=kind), where="mid", color=_colour(kind), linewidth=1.2, label=kind
        )
    panels[-1].set_ylabel("mean rate [1/s]")
    panels[-1].set_yscale("asinh", linear_width=10.0)  # rates of the types differ by a hundred times
    panels[-1].set_yticks([0, 10, 100, 1000], ["0", "10", "100", "1000"])
    panels[-1].set_yticks([], minor=True)
    panels[-1].set_ylim(bottom=0.0)
    for axes in panels:
        mark_run(axes, history, own)
    name_run(panels[:1], history, own)
    return figure


def _colour(kind: str) -> str:
    return RECEPTOR_COLOURS.get(kind, BLACK)


def _draw_raster(axes: Axes, spikes: Spikes, kind: str) -> None:
    rows = [times for times, its_kind in zip(spikes.times, spikes.kinds, strict=True) if its_kind == kind]
    axes.eventplot(rows, colors=_colour(kind), linewidths=0.6, linelengths=0.8)
    axes.set_ylabel(f"{kind}\n{len(rows)} afferents", color=_colour(kind))
    axes.set_ylim(-0.8, len(rows) - 0.2)
    axes.set_yticks([])
    axes.grid(visible=False)
    axes.set_xlim(spikes.start, spikes.end)
