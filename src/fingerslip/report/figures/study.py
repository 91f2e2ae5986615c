"""Figures over the runs of a study: events against a swept value, over refinements, and what samples do."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fingerslip.published import PublishedSet
from fingerslip.report.colours import BLACK, BLUE, EVENT_COLOURS, GREEN, GREY, ORANGE, READING_COLOURS, SKY, VERMILLION
from fingerslip.report.figures.style import add_legend, columns_for, figure_grid, note_below, with_style
from fingerslip.report.labels import number_and_unit, path_label, path_labels, swept_text
from fingerslip.report.tables.samples import group_text
from fingerslip.results import RunResult
from fingerslip.sampling.indices import Sensitivity
from fingerslip.sampling.sensitivity import Fit
from fingerslip.slip.windows import EVENTS, LATENCY, MAIN_EVENTS, READINGS, event_label
from fingerslip.uncertainty import ORDERS, SETTINGS, Convergence

_READING_MARKS: Mapping[str, str] = {"slip": "o", "displacement": "^", "acceleration": "X"}
_WIDE = 4.6  # inch
# Swept numbers that are written below an axis one by one.
_MOST_TICKS = 8
_MOST_PANELS = 12
_PUBLISHED: Any = {"marker": "D", "linestyle": "", "markerfacecolor": "none"}
# Readings and events stand beside each other on an axis of categories, in shares of what is between two of them.
_READINGS_APART, _EVENTS_APART = 0.16, 0.05


@with_style
def event_times_figure(
    runs: Sequence[RunResult],
    path: str = "contact.friction_coefficient",
    reference: PublishedSet | None = None,
    starts: Mapping[str, float] | None = None,
) -> Figure:
    """Draw the event times against a swept value, with known uncertainties, a panel for each combination of others.

    Times [s] count from when the slides start [s], by the names of runs, or from the start of the runs.
    """
    runs = [run for run in runs if starts is None or run.name in starts]
    words = "Slip events", f"time from the start of the {'run' if starts is None else 'slide'} [s]"
    figure, panels, keys = _times_figure(runs, path, reference, EVENTS, words, starts=starts or {})
    if starts is not None:
        panels[0].set_ylim(bottom=0.0)
    happened = [event for event in EVENTS if any(_has_times(runs, reading, [event]) for reading in READINGS)]
    add_legend(figure, _event_keys(happened) | keys)
    return figure


@with_style
def latency_figure(
    runs: Sequence[RunResult], path: str = "fingertip.phalanx.variant", reference: PublishedSet | None = None
) -> Figure:
    """Draw the latency [ms] against a swept value, with known uncertainties, a panel for each combination of others."""
    words = "Latency from incipient to overall slip", "latency [ms]"
    figure, panels, keys = _times_figure(runs, path, reference, [LATENCY], words, starts={})
    panels[0].set_ylim(0.0, 1.04 * panels[0].get_ylim()[1])  # marks at the top are whole
    if any("bulk" in quantity.sources for run in runs for quantity in run.convergence.values()):
        note_below(panels[-1], "Bars leave out element sizes at the contact.")
    add_legend(figure, keys)
    return figure


def _mark(reading: str, colour: str, *, line: bool = False) -> dict[str, Any]:
    """Return how the times of events in a reading look."""
    # What is open is larger, so that it surrounds a mark that has the same value.
    face, size = ("none", 8.5) if reading == "displacement" else (colour, 5.5)
    look = {"color": colour, "markerfacecolor": face, "markersize": size}
    return {**look, "marker": _READING_MARKS[reading], "linestyle": "-" if line else ""}


def _times_figure(
    runs: Sequence[RunResult],
    path: str,
    reference: PublishedSet | None,
    times: Collection[str],
    words: tuple[str, str],
    *,
    starts: Mapping[str, float],
) -> tuple[Figure, list[Axes], dict[str, Artist]]:
    """Draw times against a swept value, and published ones of runs that meet their conditions; return their keys."""
    axis, is_latency = _Axis(runs, path, times), LATENCY in times
    scale, size = (1e3, (2.8, 2.9)) if is_latency else (1.0, (3.1, 3.0))
    title, labels = f"{words[0]} against {path_label(path)}", (axis.label, words[1])
    figure, panels = _group_panels(runs, path, size, title, labels)
    colours = READING_COLOURS if is_latency else dict.fromkeys(READINGS, BLACK)
    keys: dict[str, Artist] = {READINGS[name]: Line2D([], [], **_mark(name, colours[name])) for name in axis.readings}
    for axes, members in panels:
        ordered = sorted(members, key=axis.position)
        begin = [starts.get(run.name, 0.0) for run in ordered]
        for event, reading in itertools.product(times, axis.readings):
            colour = EVENT_COLOURS.get(event, colours[reading])
            positions = [axis.beside(run, reading, event) for run in ordered]
            values = np.array([run.events.reading(reading).time(event) for run in ordered], dtype=float) - begin
            joined = axis.joined and (is_latency or reading == "slip")
            axes.plot(positions, scale * values, **_mark(reading, colour, line=joined))
            errors = scale * np.array([run.uncertainty.get(f"{reading}.{event}") for run in ordered], dtype=float)
            if not np.isnan(errors).all():
                axes.errorbar(positions, scale * values, errors, fmt="none", ecolor=colour, capsize=3.0)
        for run, value in itertools.product(members, reference.values if reference else ()):
            is_drawn = value.quantity in times and value.quantity in (*MAIN_EVENTS, LATENCY)
            if is_drawn and value.value is not None and value.holds_for(run.all_values):
                time = scale * (value.value - starts.get(run.name, 0.0))
                colour = EVENT_COLOURS.get(value.quantity, BLACK)
                axes.plot([axis.position(run)], [time], **_PUBLISHED, color=colour, markersize=8, zorder=6)
                keys["published"] = Line2D([], [], **_PUBLISHED, color=BLACK, markersize=7)
        axis.apply(axes)
    return figure, [axes for axes, _ in panels], keys


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


def _has_times(runs: Iterable[RunResult], reading: str, times: Iterable[str]) -> bool:
    pairs = itertools.product((run.events.reading(reading) for run in runs), times)
    return any(events.time(time) is not None for events, time in pairs)


class _Axis:
    """The horizontal axis: numbers where all values are numbers or quantities in one unit; else categories."""

    def __init__(self, runs: Sequence[RunResult], path: str, times: Iterable[str]) -> None:
        self._path = path
        values = dict.fromkeys(swept_text(run.swept[path]) for run in runs if path in run.swept)
        quantities = {value: number_and_unit(value) for value in values}
        numbers = {value: quantity for value, quantity in quantities.items() if quantity}
        self.numeric = len(numbers) == len(values) and len({unit for _, unit in numbers.values()}) == 1
        self.has_ticks = not self.numeric or len(values) <= _MOST_TICKS  # one for each value, as it is written
        unit = "" if self.has_ticks else next(iter(numbers.values()))[1]
        self.label = f"{path_label(path)} [{unit}]" if unit else path_label(path)
        self.joined = self.numeric and not any(run.sampled for run in runs)  # samples differ in more than this value
        self._positions: dict[object, float] = {
            value: numbers[value][0] if self.numeric else float(number) for number, value in enumerate(values)
        }
        # What a single run has in one reading shows no trend beside another of several: it is left to the tables.
        counts = {name: sum(_has_times([run], name, times) for run in runs) for name in READINGS}
        self.readings = [name for name, count in counts.items() if count >= min(max(counts.values()), 2) > 0]

    def position(self, run: RunResult) -> float:
        """Return where a run stands on the axis."""
        return self._positions[swept_text(run.swept[self._path])]

    def beside(self, run: RunResult, reading: str, event: str = LATENCY) -> float:
        """Return where a time of a run is drawn: at its number, or where no category hides another time of it."""
        if self.numeric:
            return self.position(run)
        column = list(EVENTS).index(event) - 1.5 if event in EVENTS else 0.0
        row = self.readings.index(reading) - 0.5 * (len(self.readings) - 1) if reading in self.readings else 0.0
        return self.position(run) + _READINGS_APART * row + _EVENTS_APART * column

    def apply(self, axes: Axes) -> None:
        """Give a panel the ticks of the axis."""
        if self.numeric:
            axes.margins(x=0.12)
        if self.has_ticks:
            axes.set_xticks(list(self._positions.values()), [str(value) for value in self._positions])
        if not self.numeric:
            axes.set_xlim(-0.5, len(self._positions) - 0.5)


def _event_keys(events: Iterable[str]) -> dict[str, Artist]:
    return {EVENTS[event]: Line2D([], [], color=EVENT_COLOURS[event], linewidth=2.0) for event in events}


@with_style
def convergence_figure(quantities: Mapping[str, Convergence], title: str) -> Figure:
    """Draw how the slip events of a run, or the critical latencies of reactions, change [ms] with refined settings."""
    critical = [value for key, value in quantities.items() if key.startswith("reaction.critical")]
    lines = [(quantities[f"slip.{event}"], EVENT_COLOURS[event]) for event in MAIN_EVENTS if not critical]
    lines += zip(critical, (BLUE, ORANGE, GREEN, VERMILLION, SKY), strict=False)
    settings = [
        setting
        for setting in SETTINGS
        if setting.order is not None and any(setting.name in convergence.sources for convergence, _ in lines)
    ]
    what = "critical latencies" if critical else "slip events"
    labels = ("", f"change of the {'latency' if critical else 'event'} [ms]")
    figure, panels = figure_grid(len(settings), 3, (3.1, 3.0), f"Convergence of the {what}, {title}", labels)
    for axes, setting in zip(panels, settings, strict=True):
        axes.axhline(0.0, color=BLACK, linewidth=0.6)
        for index, (convergence, colour) in enumerate(lines):
            _draw_series(axes, convergence, setting.name, colour, bar_at=1.0 + 0.04 * (index + 1))
        axes.set_xlabel(setting.label)
        axes.set_xlim(left=-0.05)
    limit: Artist = Line2D([], [], color=BLACK, marker="D", markerfacecolor="none", linestyle="")
    keys = {line.quantity: Line2D([], [], color=colour, linewidth=2.0) for line, colour in lines if critical}
    add_legend(figure, (keys or _event_keys(MAIN_EVENTS)) | {"limit": limit})
    return figure


def _draw_series(axes: Axes, convergence: Convergence, setting: str, colour: str, bar_at: float) -> None:
    """Draw the changes of a number over a setting, and its error bar where it hides no other."""
    series, refinement = convergence.sources.get(setting), convergence.refinements.get(setting)
    if series is None or refinement is None or refinement.uncertainty is None or convergence.value is None:
        return
    sizes, order = np.array(series.sizes), refinement.order
    changes = 1e3 * (np.array(series.values, dtype=float) - convergence.value)
    rising = np.argsort(sizes)
    is_fitted = refinement.limit is not None and order is not None
    axes.plot(sizes[rising], changes[rising], marker="o", color=colour, linestyle="" if is_fitted else (0, (1, 1.5)))
    if refinement.limit is not None and order is not None:
        # The curve of the order in use from the coarsest value down to the limit.
        limit, coarsest = 1e3 * (refinement.limit - convergence.value), rising[-1]
        order = min(order, ORDERS[setting])
        along = np.linspace(0.0, 1.0, 100)
        axes.plot(along * sizes[coarsest], limit + (changes[coarsest] - limit) * along**order, color=colour)
        axes.plot([0.0], [limit], marker="D", markerfacecolor="none", color=colour, linestyle="")
    axes.errorbar([bar_at], [0.0], yerr=[1e3 * refinement.uncertainty], color=colour, capsize=3)


_WIDTH, _ROW, _AROUND = 5.2, 0.34, 0.7  # inch


@with_style
def indices_figure(sensitivities: Sequence[Sensitivity]) -> Figure:
    """Draw what moves an output, a panel for each group of runs, the value that matters most on top."""
    first = sensitivities[0]
    paths, rows = [index.path for index in reversed(first.indices)], np.arange(len(first.indices))
    is_sobol, columns = first.method == "sobol", min(len(sensitivities), 2)
    label = "Sobol index [-]" if is_sobol else f"elementary effect{f' [{first.unit}]' if first.unit else ''}"
    size = (_WIDTH / columns + 1.2, _ROW * len(paths) + _AROUND)
    figure, panels = figure_grid(len(sensitivities), columns, size, f"What moves {first.label}", (label, ""))
    for axes, sensitivity in zip(panels, sensitivities, strict=True):
        by_path = {index.path: index for index in sensitivity.indices}
        indices = [by_path[path] for path in paths]
        _draw_bars(axes, rows + 0.2, [index.size for index in indices], [index.size_error for index in indices], BLUE)
        _draw_bars(axes, rows - 0.2, [index.other for index in indices], [index.other_error for index in indices], SKY)
        axes.axvline(0.0, color=BLACK, linewidth=0.7)
        axes.set_title(group_text(sensitivity.group))
    labels = path_labels(paths)
    _name_rows(panels, [labels[path] for path in paths], 0.6, 0.4)
    names = ("total", "first order") if is_sobol else ("mean size", "standard deviation")
    add_legend(figure, {name: Patch(color=colour) for name, colour in zip(names, (BLUE, SKY), strict=True)})
    return figure


def _draw_bars(axes: Axes, rows: Any, sizes: Sequence[float], errors: Sequence[Any], colour: str) -> None:
    axes.barh(rows, sizes, height=0.36, color=colour, zorder=2)
    # An elementary effect's standard deviation has no interval.
    if any(errors):
        axes.errorbar(sizes, rows, xerr=errors, fmt="none", ecolor=BLACK, elinewidth=0.9, capsize=2.0, zorder=3)


def _name_rows(panels: Sequence[Axes], names: Sequence[str], below: float, above: float) -> None:
    """Write names beside the rows of bars, on the left of the first panel."""
    for axes in panels:
        axes.grid(visible=False, axis="y")
        axes.tick_params(axis="y", length=0.0)
    panels[0].set_yticks(range(len(names)), names)
    panels[0].set_ylim(-below, len(names) - above)


_BAND, _WHOLE = "#dcdcdc", "#f0f0f0"
_WIDTHS = {1: 3.9, 2: 3.0, 3: 2.6}  # inch
_ROW_TORNADO, _AROUND_TORNADO = 0.21, 0.55  # inch
_LABELS = 1.9  # inch


@with_style
def tornado_figure(fits: Sequence[Fit], published: Mapping[int, tuple[float, float]] | None = None) -> Figure:
    """Draw the change of one slip time over the range of each value, a panel for each fit; published times [s]."""
    effects = [{effect.path: effect for effect in fit.effects} for fit in fits]
    paths = sorted(effects[0], key=lambda path: max(abs(of_fit[path].change) for of_fit in effects))
    title = f"What moves {event_label(fits[0].time)} ({READINGS[fits[0].reading]})"
    label = "latency [s]" if fits[0].time == "latency" else "time from the start of the run [s]"
    width = _WIDTHS.get(len(fits), _WIDTHS[3])
    size = (width + _LABELS / len(fits), _ROW_TORNADO * len(paths) + _AROUND_TORNADO)
    figure, panels = figure_grid(len(fits), min(len(fits), 3), size, title, (label, ""))
    for number, (axes, fit) in enumerate(zip(panels, fits, strict=True)):
        _draw_tornado(axes, fit, [effects[number][path] for path in paths], (published or {}).get(number))
        axes.set_title(group_text(fit.group))
    labels, ranges = path_labels(paths), [effects[0][path] for path in paths]
    texts = [f"{labels[effect.path]}, {effect.low:g} to {effect.high:g} {effect.unit}".strip() for effect in ranges]
    _name_rows(panels, [text.replace(" -", " \N{MINUS SIGN}") for text in texts], 0.7, 0.3)
    keys: dict[str, Artist] = {
        "at the smallest value": Patch(color=BLUE),
        "at the largest value": Patch(color=ORANGE),
        "5 to 95 % of the samples": Patch(color=_BAND),
        "all samples": Patch(color=_WHOLE),
    }
    if published:
        keys["published"] = Line2D([], [], color=BLACK, linestyle=(0, (4, 2)), linewidth=1.3)
    add_legend(figure, keys)
    return figure


def _draw_tornado(axes: Axes, fit: Fit, effects: Sequence[Any], published: tuple[float, float] | None) -> None:
    """Draw the bars of one fit, the interval of its samples and the published time."""
    smallest, low, _, high, largest = fit.interval.summary
    axes.axvspan(smallest, largest, color=_WHOLE, linewidth=0.0, zorder=0)
    axes.axvspan(low, high, color=_BAND, linewidth=0.0, zorder=0.5)
    rows, half = np.arange(len(effects)), np.array([0.5 * effect.change for effect in effects])
    axes.barh(rows, -half, left=fit.middle, height=0.66, color=BLUE, zorder=2)
    axes.barh(rows, half, left=fit.middle, height=0.66, color=ORANGE, zorder=2)
    errors = [0.5 * effect.change_error for effect in effects]
    look: dict[str, Any] = {"fmt": "none", "ecolor": BLACK, "elinewidth": 0.8, "capsize": 0.0, "zorder": 3}
    axes.errorbar(fit.middle + half, rows, xerr=errors, **look)
    axes.axvline(fit.middle, color=BLACK, linewidth=0.7, zorder=2.5)
    for end in dict.fromkeys(published or ()):
        axes.axvline(end, color=BLACK, linestyle=(0, (4, 2)), linewidth=1.3, zorder=4)


_MARKS = (("o", BLUE), ("s", VERMILLION))
_ROW_PAIRED = 0.28  # inch


@dataclass(frozen=True)
class Pair:
    """A run of each of two studies, with the same swept values."""

    title: str  # what both are called
    runs: tuple[RunResult, RunResult]


def time_into_slide(run: RunResult, starts: Mapping[str, float]) -> float:
    """Return overall slip from the start of the slide [s]; NaN where it is not known."""
    overall = run.events.overall
    return np.nan if overall is None or run.name not in starts else overall - starts[run.name]


@with_style
def paired_figure(
    pairs: Sequence[Pair], names: tuple[str, str], starts: tuple[Mapping[str, float], Mapping[str, float]]
) -> Figure:
    """Draw overall slip from the start of the slide [s], and latency [ms], of pairs of runs, a row for each pair."""
    size = (3.2, max(_ROW_PAIRED * len(pairs) + 0.5, 1.5))
    figure, (left, right) = figure_grid(2, 2, size, "Two studies side by side", ("", ""), share="none")
    _draw_pairs(left, [[time_into_slide(*both) for both in zip(pair.runs, starts, strict=True)] for pair in pairs])
    latencies = [[run.events.slip.latency for run in pair.runs] for pair in pairs]
    _draw_pairs(right, [[np.nan if time is None else 1e3 * time for time in both] for both in latencies])
    left.set_xlabel("overall slip from the start of the slide [s]")
    right.set_xlabel("latency [ms]")
    left.set_yticks(range(len(pairs)), [pair.title for pair in pairs])
    right.set_yticks(range(len(pairs)), [""] * len(pairs))
    keys = [Line2D([], [], linestyle="", marker=mark, color=colour) for mark, colour in _MARKS]
    add_legend(figure, dict(zip(names, keys, strict=True)))
    return figure


def _draw_pairs(axes: Axes, values: Sequence[Sequence[float]]) -> None:
    for row, both in enumerate(values):
        axes.plot(both, [row, row], color=GREY, linewidth=1.0)
        for value, (mark, colour) in zip(both, _MARKS, strict=True):
            axes.plot([value], [row], marker=mark, color=colour, markersize=6)
    axes.set_ylim(len(values) - 0.5, -0.5)
    axes.margins(x=0.12)
