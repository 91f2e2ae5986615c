"""What a detector finds in a clip over time: a table in a folder, and its figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fingerslip.detect.folders import AGAIN, CLIP
from fingerslip.detect.labels import Onsets
from fingerslip.detect.residual import ResidualSettings, Slide
from fingerslip.errors import DamagedError, shorten
from fingerslip.report.colours import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION
from fingerslip.report.figures.style import add_legend, figure_grid, with_style
from fingerslip.storage.files import frame_csv, read_json, write_json, write_text
from fingerslip.version import __version__

_TABLE = "timeline.csv"
_PRESS = "#e3e3e3"
_NEW_REST: Mapping[str, Any] = {"color": GREY, "linestyle": (0, (1, 1.5)), "linewidth": 1.4}
_LINES: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    "slip begins": ("incipient", {"color": ORANGE, "linestyle": "--"}),
    "gross slip begins": ("gross", {"color": VERMILLION, "linestyle": "-"}),
}


@dataclass(frozen=True)
class Timeline:
    """What a detector finds over time."""

    name: str  # of the clip
    slides: tuple[Slide, ...]
    # Time and probability of slip; of a detector that looks at each marker, how far they moved and how many left, too.
    values: pd.DataFrame


def write_timeline(line: Timeline, folder: Path, origin: Mapping[str, str]) -> None:
    """Write what was found over time into a folder: a table, and what it is of with where that comes from."""
    write_text(folder / _TABLE, frame_csv(line.values))
    slides = [{**vars(slide), "onsets": vars(slide.onsets)} for slide in line.slides]
    write_json(folder / CLIP, {"name": line.name, "slides": slides, **origin, "fingerslip": __version__})


def read_timeline(folder: Path) -> Timeline:
    """Read back what was found over time."""
    described = read_json(folder / CLIP, AGAIN)
    try:
        slides = tuple(Slide(**{**entry, "onsets": Onsets(**entry["onsets"])}) for entry in described["slides"])
        values = pd.read_csv(folder / _TABLE, dtype=np.float64, engine="python")  # which keeps every digit
        return Timeline(described["name"], slides, values)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DamagedError(str(folder / _TABLE), f"cannot be read ({shorten(str(error))})", AGAIN) from error


@with_style
def timeline_figure(line: Timeline) -> Figure:
    """Draw how far markers moved, how many left the pattern and how sure slip is, over time, with all events."""
    time, sure, *by_marker = line.values.to_numpy().T
    labels = list(map(str, line.values))
    count = 3 if by_marker else 1
    figure, panels = figure_grid(count, 1, (7.2, 1.35), f"Slip in {line.name}", (labels[0], ""), share="x")
    if by_marker:
        # Where the markers rest again, displacements begin anew.
        ends = [slide.end for slide in line.slides if slide.end is not None]
        panels[0].plot(time, np.where(np.isin(time, ends), np.nan, by_marker[0]), color=BLUE, linewidth=1.2)
        for end in ends:
            panels[0].axvline(end, **_NEW_REST)
        panels[1].plot(time, by_marker[1], color=BLACK, linewidth=1.0)
        panels[1].axhline(100 * ResidualSettings().share, color=GREY, linewidth=0.8, linestyle=":")
        panels[1].set_ylim(-4, 104)
    panels[-1].fill_between(time, sure, color=SKY, linewidth=0)
    panels[-1].set_ylim(0, 104)
    for axes, label in zip(panels, (*labels[2:], labels[1]), strict=True):
        axes.set_ylabel(label)
    for axes in panels:
        mark_events(axes, line.slides)
        for slide in line.slides:
            if not slide.is_judged:
                axes.axvspan(slide.start, time[-1] if slide.end is None else slide.end, color=_PRESS, zorder=0)
    keys: dict[str, Artist] = {
        name: Line2D([], [], **look)
        for name, (event, look) in _LINES.items()
        if any(getattr(slide.onsets, event) is not None for slide in line.slides)
    }
    if by_marker and any(slide.end is not None for slide in line.slides):
        keys["new rest: displaced from there on"] = Line2D([], [], **_NEW_REST)
    if any(not slide.is_judged for slide in line.slides):
        keys["not judged"] = Patch(color=_PRESS)
    add_legend(figure, keys)
    return figure


def mark_events(axes: Axes, slides: Sequence[Slide]) -> None:
    """Draw lines where slip begins, and where it is gross."""
    for event, look in _LINES.values():
        for when in (getattr(slide.onsets, event) for slide in slides):
            if when is not None:
                axes.axvline(when, **look, linewidth=1.4)
