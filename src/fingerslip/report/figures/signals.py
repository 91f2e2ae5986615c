"""Figures of signals over time: accelerations and strain energy density at the receptors, forces, energies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from fingerslip.report.figures.style import (
    AREA_COLOURS,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    add_legend,
    columns_for,
    event_keys,
    figure_grid,
    limit_to_slides,
    mark_run,
    name_events,
    styled,
    titled,
)
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import (
    Events,
    PeakSettings,
    PeakTable,
    SlipEvents,
    acceleration_peaks,
    peak_signal,
    receptor_signals,
    slide_window,
    slipping_fraction,
)
from fingerslip.slip.receptors import plate_tangent

__all__ = [
    "acceleration_figure",
    "acceleration_overview_figure",
    "energy_figure",
    "force_figure",
    "force_overview_figure",
    "strain_energy_density_figure",
]

_ROUNDING = 1e-16


@styled
def acceleration_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw the tangential acceleration at the four receptor types, for both edges of the contact.

    Parameters
    ----------
    history : xarray.Dataset
        A history with receptors.
    events : Events, optional
        Its events; those from acceleration are marked.
    title : str, optional
        What the title adds, such as the run's label.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each type on one common scale, which fits what follows the press-to-slide transition.
    """
    labels = ("time [s]", "acceleration along the plate [m/s²]")
    figure, panels = figure_grid(4, 1, (6.8, 1.45), titled("Acceleration at the receptors", title), labels)
    signals = receptor_signals(history)
    peaks = acceleration_peaks(history)
    for axes, kind in zip(panels, RECEPTOR_KINDS, strict=True):
        _draw_areas(axes, signals, "acceleration", kind)
        mark_run(axes, history, events.acceleration if events else None)
        axes.set_title(kind, pad=28.0 if axes is panels[0] else 3.0, fontweight="bold")
    limit_to_slides(panels[0], {title: history}, {title: events} if events else {})
    _name(panels[:1], history, events.acceleration if events else None)
    _fit_after_transition(panels[0], signals, peaks)
    add_legend(figure, _area_keys())
    return figure


@styled
def acceleration_overview_figure(
    histories: Mapping[str, xr.Dataset], events: Mapping[str, Events], settings: PeakSettings | None = None
) -> Figure:
    """Draw the signal that acceleration peaks are read from, a panel for each run.

    Parameters
    ----------
    histories : mapping of str to xarray.Dataset
        Histories by the runs' labels.
    events : mapping of str to Events
        Their events; those from acceleration are marked.
    settings : PeakSettings, optional
        How peaks are told from noise.

    Returns
    -------
    matplotlib.figure.Figure
        Largest tangential acceleration over the receptors on a logarithmic scale, the peaks that count as
        dots, the noise floor and the height needed as lines.
    """
    settings = settings or PeakSettings()
    columns = columns_for(len(histories))
    panel = {1: (6.6, 3.0), 2: (3.8, 2.3)}.get(columns, (3.3, 2.3))
    title = f"Largest acceleration at {' and '.join(settings.kinds)}"
    labels = ("time [s]", "acceleration along the plate [m/s²]")
    figure, panels = figure_grid(len(histories), columns, panel, title, labels)
    for axes, (label, history) in zip(panels, histories.items(), strict=True):
        _draw_peak_signal(axes, history, settings)
        axes.set_title(label)
        own = events.get(label)
        mark_run(axes, history, own.acceleration if own else None)
    limit_to_slides(panels[0], histories, events)
    keys: dict[str, Artist] = {
        "largest over the receptors": Line2D([], [], color=BLUE, linewidth=1.0),
        "peak that counts": Line2D([], [], color=BLACK, marker="o", markersize=4, linestyle=""),
        "height that a peak needs": Line2D([], [], color=GREY, linewidth=1.0),
    }
    add_legend(figure, {**keys, **event_keys()})
    return figure


