"""The axis of time: what of a run is shown on it, lines at the slide and at slip events, their names and keys."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from fingerslip.history import phase_times
from fingerslip.report.colours import EVENT_COLOURS, EVENT_DASHES, GREY
from fingerslip.slip import Events, SlideWindow, SlipEvents, slide_window
from fingerslip.slip.windows import EVENTS, MAIN_EVENTS

#: Of a run whose events are not known.
NO_EVENTS = Events()
_SLIDE = "slide starts"
_DOTS = (0, (1, 1.5))
_LABEL_GAP = 0.4  # inch
_SHOWN_AFTER = 0.35  # of the time from the start of the slide to overall slip
# Records of steps that follow a hold grow apart by orders of magnitude, even ones by rounding.
_GROWTH = 20.0


@dataclass(frozen=True)
class ShownTime:
    """The time of a history's records as a figure shows it."""

    values: NDArray[np.float64]  # (n_times,), [s]
    logarithmic: bool = False  # whether the axis is
    since_hold: bool = False  # whether the time is counted from the start of a hold

    @property
    def label(self) -> str:
        """Label of the axis."""
        return "time since the hold began [s]" if self.since_hold else "time [s]"

    def fit(self, axes: Axes) -> None:
        """Give a panel its axis of time, from the first record that is shown to the last."""
        if self.logarithmic:
            axes.set_xscale("log")
        axes.set_xlim(np.nanmin(self.values), np.nanmax(self.values))


def shown_time(history: xr.Dataset) -> ShownTime:
    """Return the time that figures of a history show.

    It is logarithmic where the time between records grows twentyfold and more and nothing slides then: from the start
    of the last hold, or of the run where there is none.
    """
    times, holds = history["time"].values, phase_times(history, "hold")
    is_held = bool(holds) and all(end <= holds[-1][0] for _, end in phase_times(history, "slide"))
    since = times - (holds[-1][0] if is_held else 0.0)
    later = since > 1e-9 * times[-1]
    lengths = np.diff(since[later])
    if lengths.size < 2 or lengths.max() < _GROWTH * lengths.min():
        return ShownTime(times)
    return ShownTime(np.where(later, since, np.nan), logarithmic=True, since_hold=is_held)


def shown_times(histories: Iterable[xr.Dataset]) -> tuple[ShownTime, ...]:
    """Return the times of histories that share an axis: logarithmic where those of all are, from holds or from none."""
    histories = tuple(histories)
    time_axes = tuple(map(shown_time, histories))
    if all(time_axis.logarithmic for time_axis in time_axes) and len({axis.since_hold for axis in time_axes}) == 1:
        return time_axes
    return tuple(ShownTime(history["time"].values) for history in histories)


def is_held(history: xr.Dataset) -> bool:
    """Tell whether a counterface presses and nothing slides."""
    return bool(history.sizes.get("counterface", 0)) and not phase_times(history, "slide")


def event_times(events: SlipEvents, names: Iterable[str] = MAIN_EVENTS) -> dict[str, float]:
    """Return the times of the named events that happened [s]."""
    times = {name: events.time(name) for name in names}
    return {name: time for name, time in times.items() if time is not None}


def mark_events(axes: Axes, events: SlipEvents) -> None:
    """Draw a vertical line at every event that happened, on a panel with time in seconds from left to right."""
    for name, time in event_times(events).items():
        axes.axvline(time, color=EVENT_COLOURS[name], linewidth=1.3, linestyle=(0, EVENT_DASHES[name]), zorder=4)


def mark_run(axes: Axes, history: xr.Dataset, events: SlipEvents) -> None:
    """Draw vertical lines at the start of a run's slide, and at its events where they are known."""
    window = slide_window(history)
    if window is not None:
        axes.axvline(window.start, color=GREY, linewidth=1.0, linestyle=_DOTS, zorder=3)
    mark_events(axes, events)


def name_run(panels: Sequence[Axes], history: xr.Dataset, events: SlipEvents) -> None:
    """Write the names of what :func:`mark_run` marked above panels."""
    window = slide_window(history)
    for axes in panels:
        name_events(axes, window.start if window else None, events)


def name_events(axes: Axes, start: float | None, events: SlipEvents) -> None:
    """Write the names of the marked events and of the start of the slide [s] above a panel.

    Each stands beside its line and clear of its neighbours; those beyond the limits of the panel have no name.
    """
    times = ({} if start is None else {_SLIDE: start}) | event_times(events)
    left, right = axes.get_xlim()
    figure, grid = axes.get_figure(root=True), axes.get_subplotspec()
    columns = grid.get_gridspec().ncols if grid else 1
    gap = _LABEL_GAP * columns / figure.get_figwidth() if figure else 0.0
    size = 0.94 * FontProperties(size=mpl.rcParams["legend.fontsize"]).get_size_in_points()
    reached = -np.inf
    for name, time in sorted(times.items(), key=lambda item: item[1]):
        if not left <= time <= right:
            continue
        position = max((time - left) / (right - left), reached)
        reached = position + gap
        look = {"fontsize": size, "color": EVENT_COLOURS.get(name, GREY), "rotation_mode": "anchor", "rotation": 32}
        axes.text(position, 1.02, EVENTS.get(name, name), transform=axes.transAxes, **look)  # type: ignore[arg-type]


def limit_to_slides(
    axes: Axes,
    histories: Mapping[str, xr.Dataset],
    events: Mapping[str, Events],
    before: float = 0.06,
    marked: Iterable[SlipEvents] = (),
) -> None:
    """Show the slides of some runs until a while after overall slip; all panels that share the axis follow."""
    windows = [window for history in histories.values() if (window := slide_window(history)) is not None]
    end = shown_until(windows, [events.get(label, NO_EVENTS).slip for label in histories])
    if end is not None:
        start = min(window.start for window in windows)
        times = [time for events_read in marked for time in event_times(events_read).values()]
        end = max([end, *(time + before * (time - start) for time in times)])
        axes.set_xlim(max(0.0, start - before * (end - start)), end)


def shown_until(windows: Sequence[SlideWindow], events: Sequence[SlipEvents]) -> float | None:
    """Return the end of the time to show [s]: a while after the last overall slip, or the end of the slides."""
    if not windows:
        return None
    end, start = max(window.end for window in windows), min(window.start for window in windows)
    overall = [times.overall for times in events if times.overall is not None]
    if len(overall) < len(events):
        return end
    return min(end, max(overall) + _SHOWN_AFTER * (max(overall) - start))


def run_keys(histories: Mapping[str, xr.Dataset], events: Mapping[str, Events]) -> dict[str, Artist]:
    """Return keys for the lines that :func:`mark_run` draws from accumulated slip; none where nothing slides."""
    if all(slide_window(history) is None for history in histories.values()):
        return {}
    return event_keys(event.slip for event in events.values())


def event_keys(events: Iterable[SlipEvents] | None = None) -> dict[str, Artist]:
    """Return keys of the marked lines for a legend: of events that happened in any of some runs, or of all events."""
    names = MAIN_EVENTS if events is None else {name for events_of_run in events for name in event_times(events_of_run)}
    keys: dict[str, Artist] = {_SLIDE: Line2D([], [], color=GREY, linewidth=1.2, linestyle=_DOTS)}
    for name in (name for name in MAIN_EVENTS if name in names):
        keys[EVENTS[name]] = Line2D([], [], color=EVENT_COLOURS[name], linewidth=1.3, linestyle=(0, EVENT_DASHES[name]))
    return keys
