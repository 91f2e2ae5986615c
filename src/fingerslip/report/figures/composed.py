"""Figures of a run on one axis of time: what the plate does, the contact, what afferents say, the forces."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import ConnectionPatch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from fingerslip.afferents.model import CAVEAT, spike_notes
from fingerslip.afferents.spikes import Spikes, spike_places
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import is_solid
from fingerslip.report import colours as palette
from fingerslip.report.figures import style, time_axis
from fingerslip.report.figures.bodies import add_stress_bar, draw_contact, has_pictures, picture_axis, picture_keys
from fingerslip.report.figures.patches import slide_moments
from fingerslip.report.figures.signals import draw_forces, draw_ratios, draw_states, drawn_keys
from fingerslip.report.labels import of_histories
from fingerslip.slip import Events, slide_tangent
from fingerslip.slip.windows import split_along

_STIMULUS, _PICTURES, _STATES, _RASTER, _SERIES = 0.7, 1.7, 1.0, 0.8, 1.0  # inch
_WIDTH = 6.8  # inch
_PICTURES_SHOWN, _MOST_NAMES = 5, 4
_KEYS_ROOM = 1.75  # of the largest value, so that keys above lines cover none
# Windows in which spikes are counted: their length [s], and at least so many records.
_WINDOW, _RECORDS_A_WINDOW = 0.01, 10.0


@style.with_style
def composed_figure(
    history: xr.Dataset,
    events: Events = time_axis.NO_EVENTS,
    spikes: Spikes | None = None,
    title: str = "",
    times_shown: Sequence[float] = (),
    *,
    assumed: bool = False,
    recorded: Spikes | None = None,
) -> Figure:
    """Draw stimulus, pictures of the contact, stick and slip, rasters and forces, all over the same time."""
    times, is_flat = history["time"].values, not is_solid(history)
    moments = _picture_titles(history, events, times_shown) if has_pictures(history) else {}
    rasters = _rasters(spikes, recorded, history)
    fixed = [_STIMULUS, *[_PICTURES] * bool(moments), *[_STATES] * is_flat]
    heights = [*fixed, *(height for height, _ in rasters), _SERIES, _SERIES]
    heading = style.join_title(f"Stimulus, contact{', afferents' if rasters else ''} and forces", title)
    size, labels = (_WIDTH, float(np.mean(heights))), ("time [s]", "")
    figure, panels = style.figure_grid(
        len(heights), 1, size, heading, labels, share="x", heights=heights, lettered=False, full=True
    )
    stimulus, *others, forces, ratios = panels
    lettered = [stimulus]
    if moments:
        lettered += _draw_pictures(figure, others.pop(0), history, moments, below=others[0] if others else forces)[:1]
    if is_flat:
        draw_states(others[0], history, time_axis.ShownTime(times))
        others[0].set_ylabel("contact\n[mm]")
        # Below: what leads from the pictures to their times is above, and every corner of the panel has contact.
        keys = style.state_keys((OPEN, STICK, SLIP))
        below: dict[str, Any] = {"loc": "upper right", "bbox_to_anchor": (1.0, -0.06), "borderaxespad": 0.0}
        others[0].legend(list(keys.values()), list(keys), ncols=3, **below)
    for axes, (_, draw) in zip(others[is_flat:], rasters, strict=True):
        draw(axes)
    draw_forces(forces, history, times)
    draw_ratios(ratios, history, time_axis.ShownTime(times))
    ratios.set_ylabel("ratio,\nfraction")
    keys_below = {} if is_flat else picture_keys(history)
    for axes in (forces, ratios):
        if style.is_narrow():
            keys_below |= drawn_keys([axes])
        elif axes is ratios or others:
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), borderaxespad=0.0, ncols=2)
        else:  # what leads from the pictures to their times is there
            style.add_keys_inside(axes, ncols=2)
    if rasters:
        ratios.set_xlim(times[0], times[-1])
    else:
        _limit_to_programme(ratios, history, (float(history[picture_axis(history)][number]) for number in moments))
    seen = times <= ratios.get_xlim()[1]
    draw_stimulus(stimulus, history.isel(time=seen), times[seen])
    time_axis.mark_panels([stimulus, *others, forces, ratios], history, events.slip, rasters=others[is_flat:])
    style.letter_panels([*lettered, *others, forces, ratios])
    style.add_legend(figure, (drawn_keys([stimulus]) if style.is_narrow() else {}) | keys_below)
    add_spike_notes(ratios, spikes, history, assumed=assumed, recorded=recorded)
    return figure


def draw_stimulus(axes: Axes, history: xr.Dataset, times: NDArray[np.float64]) -> None:
    """Draw how far the plate goes towards the body and along it."""
    displacement, normal = history["counterface_displacement"].values[:, 0], history["counterface_normal"].values[0]
    towards, along = split_along(displacement, normal)
    axes.plot(times, 1e3 * towards, color=palette.BLACK, label="press")
    axes.plot(times, 1e3 * np.linalg.norm(along, axis=1), color=palette.BLACK, linestyle="--", label="slide")
    axes.set_ylabel(of_histories("plate\n[mm]", [history]))
    axes.yaxis.set_major_locator(MaxNLocator(3))
    if not style.is_narrow():  # else they would cover the lines of events
        axes.set_ylim(top=_KEYS_ROOM * axes.get_ylim()[1])
        style.add_keys_inside(axes, loc="upper left", ncols=2)


def _picture_titles(history: xr.Dataset, events: Events, wanted: Sequence[float]) -> dict[int, str]:
    """Return the titles of pictures: at times that are wanted [s], or mid press and evenly from the slide's start."""
    moments, axis = slide_moments(history, events, _PICTURES_SHOWN - 1 - style.is_narrow()), picture_axis(history)
    times = wanted or time_axis.times_near(history, (0.5 * moments[0], *moments), axis)
    return time_axis.titles_at(history, dict.fromkeys(times, ""), axis)


