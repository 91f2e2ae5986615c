"""Figures of a fit: the posterior of every pair of values, and measured curves beside those of the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from fingerslip.report.colours import BLACK, BLUE, GREY, SKY
from fingerslip.report.figures.style import add_legend, columns_for, figure_grid, with_style
from fingerslip.sampling.curves import OVER, Measurement, column_unit

Array = NDArray[np.float64]

_BINS, _LEVELS = 40, (0.95, 0.68)
_SMOOTHING, _MARGIN = 1.5, 0.3  # bins; shares of what is drawn of a value
#: How many columns are drawn.
MOST_PANELS = 6
_MOST_RUNS = 60
_SHOWN = {"m": ("mm", 1e3), "s": ("s", 1.0), "N": ("N", 1.0), "Pa": ("kPa", 1e-3)}


@with_style
def corner_figure(values: Array, labels: Sequence[str], units: Sequence[str], ranges: tuple[Array, Array]) -> Figure:
    """Draw samples (n, dim + 1), where they are: each value beside its prior, each pair with 68 and 95 % of them."""
    count = len(labels)
    ends = np.percentile(values, (0.5, 99.5), axis=0)
    margins = _MARGIN * np.ptp(ends, axis=0)
    limits = list(zip(np.maximum(ends[0] - margins, [*ranges[0], 0.0]), ends[1] + margins, strict=True))
    limits[:-1] = [(low, min(high, end)) for (low, high), end in zip(limits, ranges[1], strict=False)]
    figure, panels = figure_grid(count**2, count, (1.9, 1.9), "Posterior", ("", ""), share="none", lettered=False)
    for number, axes in enumerate(panels):
        row, column = divmod(number, count)
        axes.set_visible(row >= column)
        if row > column:
            _draw_pair(axes, values[:, column], values[:, row], (limits[column], limits[row]))
        elif row == column:
            axes.hist(values[:, row], bins=_BINS, range=limits[row], density=True, color=SKY)
            axes.axvline(float(np.median(values[:, row])), color=BLACK, linewidth=1.0)
            axes.set_yticks([])
            if row < count - 1:
                axes.axhline(1.0 / (ranges[1][row] - ranges[0][row]), color=GREY, linestyle="--", linewidth=1.0)
        axes.set_xlim(limits[column])
        axes.tick_params(labelbottom=row == count - 1, labelleft=row > column == 0)
        axes.locator_params(nbins=4)
        if row == count - 1:
            axes.set_xlabel(_with_unit(labels[column], units[column]))
        if row > column == 0:
            axes.set_ylabel(_with_unit(labels[row], units[row]))
    keys = {"posterior": Patch(color=SKY), "prior": Line2D([], [], color=GREY, linestyle="--")}
    keys |= {"68 %": Patch(color=BLUE, alpha=0.8), "95 %": Patch(color=BLUE, alpha=0.35)}
    add_legend(figure, {**keys, "median": Line2D([], [], color=BLACK)})
    return figure


def _with_unit(label: str, unit: str) -> str:
    return f"{label}\n[{unit}]" if unit else label


def _draw_pair(
    axes: Axes, first: Array, second: Array, limits: tuple[tuple[float, float], tuple[float, float]]
) -> None:
    counts, *edges = np.histogram2d(first, second, _BINS, limits)
    density = gaussian_filter(counts, _SMOOTHING)
    ordered = np.sort(density.ravel())[::-1]
    shares = np.cumsum(ordered) / ordered.sum()
    levels = [float(ordered[np.searchsorted(shares, level)]) for level in _LEVELS]
    middles = [0.5 * (edge[1:] + edge[:-1]) for edge in edges]
    for level, strength in zip(levels, (0.35, 0.7), strict=True):
        axes.contourf(*middles, density.T, [level, density.max() * 1.01], colors=[BLUE], alpha=strength)
    axes.plot(np.median(first), np.median(second), "+", color=BLACK)
    axes.set_ylim(limits[1])


@with_style
def fit_figure(measurement: Measurement, runs: Array, models: Array, predicted: Array) -> Figure:
    """Draw measured curves [SI] with those of the runs, the fitted model, and of what it predicts to be measured.

    All three are (n, n_columns, n_positions); of many columns the first ones are drawn.
    """
    columns = measurement.columns[:MOST_PANELS]
    shown_unit, factor = _SHOWN[OVER[measurement.over]]
    order = np.argsort(measurement.positions)
    positions = factor * measurement.positions[order]
    wide = columns_for(len(columns))
    labels = (f"{measurement.over} [{shown_unit}]", "")
    figure, panels = figure_grid(len(columns), wide, (4.2, 3.0), "Measured and fitted", labels, share="x")
    for number, (name, axes) in enumerate(zip(columns, panels, strict=True)):
        unit = column_unit(name)
        unit, scale = _SHOWN.get(unit, (unit, 1.0))
        axes.plot(positions, scale * runs[:_MOST_RUNS, number, order].T, color=GREY, linewidth=0.5, alpha=0.4)
        for curves, strength in ((predicted, 0.25), (models, 0.55)):
            low, high = scale * np.percentile(curves[:, number, order], (2.5, 97.5), axis=0)
            axes.fill_between(positions, low, high, color=BLUE, alpha=strength, linewidth=0.0, zorder=2)
        axes.plot(positions, scale * np.median(models[:, number, order], axis=0), color=BLUE, zorder=3)
        deviation = scale * float(measurement.deviations[number, 0])
        look = {"fmt": "o", "color": BLACK, "markersize": 3.0, "elinewidth": 0.7, "zorder": 4}
        axes.errorbar(positions, scale * measurement.values[number, order], deviation, **look)  # type: ignore[arg-type]
        axes.set_ylabel(f"{name.replace('_', ' ')} [{unit}]" if unit else name.replace("_", " "))
    add_legend(figure, {
        "measured ± deviation": Line2D([], [], color=BLACK, marker="o", linestyle="", markersize=3.0),
        "model, 95 %": Patch(color=BLUE, alpha=0.6),
        "with noise and discrepancy": Patch(color=BLUE, alpha=0.25),
        "runs": Line2D([], [], color=GREY, linewidth=0.8),
    })  # fmt: skip
    return figure
