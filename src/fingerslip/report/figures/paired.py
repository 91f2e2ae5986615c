"""The figure of two studies beside each other: overall slip and latency of the runs that both have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.report.colours import BLUE, GREY, VERMILLION
from fingerslip.report.figures.style import add_legend, figure_grid, styled
from fingerslip.results import RunResult

__all__ = ["Pair", "paired_figure"]

_MARKS = (("o", BLUE), ("s", VERMILLION))
_ROW = 0.28  # inch


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


@styled
def paired_figure(
    pairs: Sequence[Pair], names: tuple[str, str], starts: tuple[Mapping[str, float], Mapping[str, float]]
) -> Figure:
    """Draw overall slip from the start of the slide, and latency, of pairs of runs, a row for each pair.

    Units: starts [s].
    """
    size = (3.2, max(_ROW * len(pairs) + 0.5, 1.5))
    figure, (left, right) = figure_grid(2, 2, size, "Two studies side by side", ("", ""), share="none")
    _draw(left, [[_since(run, own) for run, own in zip(pair.runs, starts, strict=True)] for pair in pairs])
    _draw(right, [[_latency(run) for run in pair.runs] for pair in pairs])
    left.set_xlabel("overall slip from the start of the slide [s]")
    right.set_xlabel("latency [ms]")
    left.set_yticks(range(len(pairs)), [pair.title for pair in pairs])
    right.set_yticks(range(len(pairs)), [""] * len(pairs))
    keys = [Line2D([], [], linestyle="", marker=mark, color=colour) for mark, colour in _MARKS]
    add_legend(figure, dict(zip(names, keys, strict=True)))
    return figure


def _draw(axes: Axes, values: Sequence[Sequence[float]]) -> None:
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