def _draw_pictures(
    figure: Figure, row: Axes, history: xr.Dataset, moments: Mapping[int, str], below: Axes
) -> list[Axes]:
    """Draw pictures of the contact beside each other in the place of a panel, each led to its time below."""
    cell = row.get_subplotspec()
    assert cell is not None  # panels are made with one
    grid: Any = cell.subgridspec(1, len(moments))
    row.remove()
    pictures: list[Axes] = [figure.add_subplot(entry) for entry in grid]
    # The bar of the scale is beside the last title, or below all where this leaves no room for it.
    is_full = style.is_narrow() or "," in [*moments.values()][-1]
    above = 6.0 + 1.2 * float(mpl.rcParams["legend.fontsize"]) if is_full else None
    for axes, (number, title) in zip(pictures, moments.items(), strict=True):
        draw_contact(axes, history, number, scaled=axes is pictures[-1])
        style.name_panel(axes, title, above)
        moment = float(history[picture_axis(history)][number])
        ends = (0.5, 0.0), (moment, 1.0), axes.transAxes, below.get_xaxis_transform()
        line = ConnectionPatch(*ends, color=palette.GREY, linewidth=0.7, zorder=1)
        line.set_in_layout(False)
        figure.add_artist(line)
    add_stress_bar(figure, pictures, history)
    return pictures


@style.with_style
def spike_figure(
    spikes: Spikes,
    history: xr.Dataset,
    events: Events = time_axis.NO_EVENTS,
    title: str = "",
    *,
    assumed: bool = False,
    recorded: Spikes | None = None,
) -> Figure:
    """Draw when afferents fire, a panel for each type with a row for each afferent, below what the plate does.

    Rows are ordered by place along the slide; `recorded` ones are below, in their own order. Mean rates of the
    simulated ones are counted in windows of at least ten records. `assumed` thresholds of the models are said to be so.
    """
    times, heading = history["time"].values, style.join_title("Spikes of afferents", title)
    drawn = _rasters(spikes, recorded, history)
    heights = [_SERIES, *(height for height, _ in drawn), _SERIES]
    size, labels = (_WIDTH, 1.1 * float(np.mean(heights))), ("time [s]", "")
    figure, panels = style.figure_grid(len(heights), 1, size, heading, labels, share="x", heights=heights, full=True)
    stimulus, *rasters, rate = panels
    draw_stimulus(stimulus, history, times)
    window = max(_WINDOW, _RECORDS_A_WINDOW * float(np.diff(times).max()))
    for axes, (_, draw) in zip(rasters, drawn, strict=True):
        draw(axes)
    rates = spikes.rates(window)
    # A window that reaches beyond the end holds less than the others.
    count = max(1, int((spikes.end - spikes.start) / window + 1e-9))
    edges = spikes.start + window * np.arange(count + 1)
    for kind in dict.fromkeys(spikes.kinds):
        colour = palette.RECEPTOR_COLOURS.get(kind, palette.BLACK)
        rate.stairs(rates.sel(kind=kind)[:count], edges, baseline=None, color=colour, linewidth=1.2, label=kind)
    add_spike_notes(rate, spikes, history, assumed=assumed, recorded=recorded)
    rate.set_ylabel(f"{'simulated' if recorded else 'mean'} rate\nin {1e3 * window:.3g} ms\n[1/s]")
    rate.set_ylim(bottom=0.0)
    stimulus.set_xlim(times[0], times[-1])
    time_axis.mark_panels(panels, history, events.slip, rasters=[*rasters, rate])
    style.add_legend(figure, drawn_keys([stimulus]) if style.is_narrow() else {})
    return figure


