"""What sampled values do: sensitivity indices, tornado charts, and pairs of runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fingerslip.report.colours import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION
from fingerslip.report.figures.style import add_legend, figure_grid, with_style
from fingerslip.report.labels import short_labels
from fingerslip.report.tables.samples import group_text
from fingerslip.results import RunResult
from fingerslip.sampling.indices import Sensitivity
from fingerslip.sampling.sensitivity import Fit
from fingerslip.slip.windows import READINGS, event_label

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
    labels = short_labels(paths)
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
    labels, ranges = short_labels(paths), [effects[0][path] for path in paths]
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
    interval = fit.interval
    axes.axvspan(interval.smallest, interval.largest, color=_WHOLE, linewidth=0.0, zorder=0)
    axes.axvspan(interval.percentile(5), interval.percentile(95), color=_BAND, linewidth=0.0, zorder=0.5)
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
    first: RunResult  # the run of the one
    second: RunResult  # the run of the other

    @property
    def runs(self) -> tuple[RunResult, RunResult]:
        """Both runs."""
        return self.first, self.second


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
