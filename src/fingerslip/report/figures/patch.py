"""Figures of the contact patch in space: slip maps from below, strains, stick ratio, reference nodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch as Swatch
from numpy.typing import NDArray

from fingerslip.history import OPEN, SLIP, STICK
from fingerslip.report.figures.style import (
    BLACK,
    GREY,
    add_legend,
    event_keys,
    figure_grid,
    mark_events,
    mark_slide,
    styled,
    titled,
)
from fingerslip.slip import (
    Events,
    Patch,
    contact_patch,
    patch_series,
    slide_window,
    surface_strain_rates,
    surface_strains,
)
from fingerslip.slip.patch import triangle_states
from fingerslip.slip.receptors import plate_tangent

__all__ = ["reference_nodes_figure", "slip_frames_figure", "stick_ratio_figure", "surface_strain_figure"]

Floats = NDArray[np.float64]

_STATES = {OPEN: "#e9edf0", STICK: "#1f5a8c", SLIP: "#f0a202"}
_STRAIN_NAMES = {"along": "strain along the slide", "across": "strain across the slide", "shear": "shear strain"}
_LINE_STYLES = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)))
_JERK = 0.05  # s
_STATE_NAMES = {STICK: "sticks", SLIP: "slips", OPEN: "open"}
_PLACE_LABELS = ("along the slide [mm]", "across the slide [mm]")
_FRAMES = 9
_STRAIN_FRAMES = 4
_ROOM = 0.8e-3


@styled
def slip_frames_figure(
    history: xr.Dataset, events: Events | None = None, times: Sequence[float] | None = None, title: str = ""
) -> Figure:
    """Draw where the contact sticks and slips, seen from below, in frames over time.

    Parameters
    ----------
    history : xarray.Dataset
        A history in space.
    events : Events, optional
        Slip events, which are named above the frame that follows them.
    times : sequence of float, optional
        Moments [s]; without them nine from the start of the slide to its end or shortly after overall slip, among
        them the records at which the events have just happened.
    title : str, optional
        What tells this figure from its like, such as the name of the run.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each moment.
    """
    patch = contact_patch(history)
    moments = _with_events(history, events) if times is None else np.asarray(times, dtype=float)
    shown = titled("Stick and slip of the contact, seen from below", title)
    figure, panels = figure_grid(len(moments), 3, _panel(history, patch, 2.6), shown, _PLACE_LABELS)
    for axes, moment, before in zip(panels, moments, [None, *moments[:-1]], strict=True):
        step = _step(history, moment)
        states = triangle_states(history, patch, step)
        _fill(axes, patch, history, [_STATES[int(state)] for state in states])
        axes.set_title(f"{moment:.3f} s{_event_between(events, before, moment)}", fontsize=8.5)
    add_legend(figure, {_STATE_NAMES[state]: Swatch(color=_STATES[state]) for state in _STATE_NAMES})
    return figure


@styled
def surface_strain_figure(
    history: xr.Dataset, events: Events | None = None, component: str = "along", title: str = ""
) -> Figure:
    """Draw the Green-Lagrange strain of the skin surface and its rate over the contact at four moments of the slide.

    Parameters
    ----------
    history : xarray.Dataset
        A history in space.
    events : Events, optional
        Slip events.
    component : {'along', 'across', 'shear'}, optional
        Strain along the slide, across it, or shear.
    title : str, optional
        What tells this figure from its like, such as the name of the run.

    Returns
    -------
    matplotlib.figure.Figure
        Upper row: strain; lower row: its rate.
    """
    patch = contact_patch(history)
    strains = surface_strains(history, patch).sel(strain_component=component)
    rates = surface_strain_rates(strains)
    moments = _moments(history, events, _STRAIN_FRAMES)
    named = _STRAIN_NAMES[component]
    shown = titled(f"Green-Lagrange {named}, and its rate, seen from below", title)
    size = _panel(history, patch, 2.5)
    figure, panels = figure_grid(2 * len(moments), len(moments), size, shown, _PLACE_LABELS)
    rows = ((strains, 100.0, f"{named} [%]"), (rates, 100.0, "its rate [%/s]"))
    for row, (field, factor, label) in enumerate(rows):
        own = panels[row * len(moments) : (row + 1) * len(moments)]
        colours = _draw_fields(own, (history, patch), field * factor, moments)
        figure.colorbar(colours, ax=list(own), label=label, shrink=0.9, extend="both")
    return figure


@styled
def stick_ratio_figure(histories: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Draw the stick ratio against the tangential force over the normal force, as optical studies do.

    Parameters
    ----------
    histories : mapping of str to xarray.Dataset
        Histories by label.
    title : str, optional
        What tells this figure from its like, such as the name of the run.

    Returns
    -------
    matplotlib.figure.Figure
        One panel, a line for each history over its first slide up to where nothing sticks any more.
    """
    shown = titled("Stick ratio against tangential force", title)
    labels = ("tangential force / normal force", "sticking share of the contact area")
    figure, (axes,) = figure_grid(1, 1, (5.2, 3.4), shown, labels)
    for label, history in histories.items():
        window = slide_window(history)
        series = patch_series(history)
        chosen = series.isel(time=window.records) if window else series
        axes.plot(chosen["force_ratio"], chosen["stick_ratio"], label=label, linewidth=1.4)
    axes.set_ylim(-0.03, 1.03)
    if len(histories) > 1:
        axes.legend(fontsize=8)
    return figure


