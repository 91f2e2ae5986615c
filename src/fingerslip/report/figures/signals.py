"""Figures of what a run records: forces, energies, stick and slip along the contact, what receptors feel."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip import slip
from fingerslip.arrays import Floats
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import sites_of_kinds
from fingerslip.report import colours as palette
from fingerslip.report.figures import bodies, style, time_axis
from fingerslip.report.figures.patches import HAS_SLIPPED, slipped_share
from fingerslip.report.labels import of_histories
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip.windows import READINGS
from fingerslip.units import millimetres

_ROUNDING = 1e-16
# Below this share of the largest normal force the ratio of the forces is rounding.
PRESSED = 0.02
# Width and height of a panel by the number of columns [inch].
_PANELS = {1: (6.6, 3.0), 2: (3.8, 2.3), 3: (3.3, 2.3)}
SLIPS = "slips now"
# What figures say that mark another reading than accumulated slip.
_READ_FROM = "Events are those from {}."
_LARGE_ENERGIES: Mapping[str, tuple[str, str]] = {
    "external_work": ("work of the plate", palette.BLACK),
    "strain_energy": ("strain energy", palette.BLUE),
    "friction_dissipation": ("friction", palette.ORANGE),
    "viscous_dissipation": ("relaxation of the layers", palette.GREEN),  # where they relax
}
_SMALL_ENERGIES: Mapping[str, tuple[str, str]] = {
    "kinetic_energy": ("kinetic energy", palette.VERMILLION),
    "numerical_dissipation": ("time integration", palette.PURPLE),
    "damping_dissipation": ("material damping", palette.GREEN),
    "contact_energy": ("contact penalty", palette.SKY),
    "energy_imbalance": ("imbalance", palette.GREY),
}


@style.with_style
def force_figure(history: xr.Dataset, events: slip.Events = time_axis.NO_EVENTS, title: str = "") -> Figure:
    """Draw normal and tangential force, their ratio, the area that has slipped, and where there is room the body."""
    time = time_axis.shown_time(history)
    numbers: dict[int, str] = {}
    if bodies.has_pictures(history) and not style.is_narrow():
        numbers = time_axis.titles_at(
            history, bodies.frame_times(history, events, ("overall",)), bodies.picture_axis(history)
        )
    columns, heading = 2 if numbers else 1, style.join_title("Forces and slipped area", title)
    size, labels = (6.6 / columns, 2.1), (time.label, "")
    figure, every = style.figure_grid(2 * columns, columns, size, heading, labels, share="none")
    panels = every[::columns]
    draw_forces(panels[0], history, time.values)
    draw_ratios(panels[1], history, time)
    panels[1].set_ylabel("ratio, fraction")
    for axes in panels:
        time.fit(axes)
    time_axis.mark_panels(panels, history, events.slip)
    pictures = every[1::2] if numbers else []
    for axes, (number, words) in zip(pictures, numbers.items(), strict=False):
        bodies.draw_contact(axes, history, number, scaled=axes is pictures[0])
        style.name_panel(axes, words)
    for unused in pictures[len(numbers) :]:
        unused.set_visible(False)
    if numbers:
        bodies.add_stress_bar(figure, pictures[: len(numbers)], history)
    # Below the panels, where keys cover no line.
    style.add_legend(figure, drawn_keys(panels) | (bodies.picture_keys(history) if numbers else {}))
    return figure


def draw_forces(axes: Axes, history: xr.Dataset, times: Floats) -> None:
    """Draw normal and tangential force."""
    forces = slip.contact_forces(history)
    scale, unit = _scale(float(np.abs(forces.normal).max()), "N")
    axes.plot(times, scale * forces.normal, color=palette.BLACK, label="normal force")
    axes.plot(times, scale * forces.friction, color=palette.BLACK, linestyle="--", label="tangential force")
    # A section has the forces of its depth, which are those of no finger.
    depth = f" of {millimetres(float(history.attrs['depth']))}\ndepth" if "depth" in history.attrs else ""
    axes.set_ylabel(f"force{depth} [{unit}]")


@style.with_style
def force_overview_figure(histories: Mapping[str, xr.Dataset], events: Mapping[str, slip.Events]) -> Figure:
    """Draw tangential over normal force and the area that has slipped, a panel for each run."""
    title = "Tangential over normal force and slipped area"
    return _side_by_side(histories, events, (title, "ratio, fraction"), draw_ratios)


def _side_by_side(
    histories: Mapping[str, xr.Dataset],
    events: Mapping[str, slip.Events],
    words: tuple[str, str],
    draw: Callable[[Axes, xr.Dataset, time_axis.ShownTime], None],
    *,
    keys: Mapping[str, Artist] = MappingProxyType({}),
    before: float = 0.06,
    reading: str = "slip",
) -> Figure:
    """Draw the same of some runs, a panel for each; the words are the title and the label of the vertical axis."""
    times, columns = time_axis.shown_times(histories.values()), style.columns_for(len(histories))
    labels = (times[0].label, words[1])
    figure, panels = style.figure_grid(len(histories), columns, _PANELS[columns], words[0], labels)
    marked = [events.get(name, time_axis.NO_EVENTS).reading(reading) for name in histories]
    for axes, (name, history), time, of_run in zip(panels, histories.items(), times, marked, strict=True):
        style.name_panel(axes, name)
        draw(axes, history, time)
        if time.logarithmic:
            time.fit(axes)
        time_axis.mark_panels([axes], history, of_run, named=0)
    time_axis.limit_to_slides(panels[0], histories, events, before, marked if reading != "slip" else ())
    slides = any(slip.slide_window(history) for history in histories.values())
    marks = time_axis.event_keys(marked) if slides else {}
    style.add_legend(figure, {**(keys or drawn_keys(panels[:1])), **marks})
    return figure


def drawn_keys(panels: Sequence[Axes]) -> dict[str, Artist]:
    """Return keys of the labelled lines of panels."""
    return {name: line for axes in panels for line, name in zip(*axes.get_legend_handles_labels(), strict=True)}


@style.with_style
def energy_figure(history: xr.Dataset, title: str = "") -> Figure:
    """Draw where the work of the plate goes, and the imbalance; the small parts as shares of the work."""
    time, work = time_axis.shown_time(history), float(np.abs(history["external_work"].values).max())
    heading = style.join_title("Energy balance", title)
    figure, (large, small) = style.figure_grid(2, 1, (6.8, 2.2), heading, (time.label, ""), share="x")
    scale, unit = _scale(work, "J")
    for name, (label, colour) in _LARGE_ENERGIES.items():
        if name != "viscous_dissipation" or (name in history and history[name].values.any()):
            words = of_histories(label, [history])
            large.plot(time.values, scale * history[name].values, color=colour, label=words)
    for name, (label, colour) in _SMALL_ENERGIES.items():
        share = np.abs(history[name].values) / (work or 1.0)
        if share.max() > _ROUNDING or name == "energy_imbalance":
            small.semilogy(time.values, np.maximum(share, _ROUNDING), color=colour, linewidth=1.0, label=label)
    large.set_ylabel(f"energy [{unit}]")
    small.set_ylabel("share of the largest work")
    for axes in (large, small):
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        time.fit(axes)
    return figure


def draw_ratios(axes: Axes, history: xr.Dataset, time: time_axis.ShownTime) -> None:
    """Draw which share has slipped, as events count it, which slips, and tangential over normal force."""
    ratio = slip.contact_forces(history).ratio(PRESSED)
    friction = float(history["counterface_friction_coefficient"].values[0])
    axes.plot(time.values, slip.slipping_fraction(history).values, color=palette.ORANGE, linewidth=0.7, label=SLIPS)
    axes.plot(time.values, slipped_share(history), color=palette.ORANGE, linewidth=2.0, label=HAS_SLIPPED)
    axes.plot(time.values, ratio, color=palette.BLACK, label="tangential / normal force")
    axes.axhline(friction, color=palette.BLACK, linewidth=0.9, linestyle=(0, (1, 1.5)), label="friction coefficient")
    axes.set_ylim(-0.03, max(1.05, 1.1 * friction))


def _scale(largest: float, unit: str) -> tuple[float, str]:
    """Return a factor and a prefixed unit that make `largest` a number between 1 and 1000."""
    for exponent, prefix in ((0, ""), (3, "m"), (6, "µ"), (9, "n"), (12, "p")):
        if largest * 10.0**exponent >= 1.0:
            return 10.0**exponent, prefix + unit
    return 1.0, unit


@style.with_style
def held_figure(histories: Mapping[str, xr.Dataset]) -> Figure:
    """Draw the normal force over time, and how far rigid bodies move where they are free, a line for each run."""
    times = time_axis.shown_times(histories.values())
    drawn: dict[str, Callable[[xr.Dataset], dict[str, Floats]]] = {
        "normal force [mN]": lambda history: {"": 1e3 * slip.contact_forces(history).normal}
    }
    if all(history.sizes.get("rigid_body", 0) for history in histories.values()):

        def displacements(history: xr.Dataset) -> dict[str, Floats]:
            distances = 1e3 * np.linalg.norm(history["rigid_body_displacement"].values, axis=-1)
            names = map(str, history["rigid_body"].values) if distances.shape[1] > 1 else [""]
            return dict(zip(names, distances.T, strict=True))

        drawn["displacement of the body [mm]"] = displacements
    title = "Normal force and motion while nothing slides"
    figure, panels = style.figure_grid(len(drawn), 1, (6.6, 2.6), title, (times[0].label, ""), share="x")
    for axes, (label, signals) in zip(panels, drawn.items(), strict=True):
        axes.set_prop_cycle(color=palette.LINES)
        for (name, history), time in zip(histories.items(), times, strict=True):
            for body, values in signals(history).items():
                axes.plot(time.values, values, label=", ".join(filter(None, (name, body))))
        axes.set_ylabel(label)
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        if len(axes.lines) > 1:
            axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    max(times, key=lambda time: float(np.nanmax(time.values))).fit(panels[0])
    return figure


_MOST_COLUMNS = 700
_NODES_SHOWN = 9


@style.with_style
def slip_maps_figure(histories: Mapping[str, xr.Dataset], events: Mapping[str, slip.Events]) -> Figure:
    """Draw stick and slip along the surface over time, a panel for each run."""
    words = ("Stick and slip along the contact", of_histories("position along the plate [mm]", histories.values()))
    return _side_by_side(histories, events, words, draw_states, keys=style.state_keys((OPEN, STICK, SLIP)), before=0.3)


def draw_states(axes: Axes, history: xr.Dataset, time: time_axis.ShownTime) -> None:
    """Draw stick and slip along the surface over time."""
    state = history["contact_state"].values
    along = 1e3 * history["contact_position"].values @ slip.slide_tangent(history)
    touched = np.flatnonzero((state != OPEN).any(axis=0))
    if touched.size == 0:
        style.say(axes, "no contact")
        return
    order = touched[np.argsort(along[touched])]
    chosen = np.flatnonzero(np.isfinite(time.values))[:: max(history.sizes["time"] // _MOST_COLUMNS, 1)]
    axes.pcolormesh(
        np.exp(_borders(np.log(time.values[chosen]))) if time.logarithmic else _borders(time.values[chosen]),
        _borders(along[order]),
        state[chosen][:, order].T,
        cmap=ListedColormap([palette.STATE_COLOURS[each] for each in (OPEN, STICK, SLIP)]),
        norm=BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3),
        rasterized=True,
    )
    axes.grid(visible=False)


def _borders(centres: Floats) -> Floats:
    """Return the borders between cells round rising centres."""
    if centres.size == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate(([2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]))


@style.with_style
def contact_displacement_figure(
    history: xr.Dataset, events: slip.Events = time_axis.NO_EVENTS, title: str = ""
) -> Figure:
    """Draw the displacement of contact nodes along the plate against the plate's own."""
    labels = ("time [s]", "displacement since the slide began [mm]")
    heading = style.join_title(of_histories("Contact nodes against the plate", [history]), title)
    figure, (axes,) = style.figure_grid(1, 1, (6.6, 3.6), heading, labels)
    window, tangent = slip.slide_window(history), slip.slide_tangent(history)
    touching = np.flatnonzero(history["contact_state"].values[window.first] != OPEN) if window else np.empty(0, int)
    if window is None or touching.size == 0:
        style.say(axes, "no slide in contact")
        return figure
    # Nodes evenly over the contact at the start of the slide, both edges among them.
    order = touching[np.argsort(history["contact_position"].values[touching] @ tangent)]
    nodes = order[np.linspace(0, order.size - 1, min(_NODES_SHOWN, order.size)).round().astype(int)]
    positions = 1e3 * history["contact_position"].values[nodes] @ tangent
    colours = ScalarMappable(Normalize(float(positions.min()), float(positions.max())), "viridis")
    times = history["time"].values[window.records]
    skin = 1e3 * history["contact_displacement"].values[window.records][:, nodes] @ tangent
    plate = 1e3 * history["counterface_displacement"].values[window.records, 0] @ tangent
    for displacement, position in zip((skin - skin[0]).T, positions, strict=True):
        axes.plot(times, displacement, color=colours.to_rgba(np.array(position)), linewidth=1.2)
    look: dict[str, Any] = {"color": palette.BLACK, "linestyle": (0, (5, 2)), "linewidth": 1.6}
    axes.plot(times, plate - plate[0], label=of_histories("plate", [history]), **look)
    top = 1.25 * float(np.abs(skin - skin[0]).max())
    axes.set_ylim(*((-top, 0.08 * top) if plate[-1] < plate[0] else (-0.08 * top, top)))
    axes.set_xlim(times[0], time_axis.shown_span([window], [events.displacement])[1])
    style.add_keys_inside(axes, loc=f"{'lower' if plate[-1] < plate[0] else 'upper'} left")
    label = of_histories("position of the node\nalong the plate [mm]", [history])
    figure.colorbar(colours, ax=axes, label=label, pad=0.02)
    time_axis.mark_panels([axes], None, events.displacement)
    style.note_below(axes, _READ_FROM.format(READINGS["displacement"]))
    return figure


