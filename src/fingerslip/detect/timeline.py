"""What a detector finds over time, and its figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fingerslip.detect.folders import AGAIN, CLIP
from fingerslip.detect.labels import Onsets
from fingerslip.detect.residual import ResidualSettings, Slide
from fingerslip.errors import DamagedError, shorten
from fingerslip.report.colours import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION
from fingerslip.report.figures.style import add_legend, figure_grid, with_style
from fingerslip.storage.files import csv_text, read_json, write_json, write_text
from fingerslip.version import __version__

Floats = NDArray[np.float64]

_TABLE = "timeline.csv"
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


def write_timeline(line: Timeline, folder: Path, origin: Mapping[str, str]) -> None:
    """Write what was found over time into a folder: a table, and what it is of with where that comes from."""
    columns = {"time [s]": line.time, "sure of slip [%]": line.sure}
    if line.displacement.size:
        columns |= {f"displaced [{line.unit}]": line.displacement, "left pattern [%]": line.left}
    rows = np.column_stack(list(columns.values())).tolist()
    write_text(folder / _TABLE, csv_text([list(columns), *([f"{value:.17g}" for value in row] for row in rows)]))
    slides = [{**vars(slide), "onsets": vars(slide.onsets)} for slide in line.slides]
    described = {"name": line.name, "unit": line.unit, "slides": slides, **origin, "fingerslip": __version__}
    write_json(folder / CLIP, described)


def read_timeline(folder: Path) -> Timeline:
    """Read back what was found over time."""
    described = read_json(folder / CLIP, AGAIN)
    try:
        columns = np.loadtxt(folder / _TABLE, delimiter=",", skiprows=1, ndmin=2).T
        slides = tuple(Slide(**{**entry, "onsets": Onsets(**entry["onsets"])}) for entry in described["slides"])
        time, sure, displacement, left = [*columns, *[np.zeros(0)] * 4][:4]
        return Timeline(described["name"], time, sure, slides, displacement, left, described["unit"])
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        raise DamagedError(str(folder / _TABLE), f"cannot be read ({shorten(str(error))})", AGAIN) from error


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