@styled
def reference_nodes_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw displacement and acceleration along the slide of the recorded reference nodes over time.

    Parameters
    ----------
    history : xarray.Dataset
        A history whose sites have kinds that end in ``surface``, as the reference nodes of the fingertip have.
    events : Events, optional
        Slip events, which are marked.
    title : str, optional
        What tells this figure from its like, such as the name of the run.

    Returns
    -------
    matplotlib.figure.Figure
        A row for each kind: displacement on the left with that of the plate, acceleration on the right.
    """
    kinds = [kind for kind in dict.fromkeys(map(str, history["site_kind"].values)) if kind.endswith("surface")]
    shown = titled("Reference nodes along the slide", title)
    labels = ("time from the start of the run [s]", "")
    figure, panels = figure_grid(2 * len(kinds), 2, (4.4, 2.5), shown, labels, share="x")
    keys: dict[str, Artist] = {}
    tangent = plate_tangent(history)
    for row, kind in enumerate(kinds):
        left, right = panels[2 * row], panels[2 * row + 1]
        keys |= _draw_nodes(left, history, kind, 1e3 * history["displacement"].values @ tangent)
        _draw_nodes(right, history, kind, history["acceleration"].values @ tangent)
        left.plot(
            history["time"],
            1e3 * history["counterface_displacement"].values[:, 0] @ tangent,
            color=BLACK,
            linestyle=":",
        )
        left.set_ylabel("displacement [mm]")
        right.set_ylabel("acceleration [m/s²]")
        left.set_title(kind, fontsize=8.5)
        for axes in (left, right):
            _mark(axes, history, events)
        _leave_jerk_out(right, history, kind)
    keys["plate"] = Line2D([], [], color=BLACK, linestyle=":")
    add_legend(figure, keys | event_keys())
    return figure


def _draw_nodes(axes: Axes, history: xr.Dataset, kind: str, signals: Floats) -> dict[str, Artist]:
    """Draw the nodes of a kind, a line style for each line of nodes and a colour for each place on it."""
    rows = np.flatnonzero(history["site_kind"].values == kind)
    names = [str(name).rpartition("-")[2] for name in history["site"].values[rows]]
    lines = [name.rstrip("0123456789") for name in names]
    styles = dict(zip(dict.fromkeys(lines), cycle(_LINE_STYLES), strict=False))
    keys: dict[str, Artist] = {}
    for place, (row, name, line) in enumerate(zip(rows, names, lines, strict=True)):
        number, count = lines[:place].count(line), lines.count(line)
        colour = colormaps["plasma"](0.9 * number / max(count - 1, 1))
        (keys[name],) = axes.plot(history["time"], signals[:, row], linewidth=1.0, color=colour, linestyle=styles[line])
    return keys


def _leave_jerk_out(axes: Axes, history: xr.Dataset, kind: str) -> None:
    """Scale accelerations without the jerk at the start of the slide, which would hide all others."""
    window = slide_window(history)
    times = history["time"].values
    if window is None or window.start + _JERK >= times[-1]:
        return
    rows = history["site_kind"].values == kind
    signals = history["acceleration"].values[:, rows] @ plate_tangent(history)
    later = (times < window.start) | (times > window.start + _JERK)
    top, largest = float(np.abs(signals[later]).max()), float(np.abs(signals).max())
    if 0.0 < 2.0 * top < largest:
        axes.set_ylim(-1.3 * top, 1.3 * top)
        said = f"start of the slide cut off: up to {largest:.1f} m/s²"
        axes.set_title(said, fontsize=7.5, color=GREY, loc="right")


def _mark(axes: Axes, history: xr.Dataset, events: Events | None) -> None:
    window = slide_window(history)
    if window is not None:
        mark_slide(axes, window.start)
    if events is not None:
        mark_events(axes, events.slip)


def _draw_fields(
    panels: Sequence[Axes], where: tuple[xr.Dataset, Patch], field: xr.DataArray, moments: Floats
) -> ScalarMappable:
    """Draw a field on the triangles in contact at some moments, in colours that share one scale about zero."""
    history, patch = where
    steps = [_step(history, moment) for moment in moments]
    touching = field["touching"].values
    seen = np.concatenate([np.abs(field.values[step][touching[step]]) for step in steps] + [np.zeros(1)])
    top = float(np.quantile(seen, 0.98)) or 1.0
    colours = ScalarMappable(Normalize(-top, top), "RdBu_r")
    for axes, moment, step in zip(panels, moments, steps, strict=True):
        paint = colours.to_rgba(field.values[step])
        paint[~touching[step]] = (0.92, 0.93, 0.94, 1.0)
        _fill(axes, patch, history, paint)
        axes.set_title(f"{moment:.3f} s", fontsize=8.5)
    return colours


def _fill(axes: Axes, patch: Patch, history: xr.Dataset, colours: Sequence[str] | Floats) -> None:
    """Fill the triangles of the patch and frame what ever touches."""
    corners = 1e3 * patch.places[patch.triangles]
    axes.add_collection(PolyCollection(list(corners), facecolors=colours, edgecolors="face", linewidths=0.2))
    low, high = _frame(history, patch)
    axes.grid(visible=False)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")


def _frame(history: xr.Dataset, patch: Patch) -> tuple[Floats, Floats]:
    """Return the corners of a frame round all that ever touches [mm]."""
    ever = (history["contact_state"].values[:, patch.nodes] != OPEN).any(axis=0)
    places = patch.places[ever] if ever.any() else patch.places
    return 1e3 * (places.min(axis=0) - _ROOM), 1e3 * (places.max(axis=0) + _ROOM)


def _panel(history: xr.Dataset, patch: Patch, width: float) -> tuple[float, float]:
    """Return the size of a panel [inch] that the patch fills, with room for title and labels."""
    low, high = _frame(history, patch)
    return width, min(max((width - 0.4) * (high[1] - low[1]) / (high[0] - low[0]), 1.0), 3.0) + 0.5


def _moments(history: xr.Dataset, events: Events | None, count: int) -> Floats:
    """Return moments from the start of the slide to shortly after overall slip, or all of a run without a slide."""
    times = history["time"].values
    window = slide_window(history)
    start, end = (window.start, window.end) if window else (float(times[0]), float(times[-1]))
    overall = events.overall if events else None
    if overall is not None:
        end = min(end, overall + 0.1 * (overall - start))
    step = np.array([_step(history, moment) for moment in np.linspace(start, end, count)])
    moments: Floats = times[step]
    return moments


def _with_events(history: xr.Dataset, events: Events | None) -> Floats:
    """Return evenly spaced moments, the nearest ones moved to the first records after the events."""
    moments, times = _moments(history, events, _FRAMES), history["time"].values
    free = np.arange(1, moments.size)
    for event in (events.incipient, events.three_quarter, events.overall) if events else ():
        if event is None or not moments[0] < event <= moments[-1] or free.size == 0:
            continue
        record = times[min(int(np.searchsorted(times, event)), times.size - 1)]
        chosen = free[np.abs(moments[free] - record).argmin()]
        moments[chosen] = record
        free = free[free != chosen]
    return np.sort(moments)


def _step(history: xr.Dataset, moment: float) -> int:
    return int(np.abs(history["time"].values - moment).argmin())


def _event_between(events: Events | None, before: float | None, moment: float) -> str:
    if events is None or before is None:
        return ""
    names: Mapping[str, Callable[[Events], float | None]] = {
        "incipient": lambda found: found.incipient,
        "three-quarter": lambda found: found.three_quarter,
        "overall": lambda found: found.overall,
    }
    passed = [name for name, read in names.items() if (time := read(events)) is not None and before < time <= moment]
    return f" ({', '.join(passed)})" if passed else ""