_AREA_NAMES = {"A": "area A: edge at the smaller position", "B": "area B: edge at the larger position"}
# Height of the note that an area has no receptor, as a share of the panel's.
_NOTE_HEIGHTS = {"A": 0.6, "B": 0.3}


@style.with_style
def acceleration_figure(history: xr.Dataset, events: slip.Events = time_axis.NO_EVENTS, title: str = "") -> Figure:
    """Draw the tangential acceleration at the recorded receptor types, for both edges of the contact."""
    labels = ("time [s]", of_histories("acceleration along the plate [m/s²]", [history]))
    kinds = _recorded_kinds(history)
    figure, panels = style.figure_grid(
        len(kinds), 1, (6.8, 1.45), style.join_title("Acceleration at the receptors", title), labels
    )
    signals, events_read = slip.receptor_signals(history), events.acceleration
    for axes, kind in zip(panels, kinds, strict=True):
        _draw_areas(axes, signals, "acceleration", kind, signals["time"].values)
        axes.set_title(kind, pad=28.0 if axes is panels[0] else 3.0, fontweight="bold")
    time_axis.limit_to_slides(panels[0], {title: history}, {title: events}, marked=[events_read])
    time_axis.mark_panels(panels, history, events_read)
    _fit_after_transition(panels[0], signals, slip.acceleration_peaks(history))
    style.note_below(panels[-1], _READ_FROM.format(READINGS["acceleration"]))
    style.add_legend(figure, _area_keys())
    return figure


