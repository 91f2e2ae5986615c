"""Figures of what a slip detector needs and uses: learning curve, importance of rings, robustness."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from fingerslip.report.colours import BLACK, BLUE, GREEN, GREY, ORANGE
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, say, with_style

__all__ = ["assumption_figure", "importance_figure", "learning_curve_figure", "robustness_figure"]

Floats = NDArray[np.float64]

#: What the amount of a disturbance of tracks means, by its name.
_AMOUNTS = {
    "lost": "share of positions lost",
    "noise": "noise added [unit of the tracks]",
    "slower": "only every nth frame",
}


class Interval(Protocol):
    """A value and the ends of its interval."""

    @property
    def value(self) -> float | None: ...
    @property
    def low(self) -> float | None: ...
    @property
    def high(self) -> float | None: ...


@with_style
def learning_curve_figure(points: Sequence[tuple[int, Interval, Interval]], title: str = "") -> Figure:
    """Draw how well a classifier does on test trials over the number of trials that it learned from."""
    labels = ("trials learned from", "on trials that were not seen")
    figure, (axes,) = figure_grid(1, 1, (6.0, 3.0), join_title("Learning curve", title), labels)
    trials, accuracy, scores = zip(*points, strict=True)
    keys: dict[str, Artist] = {}
    (keys["accuracy"],) = _with_intervals(axes, trials, accuracy, "o-", BLUE)
    (keys["mean F1"],) = _with_intervals(axes, trials, scores, "s--", ORANGE)
    axes.set_xscale("log", base=2)
    axes.set_xticks(trials, [f"{trial:g}" for trial in trials])
    axes.minorticks_off()
    axes.set_ylim(None, 1.01)
    add_legend(figure, keys)
    return figure


@with_style
def assumption_figure(rows: Sequence[tuple[str, Mapping[str, Interval]]], title: str = "") -> Figure:
    """Draw accuracies with their intervals for each thing that may be assumed; a line is where the first row is."""
    labels = ("share of right frames, trials that were not seen", "")
    height = 0.8 + 0.27 * len(rows)
    figure, (axes,) = figure_grid(1, 1, (7.5, height), join_title("Accuracy and what is assumed", title), labels)
    keys: dict[str, Artist] = {}
    for number, name in enumerate(rows[0][1]):
        colour, marker = ((BLUE, "o"), (ORANGE, "s"), (GREY, "^"), (GREEN, "D"))[number % 4]
        rows_shown = [
            (row, estimates[name]) for row, (_, estimates) in enumerate(rows) if estimates[name].value is not None
        ]
        centre = np.array([estimates.value for _, estimates in rows_shown], dtype=float)
        ends = np.array([(estimates.low, estimates.high) for _, estimates in rows_shown], dtype=float).T
        positions = np.array([row for row, _ in rows_shown]) + 0.12 * (number % 4)
        axes.hlines(positions, *ends, color=colour, linewidth=1.2)
        (keys[name.replace("_", " ")],) = axes.plot(
            centre, positions, marker, color=colour, markersize=4, linestyle="none"
        )
        axes.axvline(centre[0], color=colour, linewidth=0.7, linestyle=":")
    axes.set_yticks(range(len(rows)), [name for name, _ in rows])
    axes.margins(y=0.02)
    axes.invert_yaxis()
    add_legend(figure, keys)
    return figure


@with_style
def importance_figure(drops: Mapping[int, Interval], title: str = "") -> Figure:
    """Draw by how much accuracy falls when the features of a ring of markers are shuffled."""
    labels = ("ring, 0 in the centre", "fall in accuracy when it is shuffled")
    figure, (axes,) = figure_grid(1, 1, (6.0, 2.8), join_title("Importance of rings", title), labels)
    rings, centre, ends = _parts(list(drops), list(drops.values()))
    axes.bar(rings, centre, color=BLUE, width=0.6)
    axes.vlines(rings, *ends, color=BLACK, linewidth=1.2)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set_xticks(list(drops))
    return figure


@with_style
def robustness_figure(results: Sequence[tuple[str, float, Interval, float]], title: str = "") -> Figure:
    """Draw how many frames a detector gets right over the amount of each disturbance."""
    names = list(dict.fromkeys(name for name, *_ in results))
    figure, panels = figure_grid(
        len(names), 3, (3.2, 2.6), join_title("Robustness", title), ("amount", "share of frames"), share="none"
    )
    keys: dict[str, Artist] = {}
    for axes, name in zip(panels, names, strict=True):
        amount, accuracy, unusable = zip(*(row[1:] for row in results if row[0] == name), strict=True)
        (keys["right, of those classified"],) = _with_intervals(axes, amount, accuracy, "o-", BLUE)
        (keys["not classified: too few markers"],) = axes.plot(amount, unusable, "s--", color=GREY)
        axes.set_title(name)
        axes.set_xlabel(_AMOUNTS.get(name, "amount"))
        axes.set_ylim(-0.03, 1.03)
        if min(unusable) >= 1.0:
            say(axes, "no frame can be classified")
    add_legend(figure, keys)
    return figure


def _parts(places: Sequence[float], values: Sequence[Interval]) -> tuple[Floats, Floats, Floats]:
    """Return places and values (n,) and the ends of their intervals (2, n), without what has no value."""
    rows = [
        (position, estimate.value, estimate.low, estimate.high)
        for position, estimate in zip(places, values, strict=True)
    ]
    position, centre, *ends = np.array([row for row in rows if row[1] is not None], dtype=float).reshape(-1, 4).T
    return position, centre, np.array(ends)


def _with_intervals(
    axes: Axes, places: Sequence[float], values: Sequence[Interval], style: str, colour: str
) -> list[Line2D]:
    """Draw values with bars for their intervals; return the line."""
    position, centre, ends = _parts(places, values)
    axes.vlines(position, *ends, color=colour, linewidth=1.2)
    return axes.plot(position, centre, style, color=colour)
