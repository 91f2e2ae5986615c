"""Figures over the runs of a study: event times against a swept number, latency against a swept word."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.published import PublishedSet, PublishedValue
from fingerslip.report.colours import BLACK, EVENT_COLOURS, READING_COLOURS
from fingerslip.report.figures.style import add_legend, columns_for, figure_grid, with_style
from fingerslip.report.labels import path_label, swept_text
from fingerslip.results import RunResult
from fingerslip.slip.windows import EVENTS, LATENCY, MAIN_EVENTS, READINGS
from fingerslip.uncertainty import SETTINGS, Convergence, Refinement, Series
from fingerslip.units import split_quantity

__all__ = [
    "convergence_figure",
    "event_times_figure",
    "latency_figure",
]


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

    Units: starts [s]; returns [s].
    """
    words = path_label(path)
    runs = [run for run in runs if starts is None or run.name in starts]
    axis, since = _Axis(runs, path), starts or dict.fromkeys((run.name for run in runs), 0.0)
    labels = (words, f"time from the start of the {'run' if starts is None else 'slide'} [s]")
    figure, panels = _group_panels(runs, path, (3.1, 3.0), f"Slip events against {words}", labels)
    beside = []
    for axes, members in panels:
        _draw_times(axes, sorted(members, key=axis.position), axis, since)
        beside.append(
            _draw_published_points(axes, _published_points(members, axis, _of(reference, MAIN_EVENTS), since))
        )
        axis.apply(axes)
    add_legend(figure, _event_keys(runs) | _published_key(any(beside)))
    return figure


@with_style
def latency_figure(
    runs: Sequence[RunResult],
    path: str = "fingertip.phalanx.variant",
    reference: PublishedSet | None = None,
) -> Figure:
    """Draw the latency from incipient to overall slip against a swept value, a panel for each combination of others.

    Units: returns [ms].
    """
    words = path_label(path)
    title = f"Latency from incipient to overall slip against {words}"
    figure, panels = _group_panels(runs, path, (2.8, 2.9), title, (words, "latency [ms]"))
    axis = _Axis(runs, path)
    beside = []
    for axes, members in panels:
        _draw_latencies(axes, sorted(members, key=axis.position), axis)
        values = _published_points(members, axis, _of(reference, (LATENCY,)))
        beside.append(
            _draw_published_points(axes, [(position, 1e3 * value, colour) for position, value, colour in values])
        )
        axis.apply(axes)
    panels[0][0].set_ylim(bottom=0.0)
    keys: dict[str, Artist] = {
        READINGS[reading]: Line2D([], [], linestyle="", marker=mark, color=READING_COLOURS[reading], markersize=6)
        for reading, mark in _reading_marks(runs).items()
        if any(run.events.reading(reading).latency is not None for run in runs)
    }
    add_legend(figure, keys | _published_key(any(beside)))
    return figure


def _group_panels(
    runs: Sequence[RunResult], path: str, panel: tuple[float, float], title: str, labels: tuple[str, str]
) -> tuple[Figure, list[tuple[Axes, list[RunResult]]]]:
    """Make a panel for each combination of the swept values other than that at `path`, a wide one where it is alone.

    Of more combinations than can be read side by side some are shown, evenly from the first to the last.
    """
    every = _groups([run for run in runs if path in run.swept], path)
    chosen = np.linspace(0, len(every) - 1, min(len(every), _MOST_PANELS)).round().astype(int)
    names = list(every)
    groups = {names[number]: every[names[number]] for number in chosen}
    if len(groups) < len(every):
        title += f", {len(groups)} of {len(every)} combinations of the other values"
    columns = columns_for(len(groups))
    size = panel if columns > 1 else (_WIDE, panel[1])
    figure, panels = figure_grid(len(groups), columns, size, title, labels)
    for axes, name in zip(panels, groups, strict=True):
        axes.set_title(name)
    return figure, list(zip(panels, groups.values(), strict=True))


class _Axis:
    """The horizontal axis: numbers where all values are numbers or quantities in one unit; else categories."""

    def __init__(self, runs: Sequence[RunResult], path: str) -> None:
        self._path = path
        self._values = list(dict.fromkeys(swept_text(run.swept[path]) for run in runs if path in run.swept))
        quantities = [_number_and_unit(value) for value in self._values]
        self.numeric = all(quantities) and len({unit for _, unit in filter(None, quantities)}) == 1

    def position(self, run: RunResult) -> float:
        """Return where a run stands on the axis."""
        value = swept_text(run.swept[self._path])
        return self._number(value) if self.numeric else float(self._values.index(value))

    def apply(self, axes: Axes) -> None:
        """Give a panel the ticks of the axis."""
        if self.numeric:
            axes.margins(x=0.12)
            if len(self._values) <= _MOST_TICKS:
                axes.set_xticks([self._number(value) for value in self._values], [str(value) for value in self._values])
            return
        axes.set_xticks(range(len(self._values)), [str(value) for value in self._values])
        axes.set_xlim(-0.5, len(self._values) - 0.5)

    @staticmethod
    def _number(value: object) -> float:
        quantity = _number_and_unit(value)
        assert quantity is not None  # the axis is numeric
        return quantity[0]


