"""The figure of sensitivities over whole ranges: Sobol indices or elementary effects, with their 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from fingerslip.report.colours import BLACK, BLUE, SKY
from fingerslip.report.figures.style import add_legend, figure_grid, styled
from fingerslip.report.labels import short_labels
from fingerslip.report.tables.samples import group_text
from fingerslip.sampling.indices import Sensitivity

__all__ = ["indices_figure"]

_WIDTH, _ROW, _AROUND = 5.2, 0.34, 0.7  # inch


@styled
def indices_figure(found: Sequence[Sensitivity]) -> Figure:
    """Draw what moves an output, a panel for each group of runs, the value that matters most on top."""
    first = found[0]
    paths = [index.path for index in reversed(first.indices)]
    unit = f" [{first.unit}]" if first.unit else ""
    axis = "Sobol index [-]" if first.method == "sobol" else f"elementary effect{unit}"
    columns = min(len(found), 2)
    size = (_WIDTH / columns + 1.2, _ROW * len(paths) + _AROUND)
    figure, panels = figure_grid(len(found), columns, size, f"What moves {first.label}", (axis, ""))
    for axes, one in zip(panels, found, strict=True):
        _draw(axes, one, paths)
        axes.set_title(group_text(one.group))
    labels = short_labels(paths)
    panels[0].set_yticks(range(len(paths)), [labels[path] for path in paths])
    panels[0].set_ylim(-0.6, len(paths) - 0.4)
    names = ("total", "first order") if first.method == "sobol" else ("mean size", "standard deviation")
    add_legend(figure, {name: Patch(color=colour) for name, colour in zip(names, (BLUE, SKY), strict=True)})
    return figure


def _draw(axes: Axes, one: Sensitivity, paths: Sequence[str]) -> None:
    rows, known = np.arange(len(paths)), {index.path: index for index in one.indices}
    indices = [known[path] for path in paths]
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
