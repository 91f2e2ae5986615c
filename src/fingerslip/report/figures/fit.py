"""Figures of a fit: the posterior of every pair of values, and measured curves with those of the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from fingerslip.libraries import pd
from fingerslip.report.colours import BLACK, BLUE, GREY, SKY
from fingerslip.report.figures import style

Array = NDArray[np.float64]

_BINS, _LEVELS = 40, (0.95, 0.68)
_SMOOTHING, _MARGIN = 1.5, 0.3  # bins; shares of what is drawn of a value
#: How many columns are drawn.
MOST_PANELS = 6
_SHOWN = {"m": ("mm", 1e3), "s": ("s", 1.0), "N": ("N", 1.0), "Pa": ("kPa", 1e-3)}
_RUNS: Any = {"color": GREY, "alpha": 0.18, "linewidth": 0.0}


@style.with_style
def corner_figure(values: Array, labels: Sequence[str], units: Sequence[str], ranges: tuple[Array, Array]) -> Figure:
    """Draw samples (n, dim + 1), where they are: each value beside its prior, each pair with 68 and 95 % of them."""
    count = len(labels)
    ends = np.percentile(values, (0.5, 99.5), axis=0)
    margins = _MARGIN * np.ptp(ends, axis=0)
    limits = list(zip(np.maximum(ends[0] - margins, [*ranges[0], 0.0]), ends[1] + margins, strict=True))
    limits[:-1] = [(low, min(high, end)) for (low, high), end in zip(limits, ranges[1], strict=False)]
    figure, panels = style.figure_grid(count**2, count, (1.9, 1.9), "Posterior", ("", ""), share="none", lettered=False)
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
    style.add_legend(figure, {**keys, "median": Line2D([], [], color=BLACK)})
    return figure


def _with_unit(label: str, unit: str, between: str = "\n") -> str:
    return f"{label}{between}[{unit}]" if unit else label


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


@style.with_style
def fit_figure(curves: pd.DataFrame) -> Figure:
    """Draw measured curves with those of the fitted model, and below them residuals in standard deviations.

    The rows are those of ``curves.csv`` of a fit: a column, its unit, where it was measured, and numbers by name [SI].
    """
    over = str(curves.columns[2])
    label, _, unit = over.removesuffix("]").partition(" [")
    shown_unit, factor = _SHOWN[unit]
    columns = [values.sort_values(over) for _, values in curves.groupby("column", sort=False)]
    count = len(columns)
    wide = style.columns_for(count)
    rows = -(-count // wide)
    labels, ratios = (f"{label} [{shown_unit}]", ""), (3.0, 1.4) * rows
    title, panel = "Measured and fitted", (4.2, 1.8 if count == 1 else 2.5)
    figure, panels = style.figure_grid(
        2 * rows * wide, wide, panel, title, labels, share="x", heights=ratios, lettered=False
    )
    pairs = [panels[2 * row * wide + column :: wide][:2] for row in range(rows) for column in range(wide)]
    for axes in (axes for pair in pairs[count:] for axes in pair):
        axes.set_visible(False)
    style.letter_panels([above for above, _ in pairs] if count > 1 else ())
    for number, (values, (above, below)) in enumerate(zip(columns, pairs, strict=False)):
        name, si = values.iloc[0, :2]
        unit, scale = _SHOWN.get(si, (si, 1.0))
        positions = (factor * values[over]).to_numpy()
        above.fill_between(positions, *(scale * values[f"runs {end}"] for end in ("from", "to")), **_RUNS)
        _draw_curves(above, positions, values, 0.0, 1.0 / scale)
        _draw_curves(below, positions, values, *values[["model 50 %", "deviation"]].to_numpy().T)
        site, _, quantity = name.rpartition(".")
        style.name_panel(above, site)
        above.set_ylabel(_with_unit(quantity.replace("_", " "), unit, " "))
        if number % wide == 0:
            below.set_ylabel("residual [σ]")
        if number + wide >= count:
            below.tick_params(labelbottom=True)
            below.set_xlabel(labels[0])
    style.add_legend(figure, {
        "measured ± σ": Line2D([], [], color=BLACK, marker="o", linestyle="", markersize=3.0),
        "fitted model": Line2D([], [], color=BLUE),
        "model, 90 %": Patch(color=BLUE, alpha=0.55),
        "new data, 90 %": Patch(color=BLUE, alpha=0.25),
        "all runs": Patch(**_RUNS),
    })  # fmt: skip
    figure.align_ylabels()
    return figure


def _draw_curves(axes: Axes, positions: Array, values: pd.DataFrame, base: Array | float, size: Array | float) -> None:
    """Draw a measured curve, that of the model and its bands, less a base and over a size."""
    for band, strength in (("noisy", 0.25), ("model", 0.55)):
        low, high = ((values[f"{band} {percent} %"] - base) / size for percent in (5, 95))
        axes.fill_between(positions, low, high, color=BLUE, alpha=strength, linewidth=0.0, zorder=2)
    axes.plot(positions, (values["model 50 %"] - base) / size, color=BLUE, zorder=3)
    look: Any = {"fmt": "o", "color": BLACK, "markersize": 3.0, "elinewidth": 0.7, "zorder": 4}
    axes.errorbar(positions, (values["measured"] - base) / size, values["deviation"] / size, **look)
