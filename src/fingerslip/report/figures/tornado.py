"""The tornado figure: what each sampled value does to a slip time over its range, the largest change on top."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fingerslip.report.colours import BLACK, BLUE, ORANGE
from fingerslip.report.figures.style import add_legend, figure_grid, styled
from fingerslip.report.labels import path_label, short_labels, swept_text
from fingerslip.sampling import Effect, Fit
from fingerslip.slip.names import READINGS, event_label

__all__ = ["tornado_figure"]

_BAND, _WHOLE = "#dcdcdc", "#f0f0f0"
_WIDTHS = {1: 3.9, 2: 3.0, 3: 2.6}  # inch
_ROW, _AROUND = 0.21, 0.55  # inch
_LABELS = 1.9  # inch


@styled
def tornado_figure(fits: Sequence[Fit], published: Mapping[int, tuple[float, float]] | None = None) -> Figure:
    """Draw the change of one slip time over the range of each value, a panel for each fit.

    Units: published [s].
    """
    largest = {one.path: max(abs(_of(fit, one.path).change) for fit in fits) for one in fits[0].effects}
    paths = sorted(largest, key=lambda path: largest[path])
    title = f"What moves {event_label(fits[0].time)} ({READINGS[fits[0].reading]})"
    width = _WIDTHS.get(len(fits), _WIDTHS[3])
    labels = ("time from the start of the run [s]" if fits[0].time != "latency" else "latency [s]", "")
    size = (width + _LABELS / len(fits), _ROW * len(paths) + _AROUND)
    figure, panels = figure_grid(len(fits), min(len(fits), 3), size, title, labels)
    for number, (axes, fit) in enumerate(zip(panels, fits, strict=True)):
        _draw(axes, fit, paths, (published or {}).get(number))
        axes.set_title(", ".join(f"{path_label(path)} {swept_text(value)}" for path, value in fit.group.items()))
    panels[0].set_yticks(range(len(paths)), _labels(fits[0], paths))
    panels[0].set_ylim(-0.7, len(paths) - 0.3)
    add_legend(figure, _keys(bool(published)))
    return figure


def _draw(axes: Axes, fit: Fit, paths: Sequence[str], published: tuple[float, float] | None) -> None:
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
    texts = [f"{short[one.path]}, {one.low:g} to {one.high:g} {one.unit}".strip() for one in effects]
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