def _limit_to_programme(axes: Axes, history: xr.Dataset, shown: Iterable[float]) -> None:
    """Show a run until it is only lifted any more, and all times that are `shown` [s]; say from when it is not."""
    times, kinds = history["time"].values, history["phase_kind"].values
    ends = history["phase_end"].values[kinds != "lift"]
    end = max(ends[-1] if ends.size and kinds[-1] == "lift" else times[-1], *shown, times[0])
    axes.set_xlim(times[0], end)
    if end < times[-1]:
        style.note_below(axes, f"Lift from {end:g} s not shown.")


def _rasters(
    spikes: Spikes | None, recorded: Spikes | None, history: xr.Dataset
) -> list[tuple[float, Callable[[Axes], None]]]:
    """Return the height of each raster [inch], and what draws it: of each type the simulated one, then the recorded."""
    both = ((spikes, functools.partial(draw_raster, history=history)), (recorded, draw_recording))
    some = [(trains, _raster_heights(trains), draw) for trains, draw in both if trains]
    return [
        (heights[kind], functools.partial(draw, spikes=trains, kind=kind))
        for kind in dict.fromkeys(kind for trains, *_ in some for kind in trains.kinds)
        for trains, heights, draw in some
        if kind in heights
    ]


def _raster_heights(spikes: Spikes) -> dict[str, float]:
    """Return the height of the raster of each type [inch]: by its rows, low where it does not fire."""
    rows = {kind: spikes.kinds.count(kind) for kind in spikes.kinds}
    firing = {kind for kind, times in zip(spikes.kinds, spikes.times, strict=True) if times.size}
    most = max(rows.values(), default=1)
    return {kind: _RASTER * (max(0.6, count / most) if kind in firing else 0.6) for kind, count in rows.items()}


def add_spike_notes(
    axes: Axes, spikes: Spikes | None, history: xr.Dataset, *, assumed: bool, recorded: Spikes | None = None
) -> None:
    """Write below the axis of time what spikes are not, and whose slip crosses a recording."""
    notes = [*spike_notes(spikes.kinds, spikes.beyond, history), *[CAVEAT] * assumed] if spikes and spikes.kinds else []
    notes += ["lines of slip are of the simulation, also across recordings"] * (recorded is not None)
    if notes:
        style.note_below(axes, "Spikes: " + "; ".join(notes) + ".")


def draw_raster(axes: Axes, spikes: Spikes, history: xr.Dataset, kind: str) -> None:
    """Draw the spikes of one type, a row for each afferent, ordered by place along the slide, which the ticks say."""
    along = 1e3 * spike_places(spikes, history) @ slide_tangent(history)
    rows = [row for row in along.argsort(kind="stable") if spikes.kinds[row] == kind]
    order = "by place" if is_solid(history) else "by x"
    _draw_trains(axes, [spikes.times[row] for row in rows], kind, f"{len(rows)} {kind}\n{order}")
    ends = (0, len(rows) - 1) if len(rows) > 1 else (0,)
    axes.set_yticks(ends, [f"{along[rows[end]]:.1f} mm".replace("-", "\N{MINUS SIGN}") for end in ends])


def draw_recording(axes: Axes, spikes: Spikes, kind: str) -> None:
    """Draw recorded spikes of one type, a named row for each afferent, the first on top."""
    rows = [row for row, other in enumerate(spikes.kinds) if other == kind][::-1]
    # Rows may be trials of the same unit, so their number is none of afferents.
    words = f"{kind}\nrecorded\n{len(rows)} row{'s' * (len(rows) > 1)}"
    _draw_trains(axes, [spikes.times[row] for row in rows], kind, words)
    ticks = range(len(rows)) if len(rows) <= _MOST_NAMES else (0, len(rows) - 1)
    axes.set_yticks(ticks, [spikes.names[rows[tick]] for tick in ticks])


def _draw_trains(axes: Axes, trains: Sequence[NDArray[np.float64]], kind: str, label: str) -> None:
    """Draw spike trains [s] of one type, a row for each from below."""
    colour = palette.RECEPTOR_COLOURS.get(kind, palette.BLACK)
    axes.eventplot(trains, colors=colour, lineoffsets=range(len(trains)), linewidths=0.6, linelengths=0.8)
    if not any(train.size for train in trains):
        axes.text(0.5, 0.5, "no spikes", transform=axes.transAxes, ha="center", va="center", color=colour)
    axes.set_ylabel(label, color=colour)
    axes.set_ylim(-0.8, len(trains) - 0.2)
    axes.grid(visible=False)
