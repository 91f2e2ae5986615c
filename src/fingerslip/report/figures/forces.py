"""Figures of forces and energies over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerslip.report.colours import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION
from fingerslip.report.figures.marks import limit_to_slides, mark_run, name_run, run_keys
from fingerslip.report.figures.slip import ShownTime, shown_time, shown_times
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, run_panels, with_style
from fingerslip.slip import Events, contact_forces, slipping_fraction

__all__ = ["draw_ratios", "energy_figure", "force_figure", "force_overview_figure"]

_ROUNDING = 1e-16
# Below this share of the largest normal force the ratio of the forces is rounding.
_PRESSED = 0.02

_LARGE_ENERGIES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "external_work": ("work of the plate", BLACK),
        "strain_energy": ("strain energy", BLUE),
        "friction_dissipation": ("friction", ORANGE),
    }
)
# Drawn where layers relax; older histories do not have it.
_VISCOUS = "viscous_dissipation"
_SMALL_ENERGIES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "kinetic_energy": ("kinetic energy", VERMILLION),
        "numerical_dissipation": ("numerical damping", PURPLE),
        "damping_dissipation": ("material damping", GREEN),
        "contact_energy": ("contact penalty", SKY),
        "energy_imbalance": ("imbalance", GREY),
    }
)


@with_style
def force_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw normal and tangential force, their ratio, and the slipping area fraction.

    Units: returns [N].
    """
    time_axis, forces = shown_time(history), contact_forces(history)
    figure, panels = _time_panels("Forces and slipping area", title, time_axis)
    times = time_axis.values
    scale, unit = _scale(float(np.abs(forces.normal).max()), "N")
    panels[0].plot(times, scale * forces.normal, color=BLUE, label="normal force")
    panels[0].plot(times, scale * forces.friction, color=VERMILLION, label="tangential force")
    panels[0].set_ylabel(f"force [{unit}]")
    draw_ratios(panels[1], history, times)
    panels[1].set_ylabel("ratio, fraction")
    for axes in panels:
        mark_run(axes, history, events.slip if events else None)
    _finish(panels, time_axis)
    name_run(panels[:1], history, events.slip if events else None)
    return figure


@with_style
def force_overview_figure(histories: Mapping[str, xr.Dataset], events: Mapping[str, Events]) -> Figure:
    """Draw tangential over normal force and the slipping area fraction, a panel for each run."""
    title = "Tangential over normal force and slipping area"
    time_axes = shown_times(tuple(histories.values()))
    figure, panels = run_panels(tuple(histories), title, (time_axes[0].label, "ratio, fraction"))
    for axes, (name, history), time in zip(panels, histories.items(), time_axes, strict=True):
        draw_ratios(axes, history, time.values)
        if time.logarithmic:
            time.fit(axes)
        events_of_run = events.get(name)
        mark_run(axes, history, events_of_run.slip if events_of_run else None)
    limit_to_slides(panels[0], histories, events)
    handles, names = panels[0].get_legend_handles_labels()
    add_legend(figure, {**dict(zip(names, handles, strict=True)), **run_keys(histories, events)})
    return figure


@with_style
def energy_figure(history: xr.Dataset, title: str = "") -> Figure:
    """Draw where the work of the plate goes, and the imbalance; the small parts as shares of the work."""
    time_axis = shown_time(history)
    figure, panels = _time_panels("Energy balance", title, time_axis)
    times, work = time_axis.values, float(np.abs(history["external_work"].values).max())
    scale, unit = _scale(work, "J")
    for name, (label, colour) in _LARGE_ENERGIES.items():
        panels[0].plot(times, scale * history[name].values, color=colour, label=label)
    if _VISCOUS in history and history[_VISCOUS].values.any():
        panels[0].plot(times, scale * history[_VISCOUS].values, color=GREEN, label="relaxation of the layers")
    for name, (label, colour) in _SMALL_ENERGIES.items():
        share = np.abs(history[name].values) / (work or 1.0)
        panels[1].semilogy(times, np.maximum(share, _ROUNDING), color=colour, linewidth=1.0, label=label)
    panels[0].set_ylabel(f"energy [{unit}]")
    panels[1].set_ylabel("share of the largest work")
    _finish(panels, time_axis)
    return figure


def _time_panels(title: str, more: str, time_axis: ShownTime) -> tuple[Figure, list[Axes]]:
    """Make two panels over time, one below the other."""
    return figure_grid(2, 1, (6.8, 2.2), join_title(title, more), (time_axis.label, ""), share="x")


def _finish(panels: Sequence[Axes], time_axis: ShownTime) -> None:
    """Give each panel its legend at its right, and all of the time."""
    for axes in panels:
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        time_axis.fit(axes)


def draw_ratios(axes: Axes, history: xr.Dataset, times: np.ndarray) -> None:
    """Draw the slipping area fraction, and tangential over normal force beside the friction coefficient."""
    ratio = contact_forces(history).ratio(_PRESSED)
    friction = float(history["counterface_friction_coefficient"].values[0])
    axes.plot(times, slipping_fraction(history).values, color=ORANGE, linewidth=1.0, label="slipping area fraction")
    axes.plot(times, ratio, color=BLUE, label="tangential / normal force")
    axes.axhline(friction, color=BLACK, linewidth=0.9, linestyle=(0, (1, 1.5)), label="friction coefficient")
    axes.set_ylim(-0.03, max(1.05, 1.1 * friction))


def _scale(largest: float, unit: str) -> tuple[float, str]:
    """Return a factor and a prefixed unit that make `largest` a number between 1 and 1000."""
    for exponent, prefix in ((0, ""), (3, "m"), (6, "µ"), (9, "n"), (12, "p")):
        if largest * 10.0**exponent >= 1.0:
            return 10.0**exponent, prefix + unit
    return 1.0, unit