@style.with_style
def acceleration_overview_figure(
    histories: Mapping[str, xr.Dataset], events: Mapping[str, slip.Events], settings: slip.PeakSettings | None = None
) -> Figure:
    """Draw the signal that acceleration peaks are read from, a panel for each run."""
    settings = settings or slip.PeakSettings()
    title = f"Largest acceleration at {' and '.join(settings.kinds)}, and events from its peaks"
    words = (title, of_histories("acceleration along the plate [m/s²]", histories.values()))
    keys: dict[str, Artist] = {
        "largest over the receptors": Line2D([], [], color=palette.BLUE, linewidth=1.0),
        "peak that counts": Line2D([], [], color=palette.BLACK, marker="o", markersize=4, linestyle=""),
        "height that a peak needs": Line2D([], [], color=palette.GREY, linewidth=1.0),
        _READ_FROM.format(READINGS["acceleration"]): Line2D([], [], linestyle="none"),
    }
    draw = functools.partial(_draw_peak_signal, settings)
    return _side_by_side(histories, events, words, draw, keys=keys, reading="acceleration")


@style.with_style
def strain_energy_density_figure(
    history: xr.Dataset, events: slip.Events = time_axis.NO_EVENTS, title: str = ""
) -> Figure:
    """Draw the strain energy density at the recorded receptor types, for both edges of the contact."""
    time, kinds, heading = time_axis.shown_time(history), _recorded_kinds(history), "Strain energy density"
    labels = (time.label, "strain energy density [J/m³]")
    columns, heading = 1 if style.is_narrow() else 2, style.join_title(heading, title)
    figure, panels = style.figure_grid(len(kinds), columns, (3.6, 2.2), heading, labels, share="x")
    signals = slip.receptor_signals(history)
    for axes, kind in zip(panels, kinds, strict=True):
        _draw_areas(axes, signals, "strain_energy_density", kind, time.values)
        axes.set_title(kind, pad=28.0 if axes in panels[:columns] else 4.0, fontweight="bold")
        axes.set_ylim(bottom=0.0)
        time.fit(axes)
    time_axis.mark_panels(panels, history, events.slip, named=columns)
    style.add_legend(figure, _area_keys())
    return figure


