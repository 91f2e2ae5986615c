"""The axis of time of figures, and what is marked on it: events, the start of a slide."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from fingerslip.history import phase_times
from fingerslip.report import colours as palette
from fingerslip.report.figures.style import panel_width
from fingerslip.slip import Events, SlideWindow, SlipEvents, slide_window
from fingerslip.slip.windows import EVENTS

#: Of a run whose events are not known.
NO_EVENTS = Events()
_SLIDE = "slide starts"
_LABEL_GAP, _NAME_ABOVE = 0.05, 4.0  # between names of events [inch a point of them], from their panel up [points]
_SHOWN_AFTER = 0.35  # of the time from the start of the slide to overall slip
# Records of steps that follow a hold grow apart by orders of magnitude, even ones by rounding.
_GROWTH = 20.0


@dataclass(frozen=True)
class ShownTime:
    """The time of a history's records as a figure shows it."""

    values: NDArray[np.float64]  # (n_times,), [s]
    logarithmic: bool = False  # whether the axis is
    label: str = "time [s]"  # of the axis

    def fit(self, axes: Axes) -> None:
        """Give a panel its axis of time, from the first record that is shown to the last."""
        if self.logarithmic:
            axes.set_xscale("log")
        axes.set_xlim(np.nanmin(self.values), np.nanmax(self.values))


def shown_time(history: xr.Dataset) -> ShownTime:
    """Return the time that figures of a history show.

    Where records grow twentyfold apart and nothing slides it is logarithmic, from the last hold or the start.
    """
    times, holds = history["time"].values, phase_times(history, "hold")
    is_held = bool(holds) and all(end <= holds[-1][0] for _, end in phase_times(history, "slide"))
    since = times - (holds[-1][0] if is_held else 0.0)
    later = since > 1e-9 * times[-1]
    lengths = np.diff(since[later])
    if lengths.size < 2 or lengths.max() < _GROWTH * lengths.min():
        return ShownTime(times)
    return ShownTime(np.where(later, since, np.nan), True, "time since the hold began [s]" if is_held else "time [s]")


def shown_times(histories: Collection[xr.Dataset]) -> tuple[ShownTime, ...]:
    """Return the times of histories that share an axis: logarithmic where those of all are, from holds or from none."""
    times = tuple(map(shown_time, histories))
    if all(time.logarithmic for time in times) and len({time.label for time in times}) == 1:
        return times
    return tuple(ShownTime(history["time"].values) for history in histories)


def event_times(events: SlipEvents, names: Iterable[str] = tuple(EVENTS)) -> dict[str, float]:
    """Return the times of the named events that happened [s]."""
    return {name: time for name in names if (time := events.time(name)) is not None}


def times_near(history: xr.Dataset, moments: Iterable[float], axis: str) -> list[float]:
    """Return the times [s] of records or snapshots nearest to times [s], each once."""
    times = history[axis].values
    return list(dict.fromkeys(float(times[np.abs(times - moment).argmin()]) for moment in moments))


def titles_at(history: xr.Dataset, moments: Mapping[float, str], axis: str) -> dict[int, str]:
    """Return the records or snapshots nearest to times [s], each once: their own times, how far from what happens."""
    times, titles = history[axis].values, dict[int, str]()
    for moment, words in moments.items():
        number = int(np.abs(times - moment).argmin())
        time, apart = times[number], round(1e3 * float(times[number] - moment))
        away = f"{abs(apart)} ms {'before' if apart < 0 else 'after'} {words or f'{moment:.3f} s'}" if apart else words
        titles[number] = ", ".join(filter(None, (titles.get(number, f"{time:.3f} s"), away)))
    return titles