def _draw_times(axes: Axes, members: Sequence[RunResult], axis: _Axis, since: Mapping[str, float]) -> None:
    positions = [axis.position(run) for run in members]
    for event, (reading, mark) in itertools.product(MAIN_EVENTS, _READING_MARKS.items()):
        times = [_number(run.events.reading(reading).time(event)) - since[run.name] for run in members]
        colour = EVENT_COLOURS[event]
        axes.plot(
            positions,
            times,
            linestyle="-" if reading == "slip" and axis.numeric else "",
            marker=mark,
            color=colour,
            markerfacecolor=_face(reading, colour),
            markersize=5.5,
        )


def _draw_latencies(axes: Axes, members: Sequence[RunResult], axis: _Axis) -> None:
    for reading, mark in _READING_MARKS.items():
        positions = [axis.position(run) + (0.0 if axis.numeric else _SHIFTS[reading]) for run in members]
        latencies = [1e3 * _number(run.events.reading(reading).latency) for run in members]
        line = "-" if axis.numeric else ""
        axes.plot(positions, latencies, linestyle=line, marker=mark, color=READING_COLOURS[reading], markersize=6.5)


def _published_points(
    members: Sequence[RunResult],
    axis: _Axis,
    values: Sequence[PublishedValue],
    since: Mapping[str, float] | None = None,
) -> list[tuple[float, float, str]]:
    """Return positions of runs, the published values that they meet, less when their slides begin, and colours."""
    return [
        (
            axis.position(run),
            value.value - (since[run.name] if since else 0.0),
            EVENT_COLOURS.get(value.quantity, BLACK),
        )
        for run in members
        for value in values
        if value.value is not None and value.holds_for(run.all_values)
    ]


def _draw_published_points(axes: Axes, intervals: Sequence[tuple[float, float, str]]) -> bool:
    """Draw published values; tell whether there are any."""
    for position, value, colour in intervals:
        axes.plot([position], [value], **_PUBLISHED, color=colour, markersize=8, zorder=6)
    return bool(intervals)


def _of(reference: PublishedSet | None, quantities: Sequence[str]) -> tuple[PublishedValue, ...]:
    """Return the published values of some quantities."""
    return tuple(value for value in reference.values if value.quantity in quantities) if reference else ()


def _published_key(drawn: bool) -> dict[str, Artist]:
    return {"published": Line2D([], [], **_PUBLISHED, color=BLACK, markersize=7)} if drawn else {}


def _event_keys(runs: Sequence[RunResult]) -> dict[str, Artist]:
    """Return keys of the events, by colour, and of the recorded readings, by mark."""
    keys: dict[str, Artist] = {
        EVENTS[event]: Line2D([], [], color=EVENT_COLOURS[event], linewidth=2.0)
        for event in MAIN_EVENTS
        if any(run.events.reading(reading).time(event) is not None for run in runs for reading in READINGS)
    }
    for reading, mark in _reading_marks(runs).items():
        if not any(run.events.reading(reading).time(event) is not None for run in runs for event in MAIN_EVENTS):
            continue
        face = _face(reading, BLACK)
        keys[READINGS[reading]] = Line2D(
            [], [], linestyle="", marker=mark, color=BLACK, markerfacecolor=face, markersize=5.5
        )
    return keys


def _reading_marks(runs: Sequence[RunResult]) -> dict[str, str]:
    """Return the marks of the readings that any run recorded."""
    return {
        reading: mark
        for reading, mark in _READING_MARKS.items()
        if any(run.events.reading(reading).recorded for run in runs)
    }


def _face(reading: str, colour: str) -> str:
    return "none" if reading == "displacement" else colour


def _groups(runs: Sequence[RunResult], path: str) -> dict[str, list[RunResult]]:
    """Group runs by their swept values other than that at `path`."""
    groups: dict[str, list[RunResult]] = {}
    for run in runs:
        others = {other: value for other, value in run.swept.items() if other != path}
        title = ", ".join(f"{path_label(other)} {swept_text(value)}" for other, value in others.items())
        groups.setdefault(title, []).append(run)
    return groups


def _number(value: float | None) -> float:
    """Return what matplotlib leaves out for an event that did not happen."""
    return np.nan if value is None else value


def _number_and_unit(value: object) -> tuple[float, str] | None:
    """Return the number of a value and its unit, which is empty for a plain number; None for anything else."""
    if isinstance(value, str):
        return split_quantity(value)
    return (float(value), "") if isinstance(value, int | float) and not isinstance(value, bool) else None


@with_style
def convergence_figure(quantities: Mapping[str, Convergence], title: str) -> Figure:
    """Draw how the slip events of a run change as settings are refined.

    Units: returns [ms].
    """
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
    keys = {EVENTS[event]: Line2D([], [], color=EVENT_COLOURS[event], linewidth=2.0) for event in MAIN_EVENTS}
    keys["limit"] = Line2D([], [], color=BLACK, marker="D", markerfacecolor="none", linestyle="")
    add_legend(figure, keys)
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
    if refinement.limit is None or refinement.order is None:
        axes.plot(sizes[rising], changes[rising], marker="o", color=colour, linestyle=(0, (1, 1.5)))
        return
    axes.plot(sizes[rising], changes[rising], marker="o", color=colour, linestyle="")
    # The curve of the observed order from the coarsest value down to the limit.
    limit, coarsest = 1e3 * (refinement.limit - value), rising[-1]
    along = np.linspace(0.0, 1.0, 100)
    axes.plot(along * sizes[coarsest], limit + (changes[coarsest] - limit) * along**refinement.order, color=colour)
    axes.plot([0.0], [limit], marker="D", markerfacecolor="none", color=colour, linestyle="")
