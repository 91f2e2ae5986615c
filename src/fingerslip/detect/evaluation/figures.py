"""Figures of detectors over trials, assumptions, features and disturbances, and the page of an evaluation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats
from fingerslip.detect.classifiers import optional
from fingerslip.detect.evaluation.crossval import UNREADABLE, read_arrays
from fingerslip.detect.evaluation.scores import Estimate, output_tables
from fingerslip.detect.folders import JUDGED, OF_EVALUATIONS
from fingerslip.detect.labels import Onsets, onsets_of, times_of
from fingerslip.errors import DamagedError, shorten
from fingerslip.report.colours import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION
from fingerslip.report.figures.style import add_legend, columns_for, figure_grid, join_title, say, with_style
from fingerslip.report.page.page import Picture, Report, ReportSection, write_page
from fingerslip.storage.files import new_file
from fingerslip.tables.table import Table
from fingerslip.version import __version__

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


_COLOURS = (BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY, BLACK, GREY)
_WORDS = ("no slip", "incipient", "gross")
_TRIALS = 24  # that the timelines show


@dataclass(frozen=True)
class Judged:
    """What a classifier says of trials that it has not seen: of their frames, or of whole ones."""

    # (3, 3), frames by true class (rows) and predicted class (columns); (2, 2) of whole trials, which slip or do not
    matrix: NDArray[np.intp]
    slip: Floats  # (n_samples,), probability of slip of each sampled frame or trial
    slips: Flags  # (n_samples,), whether it does
    events: Mapping[str, Onsets]  # onsets found, by trial; none of whole ones


Draw = Callable[[Mapping[str, Judged], Mapping[str, Onsets]], Figure]


def write_evaluation(
    tables: Sequence[Table], judged: Mapping[str, Judged], labels: Mapping[str, Onsets], folder: Path, title: str
) -> None:
    """Write the tables of an evaluation, what its figures are drawn of, and its page."""
    output_tables(tables, folder)
    write_judged(judged, labels, folder)
    kinds = figures_of(judged).items()
    pictures = [Picture(kind, f"Shows {OF_EVALUATIONS[kind]}.", draw(judged, labels)) for kind, draw in kinds]
    sections = (ReportSection("Figures", pictures=tuple(pictures)), ReportSection("Tables", tables=tuple(tables)))
    report = Report(title, sections, {"fingerslip": __version__}, "How well is slip found in trials not seen?")
    write_page(report, folder / "evaluation.html")


def _keys(judged: Mapping[str, Judged]) -> dict[str, str]:
    return {name: _COLOURS[number % len(_COLOURS)] for number, name in enumerate(judged)}


@with_style
def confusion_figure(matrices: Mapping[str, NDArray[np.intp]]) -> Figure:
    """Draw the confusion matrix of each classifier, rows in per cent, with the numbers of frames or trials."""
    columns = columns_for(len(matrices))
    figure, panels = figure_grid(len(matrices), columns, (3.0, 2.8), "Confusion", ("found", "true class"))
    for axes, (name, matrix) in zip(panels, matrices.items(), strict=True):
        share = matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
        axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0)
        for row, column in np.ndindex(share.shape):
            text = f"{100 * share[row, column]:.1f}\n({matrix[row, column]})"
            colour = "white" if share[row, column] > 0.6 else BLACK
            axes.text(column, row, text, ha="center", va="center", color=colour, fontsize=8)
        words = _WORDS if len(matrix) == len(_WORDS) else ("no slip", "slip")
        axes.set_xticks(range(len(words)), words)
        axes.set_yticks(range(len(words)), words, rotation=90, va="center")
        axes.tick_params(length=0)
        axes.set_title(name.replace("_", " "))
        axes.grid(visible=False)
    return figure


@with_style
def roc_figure(judged: Mapping[str, Judged]) -> Figure:
    """Draw the rate of frames with slip that are found over that of false alarms, with the area below."""
    metrics, keys = optional("sklearn.metrics"), {}
    figure, (axes,) = figure_grid(1, 1, (4.6, 3.6), "Slip or none", ("false alarms", "slip found"))
    for name, colour in _keys(judged).items():
        entry = judged[name]
        if len(np.unique(entry.slips)) > 1:
            false, right, _ = metrics.roc_curve(entry.slips, entry.slip)
            (line,) = axes.plot(false, right, color=colour)
            keys[f"{name.replace('_', ' ')} ({metrics.auc(false, right):.3f})"] = line
    axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8, linestyle=":")
    axes.set_aspect("equal")
    add_legend(figure, keys)
    return figure


@with_style
def calibration_figure(judged: Mapping[str, Judged]) -> Figure:
    """Draw how often frames slip over the probability of slip that they are said to have, in ten bins."""
    labels = ("probability of slip, said", "share that slips")
    figure, (axes,) = figure_grid(1, 1, (4.6, 3.6), "Calibration", labels)
    keys: dict[str, Artist] = {}
    for name, colour in _keys(judged).items():
        entry = judged[name]
        number = np.clip((10 * entry.slip).astype(np.intp), 0, 9)
        count = np.bincount(number, minlength=10)
        used = count > 0
        said, true = (np.bincount(number, values, 10)[used] / count[used] for values in (entry.slip, entry.slips))
        (keys[name.replace("_", " ")],) = axes.plot(said, true, "o-", color=colour, markersize=4)
    axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8, linestyle=":")
    axes.set_aspect("equal")
    add_legend(figure, keys)
    return figure


@with_style
def leads_figure(judged: Mapping[str, Judged], labels: Mapping[str, Onsets]) -> Figure:
    """Draw the share of the trials with gross slip in which slip was found, not early, so long before it or longer."""
    figure, (axes,) = figure_grid(1, 1, (6.0, 2.8), "Lead before gross slip", ("lead [s]", "share of trials"))
    keys: dict[str, Artist] = {}
    slips = [name for name, onsets in labels.items() if onsets.gross is not None]
    incipient, gross = times_of(labels[name] for name in slips).T
    for name, colour in _keys(judged).items():
        first = np.fmin(*times_of(judged[name].events[trial] for trial in slips).T)
        leads = np.sort((gross - first)[~(first < incipient) & np.isfinite(first)])
        if len(leads):
            shares = np.arange(len(leads), 0, -1) / len(slips)
            (keys[name.replace("_", " ")],) = axes.step(leads, shares, where="pre", color=colour)
    if not keys:
        say(axes, "no trial with gross slip in which slip was found")
    axes.set_ylim(0.0, 1.03)
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    add_legend(figure, keys)
    return figure


@with_style
def trials_figure(judged: Mapping[str, Judged], labels: Mapping[str, Onsets]) -> Figure:
    """Draw for each trial from when to when it slips in part, and when each classifier found slip."""
    trials = list(labels)[:_TRIALS]
    title = "Trials" if len(trials) == len(labels) else f"The first {_TRIALS} of {len(labels)} trials"
    figure, (axes,) = figure_grid(1, 1, (7.0, 0.8 + 0.22 * len(trials)), title, ("time [s]", ""))
    keys: dict[str, Artist] = {"incipient slip, label": Line2D([], [], color=SKY, linewidth=6)}
    for row, trial in enumerate(trials):
        onsets = labels[trial]
        if onsets.first is not None:
            last = onsets.first if onsets.gross is None else onsets.gross
            # The edge shows labels at which all slips at once, too.
            axes.barh(row, last - onsets.first, left=onsets.first, height=0.7, color=SKY, edgecolor=SKY, linewidth=1.5)
    for number, (name, colour) in enumerate(_keys(judged).items()):
        times = [judged[name].events[trial].first for trial in trials]
        rows = [row for row, time in enumerate(times) if time is not None]
        marker = "osD^vP*X"[number % 8]
        look: dict[str, Any] = {"color": colour, "marker": marker, "s": 18, "zorder": 3}
        keys[name.replace("_", " ")] = axes.scatter([time for time in times if time is not None], rows, **look)
    axes.use_sticky_edges = False
    axes.margins(x=0.04)
    axes.set_yticks(range(len(trials)), trials, fontsize=7)
    axes.set_ylim(len(trials) - 0.5, -0.5)
    add_legend(figure, keys)
    return figure


#: What draws the figures of an evaluation, by their kind, of what is said and of the labels.
FIGURES: Mapping[str, Draw] = {
    "confusion": lambda judged, _: confusion_figure({name: entry.matrix for name, entry in judged.items()}),
    "roc": lambda judged, _: roc_figure(judged),
    "calibration": lambda judged, _: calibration_figure(judged),
    "leads": leads_figure,
    "trials": trials_figure,
}
_OF_TIMES = ("leads", "trials")


def figures_of(judged: Mapping[str, Judged]) -> dict[str, Draw]:
    """Return what draws an evaluation, by kinds of figures: of whole trials those that need no times."""
    are_whole = all(len(entry.matrix) == 2 for entry in judged.values())
    return {kind: draw for kind, draw in FIGURES.items() if not are_whole or kind not in _OF_TIMES}


_PARTS = ("matrix", "slip", "slips", "events")


def write_judged(judged: Mapping[str, Judged], labels: Mapping[str, Onsets], folder: Path) -> None:
    """Write what classifiers say of trials, and the labels of these, into a folder."""
    arrays: dict[str, Any] = {"classifiers": np.array(list(judged)), "trials": np.array(list(labels))}
    arrays["labels"] = times_of(labels.values())
    for number, entry in enumerate(judged.values()):
        values = (entry.matrix, entry.slip, entry.slips, times_of(entry.events.values()))
        arrays |= {f"{part}-{number}": array for part, array in zip(_PARTS, values, strict=True)}
    with new_file(folder / JUDGED) as partial, partial.open("wb") as file:
        np.savez_compressed(file, **arrays)


def read_judged(folder: Path) -> tuple[dict[str, Judged], dict[str, Onsets]]:
    """Read back what classifiers say of trials, by classifier, and the labels by trial."""
    path = folder / JUDGED
    try:
        stored, judged = read_arrays(path), {}
        trials = stored["trials"].tolist()
        for number, name in enumerate(stored["classifiers"].tolist()):
            matrix, slip, slips, times = (stored[f"{part}-{number}"] for part in _PARTS)
            judged[name] = Judged(matrix, slip, slips, dict(zip(trials, onsets_of(times), strict=len(times) > 0)))
        return judged, dict(zip(trials, onsets_of(stored["labels"]), strict=True))
    except (*UNREADABLE, KeyError) as error:
        fault = f"cannot be read ({shorten(str(error))})"
        raise DamagedError(str(path), fault, "run fingerslip detect evaluate again") from error
