"""The contact of a body in 3D seen from below: stick and slip, strains of the skin, where slip begins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.tri import Triangulation

from fingerslip import slip
from fingerslip.arrays import Floats
from fingerslip.contact.counterfaces import sliding_direction
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import nearest_record
from fingerslip.report import colours as palette
from fingerslip.report.figures import style, time_axis
from fingerslip.report.scene.scene import contact_levels
from fingerslip.slip.patch import Patch as ContactPatch
from fingerslip.slip.patch import triangle_states
from fingerslip.slip.windows import EVENTS, counterface_normal

_APART = (0.92, 0.93, 0.94, 1.0)
_LABELS = ("along the slide [mm]", "across the slide [mm]")
_FRAMES = 9
_STRAIN_FRAMES = 4
_AROUND = 0.8  # mm
#: What has slipped as the events count it, of which their lines are levels.
HAS_SLIPPED = f"has slipped by more than {1e6 * slip.EventSettings().slip_tolerance:g} \N{MICRO SIGN}m"


@style.with_style
def slip_frames_figure(
    history: xr.Dataset,
    events: slip.Events = time_axis.NO_EVENTS,
    times: Sequence[float] | None = None,
    title: str = "",
) -> Figure:
    """Draw where the contact sticks and slips at times [s], and say how much of it has slipped, as events count it."""
    patch, share = slip.contact_patch(history), slipped_share(history)
    moments = _moments_with_events(history, events) if times is None else times
    frames = time_axis.titles_at(history, dict.fromkeys(map(float, moments), ""), "time")
    heading = style.join_title("Stick and slip of the contact, seen from below", title)
    figure, panels = style.figure_grid(len(frames), 3, _panel_size(history, patch, 2.6), heading, _LABELS)
    events_read, before = time_axis.event_times(events.slip), np.inf
    for axes, (step, words) in zip(panels, frames.items(), strict=True):
        fill_states(axes, patch, history, step)
        now = float(history["time"][step])
        passed = ", ".join(EVENTS[name] for name, time in events_read.items() if before < time <= now)
        slipped = "" if np.isnan(share[step]) else f": {100.0 * share[step]:.0f} % has slipped"
        style.name_panel(axes, f"{words}{slipped}{f', after {passed}' if passed else ''}")
        before = now
    keys = style.state_keys((STICK, SLIP, OPEN))
    style.add_legend(figure, keys | {f"%: {HAS_SLIPPED}": Line2D([], [], linestyle="none")})
    return figure


@style.with_style
def surface_strain_figure(history: xr.Dataset, events: slip.Events = time_axis.NO_EVENTS, title: str = "") -> Figure:
    """Draw the Green-Lagrange strain of the skin along the slide and its rate over the contact at four times of it."""
    patch, name = slip.contact_patch(history), "strain along the slide"
    strains = slip.surface_strains(history, patch).sel(strain_component="along")
    moments = slide_moments(history, events, _STRAIN_FRAMES)
    steps = [nearest_record(history, moment) for moment in moments]
    heading = style.join_title(f"Green-Lagrange {name}, and its rate, seen from below", title)
    size = _panel_size(history, patch, 2.5)
    figure, panels = style.figure_grid(2 * len(moments), len(moments), size, heading, _LABELS)
    fields = ((strains, f"{name} [%]"), (slip.surface_strain_rates(strains), "its rate [%/s]"))
    for row, (field, label) in enumerate(fields):
        row_panels = panels[row * len(moments) : (row + 1) * len(moments)]
        shares, touching = 100.0 * field.values, field["touching"].values
        # One scale about zero for the triangles in contact at all of these times.
        sizes = np.concatenate([np.abs(shares[step][touching[step]]) for step in steps] + [np.zeros(1)])
        top = float(np.quantile(sizes, 0.98)) or 1.0
        colours = ScalarMappable(Normalize(-top, top), "RdBu_r")
        for axes, moment, step in zip(row_panels, moments, steps, strict=True):
            paint = colours.to_rgba(shares[step])
            paint[~touching[step]] = _APART
            _fill_triangles(axes, patch.points[patch.triangles], paint, _touched_frame(history, patch, patch.points))
            axes.set_title(f"{moment:.3f} s")
        figure.colorbar(colours, ax=list(row_panels), label=label, shrink=0.9, extend="both")
    style.add_legend(figure, {"not in contact": Patch(facecolor=_APART)})
    return figure


def fill_states(axes: Axes, patch: ContactPatch, history: xr.Dataset, step: int) -> None:
    """Fill what sticks, slips and is open; the edges are where the tractions reach their limit and pressure ends."""
    touch, stick = contact_levels(history, patch, step)
    mesh = Triangulation(1e3 * patch.points[:, 0], 1e3 * patch.points[:, 1], patch.triangles)
    for state, level in ((STICK, np.full_like(stick, -1.0)), (SLIP, stick), (OPEN, touch)):
        if level.min() < 0.0:
            levels, colour = [2.0 * float(level.min()), 0.0], palette.STATE_COLOURS[state]
            axes.tricontourf(mesh, level, levels=levels, colors=[colour])
    _set_frame(axes, _touched_frame(history, patch, patch.points))


def slipped_share(history: xr.Dataset) -> Floats:
    """Return the share of the contact (n_times,) that has slipped, of which events are levels; NaN before the slide."""
    share, window = np.full(history.sizes["time"], np.nan), slip.slide_window(history)
    if window is not None:
        share[window.records] = slip.slipped_fraction(history, window, slip.EventSettings().slip_tolerance).values
    return share


def _fill_triangles(axes: Axes, corners: Floats, colours: Floats, frame: tuple[Floats, Floats]) -> None:
    """Fill triangles (n, 3, 2) [m] without borders between them, in a frame of two corners (2,) [mm]."""
    axes.add_collection(PolyCollection(list(1e3 * corners), facecolors=colours, edgecolors="face", linewidths=0.2))
    _set_frame(axes, frame)


def _set_frame(axes: Axes, frame: tuple[Floats, Floats]) -> None:
    axes.grid(visible=False)
    axes.set(xlim=(frame[0][0], frame[1][0]), ylim=(frame[0][1], frame[1][1]), aspect="equal")


def _touched_frame(history: xr.Dataset, patch: ContactPatch, points: Floats) -> tuple[Floats, Floats]:
    """Return two corners (2,) [mm] around all triangles of points (n, 2) [m] that ever touch, or all if none does."""
    ever = (history["contact_state"].values[:, patch.nodes] != OPEN).any(axis=0)[patch.triangles].any(axis=1)
    framed = 1e3 * points[patch.triangles[ever] if ever.any() else patch.triangles].reshape(-1, 2)
    return framed.min(axis=0) - _AROUND, framed.max(axis=0) + _AROUND


def _panel_size(history: xr.Dataset, patch: ContactPatch, width: float) -> tuple[float, float]:
    """Return the size of a panel [inch] that the patch fills, with room for title and labels."""
    low, high = _touched_frame(history, patch, patch.points)
    return width, min(max((width - 0.4) * (high[1] - low[1]) / (high[0] - low[0]), 1.0), 3.0) + 0.5


def slide_moments(history: xr.Dataset, events: slip.Events, count: int) -> Floats:
    """Return times of records from the start of the slide to shortly after overall slip, or all of a run without it."""
    times = history["time"].values
    window = slip.slide_window(history)
    start, end = (window.start, window.end) if window else (float(times[0]), float(times[-1]))
    if events.overall is not None:
        end = min(end, events.overall + 0.1 * (events.overall - start))
    moments: Floats = times[[nearest_record(history, moment) for moment in np.linspace(start, end, count)]]
    return moments


def _moments_with_events(history: xr.Dataset, events: slip.Events) -> Floats:
    """Return evenly spaced times, the nearest ones moved to the first records after the events."""
    moments, times = slide_moments(history, events, _FRAMES), history["time"].values
    free = np.arange(1, moments.size)
    within = [time for time in time_axis.event_times(events.slip).values() if moments[0] < time <= moments[-1]]
    for record in np.unique(times[np.searchsorted(times, within)]):
        chosen = free[np.abs(moments[free] - record).argmin()]
        moments[chosen] = record
        free = free[free != chosen]
    return np.sort(moments)


_COLUMNS, _WIDTH = 4, 2.0
_STUCK = (0.12, 0.16, 0.2, 1.0)
_ARROW = 0.3


@style.with_style
def slip_onset_figure(histories: Mapping[str, xr.Dataset]) -> Figure:
    """Draw when each part of the contact slips for good, a panel for each run, all in the same axes of the plate."""
    patches = {title: slip.contact_patch(history) for title, history in histories.items()}
    onsets = {title: _onsets(history, patches[title]) for title, history in histories.items()}
    latest = max((float(np.nanmax(times, initial=0.0)) for times in onsets.values()), default=0.0)
    colours = ScalarMappable(Normalize(0.0, latest or 1.0), "viridis_r")
    # Two axes of the plate that do not depend on the slide.
    normal = counterface_normal(next(iter(histories.values())))
    plate = np.array([first := sliding_direction(normal), np.cross(first, normal)])
    points = {
        title: history["contact_position"].values[patches[title].nodes] @ plate.T
        for title, history in histories.items()
    }
    frames = [_touched_frame(history, patches[title], points[title]) for title, history in histories.items()]
    low, high = np.min([first for first, _ in frames], axis=0), np.max([last for _, last in frames], axis=0)
    size = _WIDTH, min(_WIDTH * (high[1] - low[1]) / (high[0] - low[0]), 3.0) + 0.4
    along, across = (f"{'xyz'[int(np.abs(axis).argmax())]} [mm]" for axis in plate)
    heading, alone = "When each part of the contact slips for good, seen from below", len(histories) == 1
    heading = style.join_title(heading, next(iter(histories)) if alone else "")
    figure, panels = style.figure_grid(len(histories), min(_COLUMNS, len(histories)), size, heading, (along, across))
    for axes, (title, times) in zip(panels, onsets.items(), strict=True):
        paint, touched = colours.to_rgba(times), ~(times < 0.0)
        paint[np.isnan(times)] = _STUCK
        _fill_triangles(axes, points[title][patches[title].triangles][touched], paint[touched], (low, high))
        # The direction of the plate over the middle of the panel.
        half = 0.5 * _ARROW * float(np.min(high - low)) * (patches[title].axes[0] @ plate.T)
        start, end = (tuple(0.5 * (low + high) + sign * half) for sign in (-1.0, 1.0))
        look = {"arrowstyle": "-|>", "color": palette.BLACK, "linewidth": 1.6}
        axes.annotate("", xy=end, xytext=start, arrowprops=look, zorder=5)
        axes.set_title("" if alone else title)
    figure.colorbar(colours, ax=list(panels), label="time into the slide [s]", shrink=0.8)
    return figure


def _onsets(history: xr.Dataset, patch: ContactPatch) -> Floats:
    """Return the time from the start of the slide at which each triangle has stuck for the last time [s].

    NaN where it sticks to the end, minus one where it never touches during the slide.
    """
    window = slip.slide_window(history)
    times = history["time"].values
    records = np.arange(times.size)[window.records] if window else np.arange(times.size)
    states = np.stack([triangle_states(history, patch, int(record)) for record in records])
    sticks = states == STICK
    last = sticks.shape[0] - 1 - sticks[::-1].argmax(axis=0)
    following = np.minimum(last + 1, records.size - 1)
    onset = np.where(sticks.any(axis=0), times[records[following]] - times[records[0]], 0.0)
    onset[sticks[-1]] = np.nan
    onset[(states == OPEN).all(axis=0)] = -1.0
    return np.asarray(onset, dtype=float)


@style.with_style
def stick_ratio_figure(histories: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Draw the stick ratio against the tangential force over the normal force."""
    heading = style.join_title("Stick ratio against tangential force", title)
    labels = ("tangential force / normal force", "sticking share of the contact area")
    figure, (axes,) = style.figure_grid(1, 1, (5.2, 3.4), heading, labels)
    for name, history in histories.items():
        window, series = slip.slide_window(history), slip.patch_series(history)
        chosen = series.isel(time=window.records) if window else series
        axes.plot(chosen["force_ratio"], chosen["stick_ratio"], label=name, linewidth=1.4)
    axes.set_ylim(-0.03, 1.03)
    if len(histories) > 1:
        axes.legend(fontsize=8)
    return figure
