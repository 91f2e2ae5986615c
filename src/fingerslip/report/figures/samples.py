"""What sampled values do: sensitivity indices, tornado charts, and pairs of values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fingerslip.report.colours import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION
from fingerslip.report.figures.style import add_legend, figure_grid, with_style
from fingerslip.report.labels import path_label, short_labels, swept_text
from fingerslip.report.tables.samples import group_text
from fingerslip.results import RunResult
from fingerslip.sampling import Effect, Fit
from fingerslip.sampling.indices import Sensitivity
from fingerslip.slip.windows import READINGS, event_label

__all__ = [
    "Pair",
    "indices_figure",
    "paired_figure",
    "tornado_figure",
]


_WIDTH, _ROW, _AROUND = 5.2, 0.34, 0.7  # inch


@with_style
def indices_figure(sensitivities: Sequence[Sensitivity]) -> Figure:
    """Draw what moves an output, a panel for each group of runs, the value that matters most on top."""
    first = sensitivities[0]
    paths = [index.path for index in reversed(first.indices)]
    unit = f" [{first.unit}]" if first.unit else ""
    axis = "Sobol index [-]" if first.method == "sobol" else f"elementary effect{unit}"
    columns = min(len(sensitivities), 2)
    size = (_WIDTH / columns + 1.2, _ROW * len(paths) + _AROUND)
    figure, panels = figure_grid(len(sensitivities), columns, size, f"What moves {first.label}", (axis, ""))
    for axes, sensitivity in zip(panels, sensitivities, strict=True):
        _draw(axes, sensitivity, paths)
        axes.set_title(group_text(sensitivity.group))
    labels = short_labels(paths)
    panels[0].set_yticks(range(len(paths)), [labels[path] for path in paths])
    panels[0].set_ylim(-0.6, len(paths) - 0.4)
    names = ("total", "first order") if first.method == "sobol" else ("mean size", "standard deviation")
    add_legend(figure, {name: Patch(color=colour) for name, colour in zip(names, (BLUE, SKY), strict=True)})
    return figure


def _draw(axes: Axes, sensitivity: Sensitivity, paths: Sequence[str]) -> None:
    rows, index_of_path = np.arange(len(paths)), {index.path: index for index in sensitivity.indices}
    indices = [index_of_path[path] for path in paths]
    bars = (
        (0.2, [index.size for index in indices], [index.size_error for index in indices], BLUE),
        (-0.2, [index.other for index in indices], [index.other_error for index in indices], SKY),
    )
    for shift, sizes, errors, colour in bars:
        axes.barh(rows + shift, sizes, height=0.36, color=colour, zorder=2)
        # An elementary effect's standard deviation has no interval.
        if any(errors):
            style = {"ecolor": BLACK, "elinewidth": 0.9, "capsize": 2.0, "zorder": 3}
            axes.errorbar(sizes, rows + shift, xerr=errors, fmt="none", **style)  # type: ignore[arg-type]
    axes.axvline(0.0, color=BLACK, linewidth=0.7)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0.0)


_BAND, _WHOLE = "#dcdcdc", "#f0f0f0"
_WIDTHS = {1: 3.9, 2: 3.0, 3: 2.6}  # inch
_ROW_TORNADO, _AROUND_TORNADO = 0.21, 0.55  # inch
_LABELS = 1.9  # inch


@with_style
def tornado_figure(fits: Sequence[Fit], published: Mapping[int, tuple[float, float]] | None = None) -> Figure:
    """Draw the change of one slip time over the range of each value, a panel for each fit.

    Units: published [s].
    """
    largest = {effect.path: max(abs(_of(fit, effect.path).change) for fit in fits) for effect in fits[0].effects}
    paths = sorted(largest, key=lambda path: largest[path])
    title = f"What moves {event_label(fits[0].time)} ({READINGS[fits[0].reading]})"
    width = _WIDTHS.get(len(fits), _WIDTHS[3])
    labels = ("time from the start of the run [s]" if fits[0].time != "latency" else "latency [s]", "")
    size = (width + _LABELS / len(fits), _ROW_TORNADO * len(paths) + _AROUND_TORNADO)
    figure, panels = figure_grid(len(fits), min(len(fits), 3), size, title, labels)
    for number, (axes, fit) in enumerate(zip(panels, fits, strict=True)):
        _draw_tornado(axes, fit, paths, (published or {}).get(number))
        axes.set_title(", ".join(f"{path_label(path)} {swept_text(value)}" for path, value in fit.group.items()))
    panels[0].set_yticks(range(len(paths)), _labels(fits[0], paths))
    panels[0].set_ylim(-0.7, len(paths) - 0.3)
    add_legend(figure, _keys(bool(published)))
    return figure


def _draw_tornado(axes: Axes, fit: Fit, paths: Sequence[str], published: tuple[float, float] | None) -> None:
    """Draw the bars of one fit, the interval of its samples and the published time."""
    interval = fit.interval
    axes.axvspan(interval.smallest, interval.largest, color=_WHOLE, linewidth=0.0, zorder=0)
    axes.axvspan(interval.percentile(5), interval.percentile(95), color=_BAND, linewidth=0.0, zorder=0.5)
    effects = [_of(fit, path) for path in paths]
    rows, half = np.arange(len(paths)), np.array([0.5 * effect.change for effect in effects])
    axes.barh(rows, -half, left=fit.middle, height=0.66, color=BLUE, zorder=2)
    axes.barh(rows, half, left=fit.middle, height=0.66, color=ORANGE, zorder=2)
    errors = [0.5 * effect.change_error for effect in effects]
    style = {"fmt": "none", "ecolor": BLACK, "elinewidth": 0.8, "capsize": 0.0, "zorder": 3}
    axes.errorbar(fit.middle + half, rows, xerr=errors, **style)  # type: ignore[arg-type]
    axes.axvline(fit.middle, color=BLACK, linewidth=0.7, zorder=2.5)
    if published is not None:
        for end in dict.fromkeys(published):
            axes.axvline(end, color=BLACK, linestyle=(0, (4, 2)), linewidth=1.3, zorder=4)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0.0)


def _labels(fit: Fit, paths: Sequence[str]) -> list[str]:
    short = short_labels(paths)
    effects = [_of(fit, path) for path in paths]
    texts = [f"{short[effect.path]}, {effect.low:g} to {effect.high:g} {effect.unit}".strip() for effect in effects]
    return [text.replace(" -", " \N{MINUS SIGN}") for text in texts]


def _of(fit: Fit, path: str) -> Effect:
    return next(effect for effect in fit.effects if effect.path == path)


def _keys(is_published: bool) -> dict[str, Artist]:
    keys: dict[str, Artist] = {
        "at the smallest value": Patch(color=BLUE),
        "at the largest value": Patch(color=ORANGE),
        "5 to 95 % of the samples": Patch(color=_BAND),
        "all samples": Patch(color=_WHOLE),
    }
    if is_published:
        keys["published"] = Line2D([], [], color=BLACK, linestyle=(0, (4, 2)), linewidth=1.3)
    return keys


_MARKS = (("o", BLUE), ("s", VERMILLION))
_ROW_PAIRED = 0.28  # inch


@dataclass(frozen=True)
class Pair:
    """A run of each of two studies, with the same swept values."""

    title: str  # what both are called
    first: RunResult  # the runs
    second: RunResult  # the runs

    @property
    def runs(self) -> tuple[RunResult, RunResult]:
        """Both runs."""
        return self.first, self.second


@with_style
def paired_figure(
    pairs: Sequence[Pair], names: tuple[str, str], starts: tuple[Mapping[str, float], Mapping[str, float]]
) -> Figure:
    """Draw overall slip from the start of the slide, and latency, of pairs of runs, a row for each pair.

    Units: starts [s].
    """
    size = (3.2, max(_ROW_PAIRED * len(pairs) + 0.5, 1.5))
    figure, (left, right) = figure_grid(2, 2, size, "Two studies side by side", ("", ""), share="none")
    _draw_pairs(left, [[_since(run, start) for run, start in zip(pair.runs, starts, strict=True)] for pair in pairs])
    _draw_pairs(right, [[_latency(run) for run in pair.runs] for pair in pairs])
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


def _since(run: RunResult, starts: Mapping[str, float]) -> float:
    overall = run.events.overall
    return np.nan if overall is None or run.name not in starts else overall - starts[run.name]


def _latency(run: RunResult) -> float:
    latency = run.events.slip.latency
    return np.nan if latency is None else 1e3 * latency
