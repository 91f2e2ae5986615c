"""Figures over the runs of a study: event times against a swept value, latency by phalanx."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.published import PublishedSet
from fingerslip.report.figures.style import (
    BLACK,
    BLUE,
    EVENT_COLOURS,
    EVENT_NAMES,
    GREEN,
    ORANGE,
    add_legend,
    columns_for,
    figure_grid,
    styled,
)
from fingerslip.report.tables.events import WAYS, RunEvents
from fingerslip.slip import SlipEvents

__all__ = ["event_times_figure", "latency_figure"]

_EVENTS = ("incipient", "three_quarter", "overall")
_WAY_MARKS: Mapping[str, str] = MappingProxyType({"slip": "o", "displacement": "^", "acceleration": "X"})
_WAY_COLOURS: Mapping[str, str] = MappingProxyType({"slip": BLUE, "displacement": GREEN, "acceleration": ORANGE})


@styled
def event_times_figure(
    runs: Sequence[RunEvents],
    path: str = "contact.friction_coefficient",
    reference: PublishedSet | None = None,
) -> Figure:
    """Draw the event times against a swept value, a panel for each combination of the other swept values.

    Parameters
    ----------
    runs : sequence of RunEvents
        The runs; those without `path` among their swept values are left out.
    path : str, optional
        Dotted path of the value on the horizontal axis.
    reference : PublishedSet, optional
        Published values; those of the drawn events are shown where a run meets their conditions.

    Returns
    -------
    matplotlib.figure.Figure
        Times from the start of the run [s]; colour for the event, mark for the way of reading it; a line joins
        those from accumulated slip.
    """
    groups = _groups([run for run in runs if path in run.swept], path)
    columns = columns_for(len(groups))
    panel = (3.1 if columns > 1 else 5.2, 3.0)
    labels = (_words(path), "time from the start of the run [s]")
    figure, panels = figure_grid(len(groups), columns, panel, f"Slip events against {_words(path)}", labels)
    axis = _Axis.over(runs, path)
    for axes, (label, members) in zip(panels, groups.items(), strict=True):
        _draw_times(axes, members, axis, path)
        _draw_published_times(axes, members, axis, path, reference)
        axes.set_title(label)
        axis.apply(axes)
    add_legend(figure, _event_way_keys() | (_published_key() if reference else {}))
    return figure


@styled
def latency_figure(
    runs: Sequence[RunEvents],
    path: str = "fingertip.phalanx.variant",
    reference: PublishedSet | None = None,
) -> Figure:
    """Draw the latency from incipient to overall slip by phalanx, a panel for each combination of the other values.

    Parameters
    ----------
    runs : sequence of RunEvents
        The runs; those without `path` among their swept values are left out.
    path : str, optional
        Dotted path of the value on the horizontal axis.
    reference : PublishedSet, optional
        Published values; latencies are shown where a run meets their conditions.

    Returns
    -------
    matplotlib.figure.Figure
        Latency [ms] from each way of reading the events; none where one of the two events did not happen.
    """
    groups = _groups([run for run in runs if path in run.swept], path)
    columns = columns_for(len(groups))
    panel = (2.6 if columns > 1 else 5.2, 2.9)
    title = f"Latency from incipient to overall slip by {_words(path)}"
    figure, panels = figure_grid(len(groups), columns, panel, title, ("", "latency [ms]"))
    axis = _Axis.over(runs, path, categories=True)
    for axes, (label, members) in zip(panels, groups.items(), strict=True):
        _draw_latencies(axes, members, axis, path, reference)
        axes.set_title(label)
        axis.apply(axes)
    panels[0].set_ylim(bottom=0.0)
    keys: dict[str, Artist] = {
        WAYS[way]: Line2D([], [], linestyle="", marker=mark, color=_WAY_COLOURS[way], markersize=6)
        for way, mark in _WAY_MARKS.items()
    }
    add_legend(figure, keys | (_published_key() if reference else {}))
    return figure


class _Axis:
    """The horizontal axis: numbers where all values are numbers, else categories in order of appearance."""

    def __init__(self, values: Sequence[Any], *, categories: bool) -> None:
        self.values = list(dict.fromkeys(values))
        self.numeric = not categories and all(_is_number(value) for value in self.values)

    @classmethod
    def over(cls, runs: Sequence[RunEvents], path: str, *, categories: bool = False) -> _Axis:
        return cls([run.swept[path] for run in runs if path in run.swept], categories=categories)

    def place(self, value: object) -> float:
        return float(str(value)) if self.numeric else float(self.values.index(value))

    def apply(self, axes: Axes) -> None:
        if self.numeric:
            axes.set_xticks(sorted(float(value) for value in self.values))
            axes.margins(x=0.12)
            return
        axes.set_xticks(range(len(self.values)), [str(value) for value in self.values])
        axes.set_xlim(-0.5, len(self.values) - 0.5)


def _draw_times(axes: Axes, members: Sequence[RunEvents], axis: _Axis, path: str) -> None:
    for event in _EVENTS:
        for way, mark in _WAY_MARKS.items():
            line = "-" if way == "slip" else ""
            places = [axis.place(run.swept[path]) for run in members]
            times = [_number(getattr(getattr(run.events, way), event)) for run in members]
            face = EVENT_COLOURS[event] if way != "displacement" else "none"
            colour = EVENT_COLOURS[event]
            axes.plot(places, times, linestyle=line, marker=mark, color=colour, markerfacecolor=face, markersize=5.5)


def _draw_published_times(
    axes: Axes, members: Sequence[RunEvents], axis: _Axis, path: str, reference: PublishedSet | None
) -> None:
    for run in members:
        for value in reference.values if reference else ():
            if value.quantity in _EVENTS and value.value is not None and value.holds_for(run.all_values):
                _draw_published(axes, axis.place(run.swept[path]), value.value)


def _draw_latencies(
    axes: Axes, members: Sequence[RunEvents], axis: _Axis, path: str, reference: PublishedSet | None
) -> None:
    shift = {"slip": -0.2, "displacement": 0.0, "acceleration": 0.2}
    for way, mark in _WAY_MARKS.items():
        places = [axis.place(run.swept[path]) + shift[way] for run in members]
        latencies = [1e3 * _number(_latency(getattr(run.events, way))) for run in members]
        axes.plot(places, latencies, linestyle="", marker=mark, color=_WAY_COLOURS[way], markersize=6.5)
    for run in members:
        for value in reference.values if reference else ():
            if value.quantity == "latency" and value.value is not None and value.holds_for(run.all_values):
                _draw_published(axes, axis.place(run.swept[path]), 1e3 * value.value)


def _draw_published(axes: Axes, place: float, value: float) -> None:
    axes.plot([place], [value], marker="D", markersize=8, linestyle="", color=BLACK, markerfacecolor="none", zorder=6)


def _published_key() -> dict[str, Artist]:
    mark = Line2D([], [], linestyle="", marker="D", markersize=7, color=BLACK, markerfacecolor="none")
    return {"published": mark}


def _event_way_keys() -> dict[str, Artist]:
    keys: dict[str, Artist] = {EVENT_NAMES[e]: Line2D([], [], color=EVENT_COLOURS[e], linewidth=2.0) for e in _EVENTS}
    for way, mark in _WAY_MARKS.items():
        face = "none" if way == "displacement" else BLACK
        keys[WAYS[way]] = Line2D([], [], linestyle="", marker=mark, color=BLACK, markerfacecolor=face, markersize=5.5)
    return keys


def _groups(runs: Sequence[RunEvents], path: str) -> dict[str, list[RunEvents]]:
    """Group runs by their other swept values."""
    groups: dict[str, list[RunEvents]] = {}
    for run in runs:
        others = {other: value for other, value in run.swept.items() if other != path}
        label = ", ".join(f"{_words(other)} {value}" for other, value in others.items())
        groups.setdefault(label, []).append(run)
    return groups


def _words(path: str) -> str:
    """Turn a dotted path into words: ``fingertip.phalanx.variant`` is the phalanx."""
    parts = path.removesuffix(".enabled").removesuffix(".variant").split(".")
    return parts[-1].replace("_", " ")


def _latency(events: SlipEvents) -> float | None:
    return events.latency


def _number(value: float | None) -> float:
    """Return what matplotlib leaves out for an event that did not happen."""
    return np.nan if value is None else value


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
