"""Figures of what receptors record: accelerations, acceleration peaks, strain energy density, spikes."""

from __future__ import annotations

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.afferents.model import Spikes
from fingerslip.history import sites_of_kinds
from fingerslip.report.colours import AREA_COLOURS, BLACK, BLUE, GREY, RECEPTOR_COLOURS
from fingerslip.report.figures.marks import event_keys, limit_to_slides, mark_run, name_run, shown_time
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, run_panels, say, with_style
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import Events, PeakSettings, PeakTable, acceleration_peaks, peak_signal, receptor_signals

_AREA_NAMES = {"A": "area A: edge at the smaller position", "B": "area B: edge at the larger position"}
# Height of the note that an area has no receptor, as a share of the panel's.
_NOTE_HEIGHTS = {"A": 0.6, "B": 0.3}


@with_style
def acceleration_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw the tangential acceleration at the recorded receptor types, for both edges of the contact."""
    labels, kinds = ("time [s]", "acceleration along the plate [m/s²]"), _recorded_kinds(history)
    figure, panels = figure_grid(len(kinds), 1, (6.8, 1.45), join_title("Acceleration at the receptors", title), labels)
    signals, events_read = receptor_signals(history), events.acceleration if events else None
    for axes, kind in zip(panels, kinds, strict=True):
        _draw_areas(axes, signals, "acceleration", kind, signals["time"].values)
        mark_run(axes, history, events_read)
        axes.set_title(kind, pad=28.0 if axes is panels[0] else 3.0, fontweight="bold")
    limit_to_slides(panels[0], {title: history}, {title: events} if events else {}, marked=[events_read])
    name_run(panels[:1], history, events_read)
    _fit_after_transition(panels[0], signals, acceleration_peaks(history))
    add_legend(figure, _area_keys())
    return figure


@with_style
def acceleration_overview_figure(
    histories: Mapping[str, xr.Dataset], events: Mapping[str, Events], settings: PeakSettings | None = None
) -> Figure:
    """Draw the signal that acceleration peaks are read from, a panel for each run."""
    settings = settings or PeakSettings()
    title = f"Largest acceleration at {' and '.join(settings.kinds)}"
    figure, panels = run_panels(tuple(histories), title, ("time [s]", "acceleration along the plate [m/s²]"))
    events_read = [events[name].acceleration if name in events else None for name in histories]
    for axes, history, events_of_run in zip(panels, histories.values(), events_read, strict=True):
        _draw_peak_signal(axes, history, settings)
        mark_run(axes, history, events_of_run)
    limit_to_slides(panels[0], histories, events, marked=events_read)
    keys: dict[str, Artist] = {
        "largest over the receptors": Line2D([], [], color=BLUE, linewidth=1.0),
        "peak that counts": Line2D([], [], color=BLACK, marker="o", markersize=4, linestyle=""),
        "height that a peak needs": Line2D([], [], color=GREY, linewidth=1.0),
    }
    add_legend(figure, {**keys, **event_keys(events_read)})
    return figure


@with_style
def strain_energy_density_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw the strain energy density at the recorded receptor types, for both edges of the contact."""
    time, kinds, heading = shown_time(history), _recorded_kinds(history), join_title("Strain energy density", title)
    labels = (time.label, "strain energy density [J/m³]")
    figure, panels = figure_grid(len(kinds), 2, (3.6, 2.2), heading, labels, share="x")
    signals, events_read = receptor_signals(history), events.slip if events else None
    for axes, kind in zip(panels, kinds, strict=True):
        _draw_areas(axes, signals, "strain_energy_density", kind, time.values)
        axes.set_title(kind, pad=28.0 if axes in panels[:2] else 4.0, fontweight="bold")
        mark_run(axes, history, events_read)
        axes.set_ylim(bottom=0.0)
        time.fit(axes)
    name_run(panels[:2], history, events_read)
    add_legend(figure, _area_keys())
    return figure


