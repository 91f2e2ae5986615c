"""Figures of the contact: forces, tractions, stick and slip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch as Swatch
from numpy.typing import NDArray

from fingerslip.contact.frames import sliding_direction
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import nearest_record
from fingerslip.report.colours import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    STATE_COLOURS,
    STATE_NAMES,
    VERMILLION,
)
from fingerslip.report.figures.marks import limit_to_slides, mark_run, name_run, run_keys
from fingerslip.report.figures.slip import ShownTime, shown_time, shown_times
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, run_panels, with_style
from fingerslip.slip import (
    Events,
    Patch,
    contact_forces,
    contact_patch,
    patch_series,
    slide_window,
    slipping_fraction,
    surface_strain_rates,
    surface_strains,
)
from fingerslip.slip.patch import triangle_states
from fingerslip.slip.windows import EVENTS, MAIN_EVENTS, counterface_normal

__all__ = [
    "draw_ratios",
    "energy_figure",
    "fill_patch",
    "force_figure",
    "force_overview_figure",
    "slip_frames_figure",
    "slip_onset_figure",
    "stick_ratio_figure",
    "surface_strain_figure",
    "touched_frame",
]


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


Floats = NDArray[np.float64]

_STRAIN_NAMES = {"along": "strain along the slide", "across": "strain across the slide", "shear": "shear strain"}
_APART = (0.92, 0.93, 0.94, 1.0)
_LABELS = ("along the slide [mm]", "across the slide [mm]")
_FRAMES = 9
_STRAIN_FRAMES = 4
_MARGIN = 0.8  # mm


@with_style
def slip_frames_figure(
    history: xr.Dataset, events: Events | None = None, times: Sequence[float] | None = None, title: str = ""
) -> Figure:
    """Draw where the contact sticks and slips, in frames over time.

    Units: times [s].
    """
    patch = contact_patch(history)
    moments = _with_events(history, events) if times is None else np.asarray(times, dtype=float)
    heading = join_title("Stick and slip of the contact, seen from below", title)
    figure, panels = figure_grid(len(moments), 3, _panel(history, patch, 2.6), heading, _LABELS)
    for axes, moment, before in zip(panels, moments, [None, *moments[:-1]], strict=True):
        states = triangle_states(history, patch, nearest_record(history, moment))
        _fill(axes, patch, history, [STATE_COLOURS[int(state)] for state in states])
        axes.set_title(f"{moment:.3f} s{_event_between(events, before, moment)}")
    add_legend(figure, {STATE_NAMES[state]: Swatch(color=STATE_COLOURS[state]) for state in (STICK, SLIP, OPEN)})
    return figure


@with_style
def surface_strain_figure(
    history: xr.Dataset, events: Events | None = None, component: str = "along", title: str = ""
) -> Figure:
    """Draw the Green-Lagrange strain of the skin surface and its rate over the contact at four times of the slide."""
    patch = contact_patch(history)
    strains = surface_strains(history, patch).sel(strain_component=component)
    rates = surface_strain_rates(strains)
    moments = _moments(history, events, _STRAIN_FRAMES)
    named = _STRAIN_NAMES[component]
    heading = join_title(f"Green-Lagrange {named}, and its rate, seen from below", title)
    size = _panel(history, patch, 2.5)
    figure, panels = figure_grid(2 * len(moments), len(moments), size, heading, _LABELS)
    for row, (field, label) in enumerate(((strains, f"{named} [%]"), (rates, "its rate [%/s]"))):
        row_panels = panels[row * len(moments) : (row + 1) * len(moments)]
        colours = _draw_fields(row_panels, (history, patch), 100.0 * field, moments)
        figure.colorbar(colours, ax=list(row_panels), label=label, shrink=0.9, extend="both")
    return figure


def fill_patch(axes: Axes, corners: Floats, colours: Sequence[str] | Floats) -> None:
    """Fill triangles without borders between them.

    Arrays: corners (n, 3, 2) [mm]; colours (n, 4).
    """
    axes.add_collection(PolyCollection(list(corners), facecolors=colours, edgecolors="face", linewidths=0.2))


def touched_frame(history: xr.Dataset, patch: Patch, points: Floats) -> tuple[Floats, Floats]:
    """Return two corners of a frame around all nodes that ever touch, or around all where none does.

    Arrays: points (n, 2) [m]; returns (2,) [mm].
    """
    ever = (history["contact_state"].values[:, patch.nodes] != OPEN).any(axis=0)
    framed = 1e3 * (points[ever] if ever.any() else points)
    return framed.min(axis=0) - _MARGIN, framed.max(axis=0) + _MARGIN


def _draw_fields(
    panels: Sequence[Axes], where: tuple[xr.Dataset, Patch], field: xr.DataArray, moments: Floats
) -> ScalarMappable:
    """Draw a field on the triangles in contact at some times, in colours that share one scale about zero."""
    history, patch = where
    steps = [nearest_record(history, moment) for moment in moments]
    touching = field["touching"].values
    seen = np.concatenate([np.abs(field.values[step][touching[step]]) for step in steps] + [np.zeros(1)])
    top = float(np.quantile(seen, 0.98)) or 1.0
    colours = ScalarMappable(Normalize(-top, top), "RdBu_r")
    for axes, moment, step in zip(panels, moments, steps, strict=True):
        paint = colours.to_rgba(field.values[step])
        paint[~touching[step]] = _APART
        _fill(axes, patch, history, paint)
        axes.set_title(f"{moment:.3f} s")
    return colours


def _fill(axes: Axes, patch: Patch, history: xr.Dataset, colours: Sequence[str] | Floats) -> None:
    """Fill the triangles of the patch and frame what ever touches."""
    fill_patch(axes, 1e3 * patch.points[patch.triangles], colours)
    low, high = touched_frame(history, patch, patch.points)
    axes.grid(visible=False)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")


def _panel(history: xr.Dataset, patch: Patch, width: float) -> tuple[float, float]:
    """Return the size of a panel [inch] that the patch fills, with room for title and labels."""
    low, high = touched_frame(history, patch, patch.points)
    return width, min(max((width - 0.4) * (high[1] - low[1]) / (high[0] - low[0]), 1.0), 3.0) + 0.5


def _moments(history: xr.Dataset, events: Events | None, count: int) -> Floats:
    """Return times of records from the start of the slide to shortly after overall slip, or all of a run without it."""
    times = history["time"].values
    window = slide_window(history)
    start, end = (window.start, window.end) if window else (float(times[0]), float(times[-1]))
    overall = events.overall if events else None
    if overall is not None:
        end = min(end, overall + 0.1 * (overall - start))
    moments: Floats = times[[nearest_record(history, moment) for moment in np.linspace(start, end, count)]]
    return moments


def _with_events(history: xr.Dataset, events: Events | None) -> Floats:
    """Return evenly spaced times, the nearest ones moved to the first records after the events."""
    moments, times = _moments(history, events, _FRAMES), history["time"].values
    free = np.arange(1, moments.size)
    for event in (events.slip.time(name) for name in MAIN_EVENTS) if events else ():
        if event is None or not moments[0] < event <= moments[-1] or free.size == 0:
            continue
        record = times[min(int(np.searchsorted(times, event)), times.size - 1)]
        chosen = free[np.abs(moments[free] - record).argmin()]
        moments[chosen] = record
        free = free[free != chosen]
    return np.sort(moments)


def _event_between(events: Events | None, before: float | None, moment: float) -> str:
    """Return the names of the events since the frame before."""
    if events is None or before is None:
        return ""
    times = {name: events.slip.time(name) for name in MAIN_EVENTS}
    passed = [EVENTS[name] for name, time in times.items() if time is not None and before < time <= moment]
    return f", after {', '.join(passed)}" if passed else ""


_COLUMNS, _WIDTH = 4, 2.0
_STUCK = (0.12, 0.16, 0.2, 1.0)
_ARROW = 0.3


@with_style
def slip_onset_figure(histories: Mapping[str, xr.Dataset], counterface: int = 0) -> Figure:
    """Draw when each part of the contact slips for good, a panel for each run, all in the same axes of the plate."""
    patches = {title: contact_patch(history, counterface) for title, history in histories.items()}
    onsets = {title: _onsets(history, patches[title]) for title, history in histories.items()}
    latest = max((float(np.nanmax(times, initial=0.0)) for times in onsets.values()), default=0.0)
    colours = ScalarMappable(Normalize(0.0, latest or 1.0), "viridis_r")
    axes_of_plate = _plate_axes(next(iter(histories.values())), counterface)
    points = {title: _points(history, patches[title], axes_of_plate) for title, history in histories.items()}
    frames = [touched_frame(history, patches[title], points[title]) for title, history in histories.items()]
    low, high = np.min([first for first, _ in frames], axis=0), np.max([last for _, last in frames], axis=0)
    size = _WIDTH, min(_WIDTH * (high[1] - low[1]) / (high[0] - low[0]), 3.0) + 0.4
    labels = tuple(f"{'xyz'[int(np.abs(axis).argmax())]} [mm]" for axis in axes_of_plate)
    heading = "When each part of the contact slips for good, seen from below"
    figure, panels = figure_grid(len(histories), min(_COLUMNS, len(histories)), size, heading, (labels[0], labels[1]))
    for axes, (title, times) in zip(panels, onsets.items(), strict=True):
        _draw_onsets(axes, 1e3 * points[title][patches[title].triangles], times, colours)
        _draw_arrow(axes, patches[title].axes[0] @ axes_of_plate.T, low, high)
        axes.grid(visible=False)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        axes.set_title(title)
    figure.colorbar(colours, ax=list(panels), label="time into the slide [s]", shrink=0.8)
    return figure


def _draw_onsets(axes: Axes, corners: Floats, times: Floats, colours: ScalarMappable) -> None:
    """Fill the triangles that touch; those that stick to the end have no time."""
    stuck, touched = np.isnan(times), ~(times < 0.0)
    paint = colours.to_rgba(times)
    paint[stuck] = _STUCK
    fill_patch(axes, corners[touched], paint[touched])


def _onsets(history: xr.Dataset, patch: Patch) -> Floats:
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
    return np.asarray(onset, dtype=float)


def _plate_axes(history: xr.Dataset, counterface: int) -> Floats:
    """Return two axes of the plate that do not depend on the slide, shape (2, 3)."""
    normal = counterface_normal(history, counterface)
    first = sliding_direction(normal)
    return np.array([first, np.cross(first, normal)])


def _points(history: xr.Dataset, patch: Patch, axes: Floats) -> Floats:
    """Return the coordinates of the nodes of a patch in axes of the plate [m], shape (n, 2)."""
    points: Floats = history["contact_position"].values[patch.nodes] @ axes.T
    return points


def _draw_arrow(axes: Axes, direction: Floats, low: Floats, high: Floats) -> None:
    """Draw the direction of the plate over the middle of the panel."""
    middle, length = 0.5 * (low + high), _ARROW * float(np.min(high - low))
    start = middle - 0.5 * length * direction
    axes.annotate(
        "",
        xy=tuple(start + length * direction),
        xytext=tuple(start),
        arrowprops={"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.6},
        zorder=5,
    )


@with_style
def stick_ratio_figure(histories: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Draw the stick ratio against the tangential force over the normal force."""
    heading = join_title("Stick ratio against tangential force", title)
    labels = ("tangential force / normal force", "sticking share of the contact area")
    figure, (axes,) = figure_grid(1, 1, (5.2, 3.4), heading, labels)
    for name, history in histories.items():
        window = slide_window(history)
        series = patch_series(history)
        chosen = series.isel(time=window.records) if window else series
        axes.plot(chosen["force_ratio"], chosen["stick_ratio"], label=name, linewidth=1.4)
    axes.set_ylim(-0.03, 1.03)
    if len(histories) > 1:
        axes.legend(fontsize=8)
    return figure
