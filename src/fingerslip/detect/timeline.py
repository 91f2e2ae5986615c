"""What a detector finds over time, and its figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fingerslip.detect.residual import ResidualSettings, Slide
from fingerslip.report.colours import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION
from fingerslip.report.figures.style import add_legend, figure_grid, with_style

Floats = NDArray[np.float64]

_PRESS = "#e3e3e3"
_NEW_REST: Mapping[str, Any] = {"color": GREY, "linestyle": (0, (1, 1.5)), "linewidth": 1.4}
_LINES: Mapping[str, tuple[str, Literal["--", "-"]]] = {
    "slip begins": (ORANGE, "--"),
    "gross slip begins": (VERMILLION, "-"),
}


@dataclass(frozen=True)
class Timeline:
    """What a detector finds over time; displacements and shares only of one that looks at each marker."""

    name: str  # of the clip
    time: Floats  # (n_times,) [s]
    sure: Floats  # (n_times,), probability of slip [%]
    slides: tuple[Slide, ...]
    displacement: Floats = field(default_factory=lambda: np.zeros(0))  # (n_times,) or none, root mean square
    left: Floats = field(default_factory=lambda: np.zeros(0))  # (n_times,) or none, markers that left the pattern [%]
    unit: str = ""  # of displacements


@with_style
def timeline_figure(line: Timeline) -> Figure:
    """Draw how far markers moved, how many left the pattern and how sure slip is, over time, with all events."""
    rows, time = line.displacement.size, line.time
    figure, panels = figure_grid(3 if rows else 1, 1, (7.2, 1.35), f"Slip in {line.name}", ("time [s]", ""), share="x")
    if rows:
        # Where the markers rest again, displacements begin anew.
        ends = [slide.end for slide in line.slides if slide.end is not None]
        panels[0].plot(time, np.where(np.isin(time, ends), np.nan, line.displacement), color=BLUE, linewidth=1.2)
        panels[0].set_ylabel(f"displaced [{line.unit}]")
        for end in ends:
            panels[0].axvline(end, **_NEW_REST)
        panels[1].plot(time, line.left, color=BLACK, linewidth=1.0)
        panels[1].axhline(100 * ResidualSettings().share, color=GREY, linewidth=0.8, linestyle=":")
        panels[1].set_ylabel("left pattern [%]")
        panels[1].set_ylim(-4, 104)
    panels[-1].fill_between(time, line.sure, color=SKY, linewidth=0)
    panels[-1].set_ylim(0, 104)
    panels[-1].set_ylabel("sure of slip [%]")
    for axes in panels:
        mark_events(axes, line.slides)
        for slide in line.slides:
            if slide.is_press:
                axes.axvspan(slide.start, time[-1] if slide.end is None else slide.end, color=_PRESS, zorder=0)
    seen = [[slide.onsets.incipient for slide in line.slides], [slide.onsets.gross for slide in line.slides]]
    keys: dict[str, Artist] = {
        name: Line2D([], [], color=colour, linestyle=dash)
        for (name, (colour, dash)), times in zip(_LINES.items(), seen, strict=True)
        if any(time is not None for time in times)
    }
    if rows and any(slide.end is not None for slide in line.slides):
        keys["new rest: displaced from there on"] = Line2D([], [], **_NEW_REST)
    if any(slide.is_press for slide in line.slides):
        keys["press, not judged"] = Patch(color=_PRESS)
    add_legend(figure, keys)
    return figure


def mark_events(axes: Axes, slides: Sequence[Slide]) -> None:
    """Draw lines where slip begins, and where it is gross."""
    for slide in slides:
        for when, (colour, dash) in zip((slide.onsets.incipient, slide.onsets.gross), _LINES.values(), strict=True):
            if when is not None:
                axes.axvline(when, color=colour, linestyle=dash, linewidth=1.4)