@styled
def strain_energy_density_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw the strain energy density at the four receptor types, for both edges of the contact.

    Parameters
    ----------
    history : xarray.Dataset
        A history with receptors.
    events : Events, optional
        Its events; those from accumulated slip are marked.
    title : str, optional
        What the title adds, such as the run's label.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each type [J/m^3]; each has its own scale.
    """
    labels = ("time [s]", "strain energy density [J/m³]")
    figure, panels = figure_grid(4, 2, (3.6, 2.2), titled("Strain energy density", title), labels, share="x")
    signals = receptor_signals(history)
    for axes, kind in zip(panels, RECEPTOR_KINDS, strict=True):
        _draw_areas(axes, signals, "strain_energy_density", kind)
        axes.set_title(kind, pad=28.0 if axes in panels[:2] else 4.0, fontweight="bold")
        mark_run(axes, history, events.slip if events else None)
        axes.set_ylim(bottom=0.0)
        axes.set_xlim(float(signals["time"][0]), float(signals["time"][-1]))
    _name(panels[:2], history, events.slip if events else None)
    add_legend(figure, _area_keys())
    return figure


@styled
def force_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw normal and tangential force, their ratio, and the slipping area fraction.

    Parameters
    ----------
    history : xarray.Dataset
        A history.
    events : Events, optional
        Its events; those from accumulated slip are marked.
    title : str, optional
        What the title adds, such as the run's label.

    Returns
    -------
    matplotlib.figure.Figure
        Forces of the first body on the finger [N] above, ratios [-] below.
    """
    figure, panels = figure_grid(
        2, 1, (6.8, 2.2), titled("Forces and slipping area", title), ("time [s]", ""), share="x"
    )
    times = history["time"].values
    normal, tangential = _forces(history)
    scale, unit = _scale(float(np.abs(normal).max()), "N")
    panels[0].plot(times, scale * normal, color=BLUE, label="normal force")
    panels[0].plot(times, scale * tangential, color=VERMILLION, label="tangential force")
    panels[0].set_ylabel(f"force [{unit}]")
    panels[0].legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    _draw_ratios(panels[1], history)
    panels[1].legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    panels[1].set_ylabel("ratio, fraction")
    for axes in panels:
        mark_run(axes, history, events.slip if events else None)
        axes.set_xlim(times[0], times[-1])
    _name(panels[:1], history, events.slip if events else None)
    return figure


@styled
def force_overview_figure(histories: Mapping[str, xr.Dataset], events: Mapping[str, Events]) -> Figure:
    """Draw tangential over normal force and the slipping area fraction, a panel for each run.

    Parameters
    ----------
    histories : mapping of str to xarray.Dataset
        Histories by the runs' labels.
    events : mapping of str to Events
        Their events; those from accumulated slip are marked.
    """
    columns = columns_for(len(histories))
    panel = {1: (6.6, 3.0), 2: (3.8, 2.3)}.get(columns, (3.3, 2.3))
    title = "Tangential over normal force and slipping area"
    figure, panels = figure_grid(len(histories), columns, panel, title, ("time [s]", "ratio, fraction"))
    for axes, (label, history) in zip(panels, histories.items(), strict=True):
        _draw_ratios(axes, history)
        axes.set_title(label)
        own = events.get(label)
        mark_run(axes, history, own.slip if own else None)
    limit_to_slides(panels[0], histories, events)
    handles, names = panels[0].get_legend_handles_labels()
    add_legend(figure, {**dict(zip(names, handles, strict=True)), **event_keys()})
    return figure


@styled
def energy_figure(history: xr.Dataset, title: str = "") -> Figure:
    """Draw where the work of the plate goes, and what the balance leaves over; the small parts as shares of the work.

    Parameters
    ----------
    history : xarray.Dataset
        A history.
    title : str, optional
        What the title adds, such as the run's label.

    Returns
    -------
    matplotlib.figure.Figure
        Work, strain energy and friction above, the small parts and the imbalance below (absolute values).
    """
    figure, panels = figure_grid(2, 1, (6.8, 2.2), titled("Energy balance", title), ("time [s]", ""), share="x")
    large = {"external_work": ("work of the plate", BLACK), "strain_energy": ("strain energy", BLUE)}
    large |= {"friction_dissipation": ("friction", ORANGE)}
    small = {
        "kinetic_energy": ("kinetic energy", VERMILLION),
        "numerical_dissipation": ("numerical damping", PURPLE),
        "damping_dissipation": ("material damping", GREEN),
        "contact_energy": ("contact penalty", SKY),
        "energy_imbalance": ("imbalance", GREY),
    }
    times, work = history["time"].values, float(np.abs(history["external_work"].values).max())
    scale, unit = _scale(work, "J")
    for name, (label, colour) in large.items():
        panels[0].plot(times, scale * history[name].values, color=colour, label=label)
    for name, (label, colour) in small.items():
        share = np.abs(history[name].values) / (work or 1.0)
        panels[1].semilogy(times, np.maximum(share, _ROUNDING), color=colour, linewidth=1.0, label=label)
    panels[0].set_ylabel(f"energy [{unit}]")
    panels[1].set_ylabel("share of the largest work")
    for axes in panels:
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        axes.set_xlim(times[0], times[-1])
    return figure