def mark_panels(
    panels: Sequence[Axes], history: xr.Dataset | None, events: SlipEvents, named: int = 1, rasters: Sequence[Axes] = ()
) -> None:
    """Draw lines at events and the start of a slide in panels over time, pale and behind spikes; name them above."""
    window = None if history is None else slide_window(history)
    times = ({_SLIDE: window.start} if window else {}) | event_times(events)
    for axes, (name, time) in itertools.product(panels, times.items()):
        behind = {"linewidth": 0.7, "alpha": 0.4, "zorder": 1}
        look = behind if axes in rasters else {"zorder": 4 if name in EVENTS else 3}
        axes.axvline(time, **(_line_look(name) | look))
    for axes in panels[:named]:
        _name_times(axes, times)


def _line_look(name: str) -> dict[str, Any]:
    """Return how the line of an event looks, or that of the start of the slide."""
    width = float(mpl.rcParams["lines.linewidth"])
    if name == _SLIDE:
        return {"color": palette.GREY, "linewidth": 0.7 * width, "linestyle": (0, (1, 1.5))}
    dashes = palette.EVENT_DASHES[name]
    return {"color": palette.EVENT_COLOURS[name], "linewidth": 0.93 * width, "linestyle": (0, dashes)}


def _name_times(axes: Axes, times: Mapping[str, float]) -> None:
    """Write the names of times [s] above a panel: each beside its line, or led to it from beyond its neighbour."""
    (left, right), (width, columns) = axes.get_xlim(), panel_width(axes)
    size = 0.94 * FontProperties(size=mpl.rcParams["legend.fontsize"]).get_size_in_points()
    reached = -np.inf
    for name, time in sorted(times.items(), key=lambda item: item[1]):
        if not left <= time <= right:
            continue
        fraction = (time - left) / (right - left)
        position = max(fraction, reached)
        reached = position + _LABEL_GAP * size * columns / width
        colour = palette.EVENT_COLOURS.get(name, palette.GREY)
        look: dict[str, Any] = {"fontsize": size, "color": colour, "rotation_mode": "anchor", "rotation": 32}
        look |= {"xycoords": "axes fraction", "textcoords": ("axes fraction", "offset points")}
        if position > fraction:
            leader = {"arrowstyle": "-", "relpos": (0.0, 0.0), "shrinkA": 0.0, "shrinkB": 0.0, "patchA": None}
            look["arrowprops"] = {**leader, "color": colour, "linewidth": 0.7}
        axes.annotate(EVENTS.get(name, name), (fraction, 1.0), (position, _NAME_ABOVE), **look)


def limit_to_slides(
    axes: Axes,
    histories: Mapping[str, xr.Dataset],
    events: Mapping[str, Events],
    before: float = 0.06,
    marked: Iterable[SlipEvents] = (),
) -> None:
    """Show the slides of some runs until a while after overall slip; all panels that share the axis follow."""
    windows = [window for history in histories.values() if (window := slide_window(history)) is not None]
    if windows:
        start, end = shown_span(windows, [events.get(label, NO_EVENTS).slip for label in histories])
        times = [time for events_read in marked for time in event_times(events_read).values()]
        end = max([end, *(time + before * (time - start) for time in times)])
        axes.set_xlim(max(0.0, start - before * (end - start)), end)


def shown_span(windows: Sequence[SlideWindow], events: Sequence[SlipEvents]) -> tuple[float, float]:
    """Return the time to show [s]: from the first slide to a while after the last overall slip, or its end."""
    start, end = min(window.start for window in windows), max(window.end for window in windows)
    overall = [times.overall for times in events if times.overall is not None]
    if len(overall) < len(events):
        return start, end
    return start, min(end, max(overall) + _SHOWN_AFTER * (max(overall) - start))


def event_keys(events: Iterable[SlipEvents]) -> dict[str, Artist]:
    """Return keys of the marked lines for a legend: of the start of the slide, and of events that any run has."""
    happened = {name for each in events for name in event_times(each)}
    keys: dict[str, Artist] = {_SLIDE: Line2D([], [], **_line_look(_SLIDE))}
    return keys | {EVENTS[name]: Line2D([], [], **_line_look(name)) for name in EVENTS if name in happened}
