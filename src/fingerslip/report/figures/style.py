"""One look for all figures: sizes, colours that colour-blind people can tell apart, marked events."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.slip import Events, SlideWindow, SlipEvents, slide_window

__all__ = [
    "AREA_COLOURS",
    "BLACK",
    "BLUE",
    "EVENT_COLOURS",
    "EVENT_NAMES",
    "GREEN",
    "GREY",
    "MARKED_EVENTS",
    "ORANGE",
    "PURPLE",
    "RECEPTOR_COLOURS",
    "REGION_COLOURS",
    "SKY",
    "VERMILLION",
    "YELLOW",
    "add_legend",
    "columns_for",
    "event_keys",
    "figure_grid",
    "limit_to_slides",
    "mark_events",
    "mark_run",
    "mark_slide",
    "name_events",
    "region_colours",
    "shown_until",
    "styled",
    "titled",
]

# The palette of Okabe and Ito, which people with any kind of colour vision can tell apart.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GREY = "#8a8a8a"

AREA_COLOURS: Mapping[str, str] = MappingProxyType({"A": BLUE, "B": VERMILLION})
EVENT_NAMES: Mapping[str, str] = MappingProxyType(
    {"incipient": "incipient", "noticed": "48 %", "three_quarter": "three-quarter", "overall": "overall"}
)
EVENT_COLOURS: Mapping[str, str] = MappingProxyType(
    {"incipient": GREEN, "noticed": SKY, "three_quarter": PURPLE, "overall": VERMILLION}
)

RECEPTOR_COLOURS: Mapping[str, str] = MappingProxyType(
    {"FA-I": BLUE, "SA-I": VERMILLION, "FA-II": GREEN, "SA-II": PURPLE}
)
REGION_COLOURS: Mapping[str, str] = MappingProxyType(
    {"epidermis": "#e3a57c", "dermis": "#f2cfae", "skin": "#ecc09b", "tissue": "#faeedd", "phalanx": "#c9ced3"}
)
_OTHER_COLOURS = ("#d9e6f2", "#dcefe2", "#efe2f0", "#f4f0d8")

MARKED_EVENTS = ("incipient", "three_quarter", "overall")

_SLIDE = "slide starts"
_LABEL_GAP = 0.4  # inch
_SHOWN_AFTER = 0.35  # of the time from the start of the slide to overall slip
_LEAST_WIDTH = 6.6  # inch
_KEY_WIDTH, _LETTER_WIDTH = 0.5, 0.07  # inch

_STYLE: Any = MappingProxyType(
    {
        "font.family": "DejaVu Sans",
        "font.size": 9.0,
        "axes.titlesize": 9.5,
        "axes.labelsize": 9.0,
        "axes.titlelocation": "left",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.linewidth": 0.7,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": "#e3e3e3",
        "grid.linewidth": 0.6,
        "xtick.labelsize": 8.5,
        "ytick.labelsize": 8.5,
        "xtick.major.width": 0.7,
        "ytick.major.width": 0.7,
        "legend.fontsize": 8.5,
        "legend.frameon": False,
        "legend.handlelength": 1.8,
        "lines.linewidth": 1.4,
        "figure.titlesize": 11.0,
        "svg.fonttype": "none",
    }
)

P = ParamSpec("P")
R = TypeVar("R")


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Run a drawing function under the style of this package, whatever the user's own settings are."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **values: P.kwargs) -> R:
        with mpl.rc_context():
            mpl.rcdefaults()
            mpl.rcParams.update(_STYLE)
            return draw(*args, **values)

    return drawn


def region_colours(names: Sequence[str]) -> dict[str, str]:
    """Return a colour for every region, those of a fingertip first and from outside inwards."""
    ordered = sorted(names, key=lambda name: list(REGION_COLOURS).index(name) if name in REGION_COLOURS else 99)
    others = [name for name in ordered if name not in REGION_COLOURS]
    extra = {name: _OTHER_COLOURS[place % len(_OTHER_COLOURS)] for place, name in enumerate(others)}
    return {name: REGION_COLOURS.get(name) or extra[name] for name in ordered}


def figure_grid(
    count: int,
    columns: int,
    panel: tuple[float, float],
    title: str,
    labels: tuple[str, str],
    *,
    share: str = "all",
    widths: Sequence[float] | None = None,
) -> tuple[Figure, list[Axes]]:
    """Make a figure of `count` panels.

    Parameters
    ----------
    count : int
        How many panels.
    columns : int
        Largest number of panels beside each other.
    panel : tuple of float
        Width and height of a panel [inch].
    title : str
        Title of the figure.
    labels : tuple of str
        Labels with units of the horizontal axes (written below the lowest panels) and of the vertical ones
        (written once, on the left).
    share : {'all', 'x', 'none'}
        Which axes the panels share.
    widths : sequence of float, optional
        Relative widths of the columns.

    Returns
    -------
    Figure, list of Axes
        The figure, and its panels row by row.
    """
    wide = max(min(columns, count), 1)
    rows = max(math.ceil(count / wide), 1)
    size = (max(wide * panel[0] + 0.6, _LEAST_WIDTH), rows * panel[1] + 0.8)
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    shared_x, shared_y = {"all": (True, True), "x": (True, False), "none": (False, False)}[share]
    grid = figure.subplots(rows, wide, sharex=shared_x, sharey=shared_y, squeeze=False, width_ratios=widths)
    panels: list[Axes] = list(np.asarray(grid).flat)
    for unused in panels[count:]:
        unused.set_visible(False)
    for lowest in panels[max(count - wide, 0) : count]:
        lowest.tick_params(labelbottom=True)
        lowest.set_xlabel(labels[0])
    figure.supylabel(labels[1], fontsize=9.0)
    figure.suptitle(title, x=0.01, ha="left")
    return figure, panels[:count]


def columns_for(count: int) -> int:
    """Return how many panels of `count` go beside each other: at most three, and four as two by two."""
    return 2 if count == 4 else max(min(count, 3), 1)


def mark_events(axes: Axes, events: SlipEvents, names: Sequence[str] = MARKED_EVENTS) -> None:
    """Draw a vertical line at every event that happened, on a panel with time in seconds from left to right.

    Parameters
    ----------
    axes : Axes
        The panel.
    events : SlipEvents
        The events.
    names : sequence of str, optional
        Which of them.
    """
    for name in names:
        time = getattr(events, name)
        if time is not None:
            axes.axvline(time, color=EVENT_COLOURS[name], linewidth=1.2, linestyle=(0, (4, 2)), zorder=4)


def mark_slide(axes: Axes, start: float) -> None:
    """Draw a vertical line at the start of the slide [s], on a panel with time from left to right."""
    axes.axvline(start, color=GREY, linewidth=1.0, linestyle=(0, (1, 1.5)), zorder=3)


def mark_run(axes: Axes, history: xr.Dataset, events: SlipEvents | None) -> None:
    """Draw vertical lines at the start of a run's slide, and at its events where they are known."""
    window = slide_window(history)
    if window is not None:
        mark_slide(axes, window.start)
    if events is not None:
        mark_events(axes, events)


