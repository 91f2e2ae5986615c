"""Figures of detectors: how well they do over trials, assumptions, features and disturbances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.arrays import Floats
from fingerslip.detect.evaluation.scores import Estimate
from fingerslip.report.colours import BLACK, BLUE, GREEN, GREY, ORANGE
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, say, with_style

#: What the amount of a disturbance of tracks means, by its name.
_AMOUNTS = {
    "lost": "share of positions lost",
    "noise": "noise added [unit of the tracks]",
    "slower": "only every nth frame",
}


@with_style
def learning_curve_figure(points: Sequence[tuple[int, Estimate, Estimate]], title: str = "") -> Figure:
    """Draw how well a classifier does on test trials over the number of trials that it learned from."""
    labels = ("trials learned from", "on trials that were not seen")
    figure, (axes,) = figure_grid(1, 1, (6.0, 3.0), join_title("Learning curve", title), labels)
    trials, accuracy, scores = zip(*points, strict=True)
    keys: dict[str, Artist] = {}
    # Intervals stand beside each other.
    before, behind = ([factor * count for count in trials] for factor in (0.985, 1.015))
    (keys["accuracy"],) = _draw_estimates(axes, before, accuracy, "o-", BLUE)
    (keys["mean F1"],) = _draw_estimates(axes, behind, scores, "s--", ORANGE)
    axes.set_xscale("log", base=2)
    axes.set_xticks(trials, [f"{trial:g}" for trial in trials])
    axes.minorticks_off()
    axes.set_ylim(None, 1.01)
    add_legend(figure, keys)
    return figure


@with_style
def assumption_figure(rows: Sequence[tuple[str, Mapping[str, Estimate]]], title: str = "") -> Figure:
    """Draw accuracies with their intervals for each thing that may be assumed; a line is where the first row is."""
    labels = ("share of right frames, trials that were not seen", "")
    height = 0.8 + 0.27 * len(rows)
    figure, (axes,) = figure_grid(1, 1, (7.5, height), join_title("Accuracy and what is assumed", title), labels)
    keys: dict[str, Artist] = {}
    for number, name in enumerate(rows[0][1]):
        colour, marker = ((BLUE, "o"), (ORANGE, "s"), (GREY, "^"), (GREEN, "D"))[number % 4]
        places = [row + 0.12 * (number % 4) for row in range(len(rows))]
        positions, centre, ends = _estimates(places, [estimates[name] for _, estimates in rows])
        axes.hlines(positions, *ends, color=colour, linewidth=1.2)
        look: dict[str, Any] = {"color": colour, "markersize": 4, "linestyle": "none"}
        (keys[name.replace("_", " ")],) = axes.plot(centre, positions, marker, **look)
        axes.axvline(centre[0], color=colour, linewidth=0.7, linestyle=":")
    axes.set_yticks(range(len(rows)), [name for name, _ in rows])
    axes.margins(y=0.02)
    axes.invert_yaxis()
    add_legend(figure, keys)
    return figure


@with_style
def importance_figure(drops: Mapping[int, Estimate], title: str = "") -> Figure:
    """Draw by how much accuracy falls when the features of a ring of markers are shuffled."""
    labels = ("ring, 0 in the centre", "fall in accuracy when it is shuffled")
    figure, (axes,) = figure_grid(1, 1, (6.0, 2.8), join_title("Importance of rings", title), labels)
    rings, centre, ends = _estimates(list(drops), list(drops.values()))
    axes.bar(rings, centre, color=BLUE, width=0.6)
    axes.vlines(rings, *ends, color=BLACK, linewidth=1.2)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set_xticks(list(drops))
    return figure


@with_style
def robustness_figure(results: Sequence[tuple[str, float, Estimate, float]], title: str = "") -> Figure:
    """Draw how many frames a detector gets right over the amount of each disturbance."""
    names = list(dict.fromkeys(name for name, *_ in results))
    figure, panels = figure_grid(
        len(names), 3, (3.2, 2.6), join_title("Robustness", title), ("amount", "share of frames"), share="none"
    )
    keys: dict[str, Artist] = {}
    for axes, name in zip(panels, names, strict=True):
        amount, accuracy, unusable = zip(*(row[1:] for row in results if row[0] == name), strict=True)
        (keys["right, of those classified"],) = _draw_estimates(axes, amount, accuracy, "o-", BLUE)
        (keys["not classified: too few markers"],) = axes.plot(amount, unusable, "s--", color=GREY)
        axes.set_title(name)
        axes.set_xlabel(_AMOUNTS.get(name, "amount"))
        axes.set_ylim(-0.03, 1.03)
        if min(unusable) >= 1.0:
            say(axes, "no frame can be classified")
    add_legend(figure, keys)
    return figure


def _estimates(places: Sequence[float], values: Sequence[Estimate]) -> tuple[Floats, Floats, Floats]:
    """Return places and values (n,) and the ends of their intervals (2, n), without what has no value."""
    rows = [
        (x, value.value, value.low, value.high)
        for x, value in zip(places, values, strict=True)
        if value.value is not None
    ]
    position, centre, *ends = np.array(rows, dtype=float).reshape(-1, 4).T
    return position, centre, np.array(ends)


def _draw_estimates(
    axes: Axes, places: Sequence[float], values: Sequence[Estimate], style: str, colour: str
) -> list[Line2D]:
    """Draw values with bars for their intervals; return the line."""
    position, centre, ends = _estimates(places, values)
    axes.vlines(position, *ends, color=colour, linewidth=1.2)
    return axes.plot(position, centre, style, color=colour)