def _draw_areas(axes: Axes, signals: xr.Dataset, name: str, kind: str) -> None:
    for area, colour in AREA_COLOURS.items():
        signal = signals[name].sel(kind=kind, area=area)
        if bool(signal.notnull().any()):
            axes.plot(signals["time"].values, signal.values, color=colour, linewidth=1.1)
        else:
            place = {"A": 0.6, "B": 0.3}[area]
            axes.text(0.5, place, f"no receptor in area {area}", transform=axes.transAxes, ha="center", color=GREY)


def _draw_peak_signal(axes: Axes, history: xr.Dataset, settings: PeakSettings) -> None:
    signal = peak_signal(history, settings)
    if signal is None:
        axes.text(0.5, 0.5, "no slide or no receptor", transform=axes.transAxes, ha="center")
        return
    table = acceleration_peaks(history, settings)
    floor = 1e-4 * float(signal.max())
    axes.semilogy(signal["time"].values, np.maximum(signal.values, floor), color=BLUE, linewidth=1.0)
    axes.plot([p.time for p in table.peaks], [p.height for p in table.peaks], "o", color=BLACK, markersize=4, zorder=5)
    if table.peaks:
        axes.axhline(table.noise_floor + table.threshold, color=GREY, linewidth=1.0)


def _draw_ratios(axes: Axes, history: xr.Dataset) -> None:
    times = history["time"].values
    normal, tangential = _forces(history)
    pressed = normal > 0.02 * normal.max()
    ratio = np.full(times.shape, np.nan)
    np.divide(np.abs(tangential), normal, out=ratio, where=pressed)
    friction = float(history["counterface_friction_coefficient"].values[0])
    axes.plot(times, slipping_fraction(history).values, color=ORANGE, linewidth=1.0, label="slipping area fraction")
    axes.plot(times, ratio, color=BLUE, label="tangential / normal force")
    axes.axhline(friction, color=BLACK, linewidth=0.9, linestyle=(0, (1, 1.5)), label="friction coefficient")
    axes.set_ylim(-0.03, max(1.05, 1.1 * friction))


def _forces(history: xr.Dataset) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return normal and tangential force of the first body on the finger [N]."""
    force = history["counterface_force"].values[:, 0]
    return force @ history["counterface_normal"].values[0], force @ plate_tangent(history)


def _name(panels: Sequence[Axes], history: xr.Dataset, events: SlipEvents | None) -> None:
    window = slide_window(history)
    for axes in panels:
        name_events(axes, window.start if window else None, events)


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
        place = (peaks.transition.time, top)
        offset = (8.0, -10.0)
        axes.annotate(f"cut, reaches {cut:.2g} m/s²", place, offset, textcoords="offset points", fontsize=8, color=GREY)


def _area_keys() -> dict[str, Artist]:
    names = {"A": "area A: edge at the smaller position", "B": "area B: edge at the larger position"}
    return {names[area]: Line2D([], [], color=colour) for area, colour in AREA_COLOURS.items()}


def _scale(largest: float, unit: str) -> tuple[float, str]:
    """Return a factor and a prefixed unit that make `largest` a number between 1 and 1000."""
    for exponent, prefix in ((0, ""), (3, "m"), (6, "µ"), (9, "n"), (12, "p")):
        if largest * 10.0**exponent >= 1.0:
            return 10.0**exponent, prefix + unit
    return 1.0, unit
