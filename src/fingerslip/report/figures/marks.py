"""Vertical lines at slip events and at the start of the slide, their names and keys, and the time that is shown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D

from fingerslip.report.colours import EVENT_COLOURS, EVENT_DASHES, GREY
from fingerslip.slip import Events, SlideWindow, SlipEvents, slide_window
from fingerslip.slip.windows import EVENTS, MAIN_EVENTS

__all__ = [
    "EVENT_COLOURS",
    "event_keys",
    "events_that_happen",
    "limit_to_slides",
    "mark_events",
    "mark_run",
    "mark_slide",
    "name_events",
    "name_run",
    "run_keys",
    "shown_until",
]

_SLIDE = "slide starts"
_LABEL_GAP = 0.4  # inch
_SHOWN_AFTER = 0.35  # of the time from the start of the slide to overall slip


def mark_events(axes: Axes, events: SlipEvents, names: Sequence[str] = MAIN_EVENTS) -> None:
    """Draw a vertical line at every event that happened, on a panel with time in seconds from left to right."""
    for name in names:
        time = events.time(name)
        if time is not None:
            axes.axvline(time, color=EVENT_COLOURS[name], linewidth=1.3, linestyle=(0, EVENT_DASHES[name]), zorder=4)


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
    axes: Axes,
    histories: Mapping[str, xr.Dataset],
    events: Mapping[str, Events],
    before: float = 0.06,
    marked: Iterable[SlipEvents] = (),
) -> None:
    """Show the slides of some runs until a while after overall slip; all panels that share the axis follow.

    Units: before [-].
    """
    windows = [window for history in histories.values() if (window := slide_window(history)) is not None]
    end = shown_until(windows, [events[label].slip if label in events else None for label in histories])
    if end is not None:
        start = min(window.start for window in windows)
        times = [time for axes_of_run in marked for name in MAIN_EVENTS if (time := axes_of_run.time(name)) is not None]
        end = max(end, *(time + before * (time - start) for time in times)) if times else end
        axes.set_xlim(max(0.0, start - before * (end - start)), end)


def name_events(axes: Axes, start: float | None, events: SlipEvents | None, names: Sequence[str] = MAIN_EVENTS) -> None:
    """Write the names of the marked events above a panel, each beside its line and clear of its neighbours.

    Events beyond the limits of the panel have no line in it, and no name.

    Units: start [s].
    """
    times = {} if start is None else {_SLIDE: start}
    if events is not None:
        times |= {name: time for name in names if (time := events.time(name)) is not None}
    left, right = axes.get_xlim()
    figure = axes.get_figure(root=True)
    gap = _LABEL_GAP * _columns(axes) / figure.get_figwidth() if figure else 0.0
    reached = -np.inf
    visible = {name: time for name, time in times.items() if left <= time <= right}
    for name, time in sorted(visible.items(), key=lambda item: item[1]):
        position = max((time - left) / (right - left), reached)
        reached = position + gap
        axes.text(
            position,
            1.02,
            EVENTS.get(name, name),
            transform=axes.transAxes,
            rotation=32,
            rotation_mode="anchor",
            fontsize=0.94 * FontProperties(size=mpl.rcParams["legend.fontsize"]).get_size_in_points(),
            color=EVENT_COLOURS.get(name, GREY),
        )


def name_run(panels: Sequence[Axes], history: xr.Dataset, events: SlipEvents | None) -> None:
    """Write the names of what :func:`mark_run` marked above panels."""
    window = slide_window(history)
    for axes in panels:
        name_events(axes, window.start if window else None, events)


def _columns(axes: Axes) -> int:
    grid = axes.get_subplotspec()
    return 1 if grid is None else grid.get_gridspec().ncols


def shown_until(windows: Sequence[SlideWindow], events: Sequence[SlipEvents | None]) -> float | None:
    """Return the end of the time to show [s]: a while after the last overall slip, or the end of the slides."""
    if not windows:
        return None
    end, start = max(window.end for window in windows), min(window.start for window in windows)
    overall = [times.overall for times in events if times is not None and times.overall is not None]
    if len(overall) < len(events):
        return end
    return min(end, max(overall) + _SHOWN_AFTER * (max(overall) - start))


def events_that_happen(events: Iterable[SlipEvents], names: Sequence[str] = MAIN_EVENTS) -> tuple[str, ...]:
    """Return those of the named events that happened in any of some runs, so that legends have keys for no others."""
    runs = tuple(events)
    return tuple(name for name in names if any(run.time(name) is not None for run in runs))


def run_keys(histories: Mapping[str, xr.Dataset], events: Mapping[str, Events]) -> dict[str, Artist]:
    """Return keys for the lines that :func:`mark_run` draws from accumulated slip; none where nothing slides."""
    if all(slide_window(history) is None for history in histories.values()):
        return {}
    return event_keys(events_that_happen(event.slip for event in events.values()))


def event_keys(names: Sequence[str] = MAIN_EVENTS) -> dict[str, Artist]:
    """Return keys for a legend that names the marked lines."""
    keys: dict[str, Artist] = {_SLIDE: Line2D([], [], color=GREY, linewidth=1.2, linestyle=(0, (1, 1.5)))}
    for name in names:
        keys[EVENTS[name]] = Line2D([], [], color=EVENT_COLOURS[name], linewidth=1.3, linestyle=(0, EVENT_DASHES[name]))
    return keys
