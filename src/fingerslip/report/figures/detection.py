"""Figures of what a slip detector needs and uses: learning curve, importance of rings, robustness."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from fingerslip.report.figures.style import BLUE, GREEN, GREY, ORANGE, add_legend, figure_grid, say, styled, titled

__all__ = ["assumption_figure", "importance_figure", "learning_curve_figure", "robustness_figure"]

#: What the amount of a disturbance of tracks means, by its name.
_AMOUNTS = {
    "lost": "share of positions lost",
    "noise": "noise added [unit of the tracks]",
    "slower": "only every nth frame",
}


@styled
def learning_curve_figure(points: Sequence[tuple[int, float, float]], title: str = "") -> Figure:
    """Draw how well a classifier does on test trials over the number of trials that it learned from.

    Parameters
    ----------
    points : sequence of (int, float, float)
        Trials, accuracy on frames and mean F1 of the classes.
    title : str, optional
        What the title adds.
    """
    labels = ("trials learned from", "on trials that were not seen")
    figure, (axes,) = figure_grid(1, 1, (6.0, 3.0), titled("Learning curve", title), labels)
    trials, accuracy, scores = (np.array(one, dtype=float) for one in zip(*points, strict=True))
    keys: dict[str, Artist] = {}
    (keys["accuracy"],) = axes.plot(trials, accuracy, "o-", color=BLUE)
    (keys["mean F1"],) = axes.plot(trials, scores, "s--", color=ORANGE)
    axes.set_xscale("log", base=2)
    axes.set_xticks(trials, [f"{one:g}" for one in trials])
    axes.minorticks_off()
    axes.set_ylim(None, 1.01)
    add_legend(figure, keys)
    return figure


class Interval(Protocol):
    """A value and the ends of its interval."""

    @property
    def value(self) -> float | None: ...
    @property
    def low(self) -> float | None: ...
    @property
    def high(self) -> float | None: ...


@styled
def assumption_figure(rows: Sequence[tuple[str, Mapping[str, Interval]]], title: str = "") -> Figure:
    """Draw accuracies with their intervals for each thing that may be assumed; a line is where the first row is.

    Parameters
    ----------
    rows : sequence of (str, mapping of str to interval)
        What is assumed, and the accuracy of each classifier with it.
    title : str, optional
        What the title adds.
    """
    labels = ("share of right frames, trials that were not seen", "")
    height = 0.8 + 0.27 * len(rows)
    figure, (axes,) = figure_grid(1, 1, (7.5, height), titled("Accuracy and what is assumed", title), labels)
    keys: dict[str, Artist] = {}
    for number, name in enumerate(rows[0][1]):
        colour, marker = ((BLUE, "o"), (ORANGE, "s"), (GREY, "^"), (GREEN, "D"))[number % 4]
        shown = [(row, one[name]) for row, (_, one) in enumerate(rows) if one[name].value is not None]
        centre = np.array([one.value for _, one in shown], dtype=float)
        ends = np.array([(one.low, one.high) for _, one in shown], dtype=float).T
        place = np.array([row for row, _ in shown]) + 0.12 * (number % 4)
        axes.hlines(place, *ends, color=colour, linewidth=1.2)
        (keys[name.replace("_", " ")],) = axes.plot(centre, place, marker, color=colour, markersize=4, linestyle="none")
        axes.axvline(centre[0], color=colour, linewidth=0.7, linestyle=":")
    axes.set_yticks(range(len(rows)), [name for name, _ in rows])
    axes.margins(y=0.02)
    axes.invert_yaxis()
    add_legend(figure, keys)
    return figure


@styled
def importance_figure(drops: Mapping[int, float], title: str = "") -> Figure:
    """Draw by how much accuracy falls when the features of a ring of markers are shuffled.

    Parameters
    ----------
    drops : mapping of int to float
        Fall in accuracy by ring, 0 in the centre.
    title : str, optional
        What the title adds.
    """
    labels = ("ring, 0 in the centre", "fall in accuracy when it is shuffled")
    figure, (axes,) = figure_grid(1, 1, (6.0, 2.8), titled("Importance of rings", title), labels)
    axes.bar(list(drops), list(drops.values()), color=BLUE, width=0.6)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set_xticks(list(drops))
    return figure


@styled
def robustness_figure(results: Sequence[tuple[str, float, float, float]], title: str = "") -> Figure:
    """Draw how many frames a detector gets right over the amount of each disturbance.

    Parameters
    ----------
    results : sequence of (str, float, float, float)
        Disturbance, its amount, accuracy on the frames that could be classified, and share of those that could not.
    title : str, optional
        What the title adds.
    """
    names = list(dict.fromkeys(name for name, *_ in results))
    figure, panels = figure_grid(
        len(names), 3, (3.2, 2.6), titled("Robustness", title), ("amount", "share of frames"), share="none"
    )
    keys: dict[str, Artist] = {}
    for axes, name in zip(panels, names, strict=True):
        amount, accuracy, unusable = (
            np.array(one) for one in zip(*(row[1:] for row in results if row[0] == name), strict=True)
        )
        usable = unusable < 1.0
        (keys["right, of those classified"],) = axes.plot(amount[usable], accuracy[usable], "o-", color=BLUE)
        (keys["not classified: too few markers"],) = axes.plot(amount, unusable, "s--", color=GREY)
        axes.set_title(name)
        axes.set_xlabel(_AMOUNTS.get(name, "amount"))
        axes.set_ylim(-0.03, 1.03)
        if not usable.any():
            say(axes, "no frame can be classified")
    add_legend(figure, keys)
    return figure