def _recorded_kinds(history: xr.Dataset) -> tuple[str, ...]:
    """Return the receptor types that a history records; all of them where it records none."""
    return tuple(kind for kind in RECEPTOR_KINDS if sites_of_kinds(history, (kind,)).size) or RECEPTOR_KINDS


def _draw_areas(axes: Axes, signals: xr.Dataset, name: str, kind: str, times: np.ndarray) -> None:
    for area, colour in AREA_COLOURS.items():
        signal = signals[name].sel(kind=kind, area=area)
        if bool(signal.notnull().any()):
            axes.plot(times, signal.values, color=colour, linewidth=1.1)
        else:
            say(axes, f"no receptor in area {area}", _NOTE_HEIGHTS[area])


def _draw_peak_signal(axes: Axes, history: xr.Dataset, settings: PeakSettings) -> None:
    signal = peak_signal(history, settings)
    if signal is None:
        say(axes, "no slide or no receptor")
        return
    table = acceleration_peaks(history, settings)
    floor = 1e-4 * float(signal.max())
    axes.semilogy(signal["time"].values, np.maximum(signal.values, floor), color=BLUE, linewidth=1.0)
    axes.plot([p.time for p in table.peaks], [p.height for p in table.peaks], "o", color=BLACK, markersize=4, zorder=5)
    if table.peaks:
        axes.axhline(table.noise_floor + table.threshold, color=GREY, linewidth=1.0)


def _fit_after_transition(axes: Axes, signals: xr.Dataset, peaks: PeakTable) -> None:
    """Scale to what follows the transition, whose peak may be many times higher; say where it is cut."""
    if peaks.transition is None or peaks.transition_end is None:
        return
    size = np.nan_to_num(np.abs(signals["acceleration"].values))
    after = signals["time"].values >= peaks.transition_end
    top = 1.2 * float(size[..., after].max())
    cut = float(size[..., ~after].max())
    if top > 0.0:
        axes.set_ylim(-top, top)
    if cut > top:
        look = {"fontsize": mpl.rcParams["legend.fontsize"], "color": GREY, "zorder": 6, "textcoords": "offset points"}
        note = axes.annotate(f"cut, reaches {cut:.2g} m/s²", (peaks.transition.time, top), (8.0, -10.0), **look)
        note.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0})


def _area_keys() -> dict[str, Artist]:
    return {_AREA_NAMES[area]: Line2D([], [], color=colour) for area, colour in AREA_COLOURS.items()}


@with_style
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
    events_read, rates = events.slip if events else None, spikes.rates(window)
    heading = join_title("Spikes of afferents", title)
    figure, panels = figure_grid(len(kinds) + 1, 1, (6.8, 1.2), heading, ("time [s]", ""), share="x")
    for axes, kind in zip(panels, kinds, strict=False):
        colour = RECEPTOR_COLOURS.get(kind, BLACK)
        _draw_raster(axes, spikes, kind, colour)
        panels[-1].step(rates["time"], rates.sel(kind=kind), where="mid", color=colour, linewidth=1.2, label=kind)
    panels[-1].set_ylabel("mean rate [1/s]")
    panels[-1].set_yscale("asinh", linear_width=10.0)  # rates of the types differ by a hundred times
    panels[-1].set_yticks([0, 10, 100, 1000], ["0", "10", "100", "1000"])
    panels[-1].set_yticks([], minor=True)
    panels[-1].set_ylim(bottom=0.0)
    for axes in panels:
        mark_run(axes, history, events_read)
    name_run(panels[:1], history, events_read)
    return figure


def _draw_raster(axes: Axes, spikes: Spikes, kind: str, colour: str) -> None:
    rows = [times for times, its_kind in zip(spikes.times, spikes.kinds, strict=True) if its_kind == kind]
    axes.eventplot(rows, colors=colour, linewidths=0.6, linelengths=0.8)
    axes.set_ylabel(f"{kind}\n{len(rows)} afferents", color=colour)
    axes.set_ylim(-0.8, len(rows) - 0.2)
    axes.set_yticks([])
    axes.grid(visible=False)
    axes.set_xlim(spikes.start, spikes.end)