def _area_keys() -> dict[str, Artist]:
    return {_AREA_NAMES[area]: Line2D([], [], color=colour) for area, colour in palette.AREA_COLOURS.items()}


def _recorded_kinds(history: xr.Dataset) -> tuple[str, ...]:
    """Return the receptor types that a history records; all of them where it records none."""
    return tuple(kind for kind in RECEPTOR_KINDS if sites_of_kinds(history, (kind,)).size) or RECEPTOR_KINDS


def _draw_areas(axes: Axes, signals: xr.Dataset, name: str, kind: str, times: np.ndarray) -> None:
    for area, colour in palette.AREA_COLOURS.items():
        signal = signals[name].sel(kind=kind, area=area)
        if bool(signal.notnull().any()):
            axes.plot(times, signal.values, color=colour, linewidth=1.1)
        else:
            style.say(axes, f"no receptor in area {area}", _NOTE_HEIGHTS[area])


def _draw_peak_signal(settings: slip.PeakSettings, axes: Axes, history: xr.Dataset, _time: time_axis.ShownTime) -> None:
    signal = slip.peak_signal(history, settings)
    if signal is None:
        style.say(axes, "no slide or no receptor")
        return
    table = slip.acceleration_peaks(history, settings)
    floor = 1e-4 * float(signal.max())
    axes.semilogy(signal["time"].values, np.maximum(signal.values, floor), color=palette.BLUE, linewidth=1.0)
    axes.plot(
        [p.time for p in table.peaks], [p.height for p in table.peaks], "o", color=palette.BLACK, markersize=4, zorder=5
    )
    if table.peaks:
        axes.axhline(table.noise_floor + table.threshold, color=palette.GREY, linewidth=1.0)


def _fit_after_transition(axes: Axes, signals: xr.Dataset, peaks: slip.PeakTable) -> None:
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
        look = {"fontsize": mpl.rcParams["legend.fontsize"], "color": palette.GREY, "zorder": 6}
        look["bbox"] = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0}
        place = (peaks.transition.time, top), (8.0, -10.0)
        axes.annotate(f"cut, reaches {cut:.2g} m/s²", *place, textcoords="offset points", **look)
