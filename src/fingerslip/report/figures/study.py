"""Figures over the runs of a study: event times and latency against a swept value, events over refinements."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.published import PublishedSet
from fingerslip.report.colours import BLACK, EVENT_COLOURS, READING_COLOURS
from fingerslip.report.figures.style import add_legend, columns_for, figure_grid, with_style
from fingerslip.report.labels import number_and_unit, path_label, swept_text
from fingerslip.results import RunResult
from fingerslip.slip.windows import EVENTS, LATENCY, MAIN_EVENTS, READINGS
from fingerslip.uncertainty import SETTINGS, Convergence, Refinement, Series

_READING_MARKS: Mapping[str, str] = MappingProxyType({"slip": "o", "displacement": "^", "acceleration": "X"})
_WIDE = 4.6  # inch
# Swept numbers that are written below an axis one by one.
_MOST_TICKS = 8
_MOST_PANELS = 12
_PUBLISHED: Any = MappingProxyType({"marker": "D", "linestyle": "", "markerfacecolor": "none"})
# The readings stand beside each other where the axis has words.
_SHIFTS: Mapping[str, float] = MappingProxyType({"slip": -0.2, "displacement": 0.0, "acceleration": 0.2})


@with_style
def event_times_figure(
    runs: Sequence[RunResult],
    path: str = "contact.friction_coefficient",
    reference: PublishedSet | None = None,
    starts: Mapping[str, float] | None = None,
) -> Figure:
    """Draw the event times against a swept value, a panel for each combination of the other swept values.

    Times [s] count from when the slides start [s], by the names of runs, or from the start of the runs.
    """
    words = path_label(path)
    runs = [run for run in runs if starts is None or run.name in starts]
    axis, since = _Axis(runs, path), starts or dict.fromkeys((run.name for run in runs), 0.0)
    labels = (words, f"time from the start of the {'run' if starts is None else 'slide'} [s]")
    figure, panels = _group_panels(runs, path, (3.1, 3.0), f"Slip events against {words}", labels)
    published = False
    for axes, members in panels:
        ordered = sorted(members, key=axis.position)
        for event, (reading, mark) in itertools.product(MAIN_EVENTS, _READING_MARKS.items()):
            times = [_number(run.events.reading(reading).time(event)) - since[run.name] for run in ordered]
            line, colour = "-" if reading == "slip" and axis.numeric else "", EVENT_COLOURS[event]
            look: dict[str, Any] = {"color": colour, "markerfacecolor": _face(reading, colour), "markersize": 5.5}
            axes.plot([axis.position(run) for run in ordered], times, linestyle=line, marker=mark, **look)
        points = _published_points(members, reference, MAIN_EVENTS)
        for run, event, time in points:
            style = {**_PUBLISHED, "color": EVENT_COLOURS.get(event, BLACK), "markersize": 8, "zorder": 6}
            axes.plot([axis.position(run)], [time - since[run.name]], **style)
        published |= bool(points)
        axis.apply(axes)
    happened = {
        (reading, event) for run in runs for reading in READINGS for event in MAIN_EVENTS
        if run.events.reading(reading).time(event) is not None
    }  # fmt: skip
    keys = _event_keys(event for event in MAIN_EVENTS if event in {event for _, event in happened})
    for reading in _recorded_readings(runs):
        if reading in {reading for reading, _ in happened}:
            look = {"color": BLACK, "markerfacecolor": _face(reading, BLACK), "markersize": 5.5}
            keys[READINGS[reading]] = Line2D([], [], linestyle="", marker=_READING_MARKS[reading], **look)
    add_legend(figure, keys | _published_key(published))
    return figure


@with_style
def latency_figure(
    runs: Sequence[RunResult],
    path: str = "fingertip.phalanx.variant",
    reference: PublishedSet | None = None,
) -> Figure:
    """Draw the latency [ms] against a swept value, a panel for each combination of others."""
    words, axis = path_label(path), _Axis(runs, path)
    title = f"Latency from incipient to overall slip against {words}"
    figure, panels = _group_panels(runs, path, (2.8, 2.9), title, (words, "latency [ms]"))
    published = False
    for axes, members in panels:
        ordered = sorted(members, key=axis.position)
        for reading, mark in _READING_MARKS.items():
            positions = [axis.position(run) + (0.0 if axis.numeric else _SHIFTS[reading]) for run in ordered]
            latencies = [1e3 * _number(run.events.reading(reading).latency) for run in ordered]
            look: dict[str, Any] = {"color": READING_COLOURS[reading], "markersize": 6.5}
            axes.plot(positions, latencies, linestyle="-" if axis.numeric else "", marker=mark, **look)
        points = _published_points(members, reference, (LATENCY,))
        for run, _, latency in points:
            axes.plot([axis.position(run)], [1e3 * latency], **_PUBLISHED, color=BLACK, markersize=8, zorder=6)
        published |= bool(points)
        axis.apply(axes)
    panels[0][0].set_ylim(bottom=0.0)
    keys: dict[str, Artist] = {
        READINGS[name]: Line2D([], [], linestyle="", marker=mark, color=READING_COLOURS[name], markersize=6)
        for name, mark in _READING_MARKS.items()
        if any(run.events.reading(name).latency is not None for run in runs) and name in _recorded_readings(runs)
    }
    add_legend(figure, keys | _published_key(published))
    return figure


def _group_panels(
    runs: Sequence[RunResult], path: str, panel: tuple[float, float], title: str, labels: tuple[str, str]
) -> tuple[Figure, list[tuple[Axes, list[RunResult]]]]:
    """Make a panel for each combination of the swept values other than that at `path`, a wide one where it is alone.

    Of more combinations than can be read side by side some are shown, evenly from the first to the last.
    """
    groups: dict[str, list[RunResult]] = {}
    for run in runs:
        if path in run.swept:
            others = (f"{path_label(name)} {swept_text(value)}" for name, value in run.swept.items() if name != path)
            groups.setdefault(", ".join(others), []).append(run)
    chosen = np.linspace(0, len(groups) - 1, min(len(groups), _MOST_PANELS)).round().astype(int)
    names = [list(groups)[number] for number in chosen]
    if len(names) < len(groups):
        title += f", {len(names)} of {len(groups)} combinations of the other values"
    columns = columns_for(len(names))
    size = panel if columns > 1 else (_WIDE, panel[1])
    figure, panels = figure_grid(len(names), columns, size, title, labels)
    for axes, name in zip(panels, names, strict=True):
        axes.set_title(name)
    return figure, [(axes, groups[name]) for axes, name in zip(panels, names, strict=True)]


class _Axis:
    """The horizontal axis: numbers where all values are numbers or quantities in one unit; else categories."""

    def __init__(self, runs: Sequence[RunResult], path: str) -> None:
        self._path = path
        values = dict.fromkeys(swept_text(run.swept[path]) for run in runs if path in run.swept)
        quantities = {value: number_and_unit(value) for value in values}
        numbers = {value: quantity for value, quantity in quantities.items() if quantity}
        self.numeric = len(numbers) == len(values) and len({unit for _, unit in numbers.values()}) == 1
        self._positions: dict[object, float] = {
            value: numbers[value][0] if self.numeric else float(number) for number, value in enumerate(values)
        }

    def position(self, run: RunResult) -> float:
        """Return where a run stands on the axis."""
        return self._positions[swept_text(run.swept[self._path])]

    def apply(self, axes: Axes) -> None:
        """Give a panel the ticks of the axis."""
        if self.numeric:
            axes.margins(x=0.12)
        if not self.numeric or len(self._positions) <= _MOST_TICKS:
            axes.set_xticks(list(self._positions.values()), [str(value) for value in self._positions])
        if not self.numeric:
            axes.set_xlim(-0.5, len(self._positions) - 0.5)


def _published_points(
    runs: Sequence[RunResult], reference: PublishedSet | None, quantities: Sequence[str]
) -> list[tuple[RunResult, str, float]]:
    """Return published values [s] of some quantities with the runs that meet their conditions."""
    return [
        (run, value.quantity, value.value)
        for run in runs
        for value in (reference.values if reference else ())
        if value.quantity in quantities and value.value is not None and value.holds_for(run.all_values)
    ]


def _published_key(drawn: bool) -> dict[str, Artist]:
    return {"published": Line2D([], [], **_PUBLISHED, color=BLACK, markersize=7)} if drawn else {}


def _event_keys(events: Iterable[str]) -> dict[str, Artist]:
    return {EVENTS[event]: Line2D([], [], color=EVENT_COLOURS[event], linewidth=2.0) for event in events}


def _recorded_readings(runs: Sequence[RunResult]) -> list[str]:
    return [name for name in _READING_MARKS if any(run.events.reading(name).recorded for run in runs)]


def _face(reading: str, colour: str) -> str:
    return "none" if reading == "displacement" else colour


def _number(value: float | None) -> float:
    """Return what matplotlib leaves out for an event that did not happen."""
    return np.nan if value is None else value


@with_style
def convergence_figure(quantities: Mapping[str, Convergence], title: str) -> Figure:
    """Draw how the slip events of a run change [ms] as settings are refined."""
    events = {event: quantities[f"slip.{event}"] for event in MAIN_EVENTS}
    settings = [
        setting
        for setting in SETTINGS
        if setting.order is not None and any(setting.name in convergence.sources for convergence in events.values())
    ]
    labels = ("", "change of the event [ms]")
    figure, panels = figure_grid(len(settings), 3, (3.1, 3.0), f"Convergence of the slip events, {title}", labels)
    for axes, setting in zip(panels, settings, strict=True):
        _draw_setting(axes, setting.name, events)
        axes.set_xlabel(setting.label)
    limit: Artist = Line2D([], [], color=BLACK, marker="D", markerfacecolor="none", linestyle="")
    add_legend(figure, _event_keys(MAIN_EVENTS) | {"limit": limit})
    return figure


def _draw_setting(axes: Axes, setting: str, events: Mapping[str, Convergence]) -> None:
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    for index, (event, convergence) in enumerate(events.items()):
        series, refinement = convergence.sources.get(setting), convergence.refinements.get(setting)
        if series is None or refinement is None or refinement.uncertainty is None or convergence.value is None:
            continue
        _draw_series(axes, series, refinement, convergence.value, EVENT_COLOURS[event])
        # Bars of different events at one size would hide each other.
        bar_at = 1.0 + 0.04 * (index + 1)
        axes.errorbar([bar_at], [0.0], yerr=[1e3 * refinement.uncertainty], color=EVENT_COLOURS[event], capsize=3)
    axes.set_xlim(left=-0.05)


def _draw_series(axes: Axes, series: Series, refinement: Refinement, value: float, colour: str) -> None:
    sizes = np.array(series.sizes)
    changes = 1e3 * (np.array(series.values, dtype=float) - value)
    rising = np.argsort(sizes)
    is_fitted = refinement.limit is not None and refinement.order is not None
    axes.plot(sizes[rising], changes[rising], marker="o", color=colour, linestyle="" if is_fitted else (0, (1, 1.5)))
    if refinement.limit is None or refinement.order is None:
        return
    # The curve of the observed order from the coarsest value down to the limit.
    limit, coarsest = 1e3 * (refinement.limit - value), rising[-1]
    along = np.linspace(0.0, 1.0, 100)
    axes.plot(along * sizes[coarsest], limit + (changes[coarsest] - limit) * along**refinement.order, color=colour)
    axes.plot([0.0], [limit], marker="D", markerfacecolor="none", color=colour, linestyle="")