def limit_to_slides(
    axes: Axes, histories: Mapping[str, xr.Dataset], events: Mapping[str, Events], before: float = 0.06
) -> None:
    """Show the slides of some runs until a while after overall slip; all panels that share the axis follow.

    Parameters
    ----------
    axes : Axes
        A panel with time in seconds from left to right.
    histories : mapping of str to xarray.Dataset
        Histories by the runs' labels.
    events : mapping of str to Events
        Their events, as far as they are known.
    before : float, optional
        Time shown before the slides, as a share of what follows [-].
    """
    windows = [window for history in histories.values() if (window := slide_window(history)) is not None]
    end = shown_until(windows, [events[label].slip if label in events else None for label in histories])
    if end is not None:
        start = min(window.start for window in windows)
        axes.set_xlim(max(0.0, start - before * (end - start)), end)


def name_events(
    axes: Axes, start: float | None, events: SlipEvents | None, names: Sequence[str] = MARKED_EVENTS
) -> None:
    """Write the names of the marked events above a panel, each beside its line and apart from its neighbours.

    Parameters
    ----------
    axes : Axes
        A panel whose limits are set, with time in seconds from left to right.
    start : float or None
        Start of the slide [s].
    events : SlipEvents or None
        The events.
    names : sequence of str, optional
        Which of them.
    """
    times = {} if start is None else {_SLIDE: start}
    times |= {name: time for name in names if (time := getattr(events, name, None)) is not None}
    left, right = axes.get_xlim()
    figure = axes.get_figure(root=True)
    gap = _LABEL_GAP * _columns(axes) / figure.get_figwidth() if figure else 0.0
    reached = -np.inf
    for name, time in sorted(times.items(), key=lambda item: item[1]):
        place = max((time - left) / (right - left), reached)
        reached = place + gap
        axes.text(
            place,
            1.02,
            EVENT_NAMES.get(name, name),
            transform=axes.transAxes,
            rotation=32,
            rotation_mode="anchor",
            fontsize=8.0,
            color=EVENT_COLOURS.get(name, GREY),
        )


def _columns(axes: Axes) -> int:
    grid = axes.get_subplotspec()
    return 1 if grid is None else grid.get_gridspec().ncols


def shown_until(windows: Sequence[SlideWindow], events: Sequence[SlipEvents | None]) -> float | None:
    """Return the end of the time to show [s]: a while after the last overall slip, or the end of the slides.

    Parameters
    ----------
    windows : sequence of SlideWindow
        The slides of the runs that share an axis.
    events : sequence of SlipEvents or None
        Their events; where overall slip is not known the whole slide is shown.
    """
    if not windows:
        return None
    end, start = max(window.end for window in windows), min(window.start for window in windows)
    overall = [times.overall for times in events if times is not None and times.overall is not None]
    if len(overall) < len(events):
        return end
    return min(end, max(overall) + _SHOWN_AFTER * (max(overall) - start))


def event_keys(names: Sequence[str] = MARKED_EVENTS) -> dict[str, Artist]:
    """Return keys for a legend that names the marked lines."""
    keys: dict[str, Artist] = {_SLIDE: Line2D([], [], color=GREY, linewidth=1.2, linestyle=(0, (1, 1.5)))}
    for name in names:
        keys[EVENT_NAMES[name]] = Line2D([], [], color=EVENT_COLOURS[name], linewidth=1.2, linestyle=(0, (4, 2)))
    return keys


def add_legend(figure: Figure, keys: Mapping[str, Artist]) -> None:
    """Put a legend below all panels, in as many columns as the width of the figure holds."""
    width = sum(_KEY_WIDTH + _LETTER_WIDTH * len(name) for name in keys)
    rows = math.ceil(width / figure.get_figwidth())
    columns = math.ceil(len(keys) / rows)
    figure.legend(list(keys.values()), list(keys), loc="outside lower left", ncols=columns, columnspacing=1.4)


def titled(title: str, more: str) -> str:
    """Join a title with what tells this figure from its like."""
    return f"{title}: {more}" if more else title
