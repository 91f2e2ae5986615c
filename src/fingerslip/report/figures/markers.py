"""Figures of markers: fields, how good tracks are, what the cameras of a sensor see."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.tri import Triangulation
from numpy.typing import NDArray
from scipy.spatial import KDTree

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.history import nearest_snapshot
from fingerslip.report.colours import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION
from fingerslip.report.figures.style import add_legend, crop, figure_grid, join_title, say, show_picture, with_style
from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.scene.scene import middle_cut
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import SlideWindow, slide_window
from fingerslip.vision.fields import larger_principal
from fingerslip.vision.video import FINE

_MIDDLE = 1e-9  # as far from x = 0 a marker counts as in the middle
#: How a length of tracks is shown: its unit, and the factor to it.
SHOWN_UNITS = {"m": ("mm", 1e3), "px": ("px", 1.0)}
_SHARE = 0.8  # of the distance between markers that the longest arrow of a panel takes


def ring_colours(rings: NDArray[np.integer]) -> Floats:
    """Return the colours (n_markers, 4) of markers by their rings (n_markers,), from the centre outwards."""
    return np.asarray(colormaps["viridis"](0.85 * rings / max(rings.max(initial=0), 1)))


def ring_keys(rings: NDArray[np.integer]) -> dict[str, Artist]:
    """Return keys of the rings (n_markers,) for a legend."""
    return {
        f"ring {ring}" if ring else "centre": Line2D([], [], color=tuple(colour), linewidth=2.0)
        for ring, colour in sorted(zip(rings.tolist(), ring_colours(rings), strict=True), key=lambda pair: pair[0])
    }


def centre_last(rings: NDArray[np.integer]) -> NDArray[np.intp]:
    """Return the order (n_markers,) in which markers are drawn: the centre last, above all others."""
    return np.argsort(-rings, kind="stable")


@with_style
def marker_tracks_figure(tracks: xr.Dataset, title: str = "") -> Figure:
    """Draw how far each marker has moved since it was first seen, coloured by its distance from the middle."""
    unit, scale = SHOWN_UNITS[str(tracks["position"].attrs["units"])]
    axes_names, heading = [str(name) for name in tracks["axis"].values], join_title("Markers over time", title)
    labels = ("time [s]", f"displacement [{unit}]")
    figure, panels = figure_grid(len(axes_names), 3, (3.6, 2.8), heading, labels)
    moved = position = tracks["position"].values
    first = np.zeros(position.shape[1:])
    if len(position):
        first = position[(~np.isnan(position)).all(axis=2).argmax(axis=0), np.arange(position.shape[1])]
        moved = scale * (position - first)
    middle = first if np.isnan(first).all() else np.nanmean(first, axis=0)
    away = np.nan_to_num(np.linalg.norm(first - middle, axis=1))
    colours = colormaps["viridis"](0.85 * away / (away.max(initial=0.0) or 1.0))
    for number, (axes, name) in enumerate(zip(panels, axes_names, strict=True)):
        axes.set_title(f"along {name}")
        for marker in np.argsort(-away):
            axes.plot(tracks["time"], moved[:, marker, number], color=tuple(colours[marker]), linewidth=0.6)
    ends = {"markers in the middle": away.argmin(), "at the rim": away.argmax()} if away.any() else {}
    add_legend(figure, {name: Line2D([], [], color=tuple(colours[end]), linewidth=2.0) for name, end in ends.items()})
    return figure


@with_style
def fields_figure(fields: xr.Dataset, time: float, title: str = "") -> Figure:
    """Draw the fields of markers at one time [s]."""
    now = fields.isel(time=int(np.abs(fields["time"].values - time).argmin()))
    unit, scale = SHOWN_UNITS[str(fields["position"].attrs["units"])]
    heading = join_title(f"Fields from markers at {float(now['time']):.3g} s", title)
    figure, panels = figure_grid(6, 3, (3.3, 3.1), heading, (f"x at rest [{unit}]", f"y at rest [{unit}]"))
    arrows = {"displacement": unit, "velocity": f"{unit}/s", "rigid_residual": unit}
    for axes, (name, of) in zip(panels, arrows.items(), strict=False):
        axes.set_title(name.replace("_", " "))
        _draw_arrows(axes, scale * now["rest"].values, scale * now[name].values, of)
    centroid = scale * now["contact_centroid"].values
    if not np.isnan(centroid).any():
        panels[0].scatter(centroid[0], centroid[1], marker="+", s=90, color=VERMILLION, linewidths=1.6, zorder=5)
    strain = larger_principal(now["strain"].values)
    surfaces = {"divergence": now["divergence"].values, "curl": now["curl"].values, "larger principal strain": strain}
    for axes, (name, values) in zip(panels[3:], surfaces.items(), strict=True):
        axes.set_title(f"{name} [%]")
        _draw_surface(axes, now, scale, 100.0 * values, figure.colorbar)
    for axes in panels:
        axes.set_aspect("equal")
    # In pictures y points down.
    if unit == "px":
        panels[0].invert_yaxis()
    return figure


def _draw_arrows(axes: Axes, rest: Floats, vectors: Floats, unit: str) -> None:
    """Draw arrows from the markers at rest, the longest as long as the markers are apart, and say how long that is."""
    plane, moves = rest[:, :2], vectors[:, :2]
    axes.scatter(plane[:, 0], plane[:, 1], s=4, color=GREY, zorder=2)
    longest = float(np.nanmax(np.hypot(*moves.T), initial=0.0))
    if longest > 0:
        visible = plane[~np.isnan(plane).any(axis=1)]
        apart = np.median(KDTree(visible).query(visible, k=2)[0][:, 1]) if len(visible) > 1 else 1.0
        grown = moves * (_SHARE * float(apart) / longest)
        axes.quiver(*plane.T, *grown.T, angles="xy", scale_units="xy", scale=1, color=BLUE, width=0.006, zorder=3)
    axes.text(0.02, 0.02, f"longest {longest:.3g} {unit}", transform=axes.transAxes, fontsize=7.5, color=BLACK)
    lost = np.isnan(moves).any(axis=1)
    axes.scatter(plane[lost, 0], plane[lost, 1], s=18, marker="x", color=VERMILLION, linewidths=0.9, zorder=4)


def _draw_surface(axes: Axes, now: xr.Dataset, scale: float, values: Floats, colorbar: Callable[..., object]) -> None:
    """Draw values at markers or in triangles as colours, the same to both sides of zero."""
    corners = now["triangle_marker"].values
    by_marker = values.size == now.sizes["marker"] and values.size != len(corners)
    lost = np.isnan(values[corners]).any(axis=1) if by_marker else np.isnan(values)
    if not len(corners) or lost.all():
        say(axes, "no triangle of markers")
        return
    largest = float(np.nanmax(np.abs(values))) or 1.0
    options: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -largest, "vmax": largest, "rasterized": True}
    plane, colours = scale * now["rest"].values, np.nan_to_num(values)
    mesh = Triangulation(plane[:, 0], plane[:, 1], corners)
    mesh.set_mask(lost)
    if by_marker:
        drawn = axes.tripcolor(mesh, colours, shading="gouraud", **options)
    else:
        drawn = axes.tripcolor(mesh, facecolors=colours, **options)
    colorbar(drawn, ax=axes, shrink=0.75)


@with_style
def count_figure(tracks: xr.Dataset) -> Figure:
    """Draw how many markers were seen over time, and below it when each was lost."""
    # What tracks is slow to load, and pages of runs do without.
    from fingerslip.vision.tracking.track import lost_intervals, seen_count

    labels = ("time [s]", "")
    figure, (count, lost) = figure_grid(2, 1, _NARROW, "Markers that were seen", labels, share="x")
    time, n_markers = tracks["time"].values, tracks.sizes["marker"]
    count.plot(time, seen_count(tracks), color=BLUE, linewidth=1.0, drawstyle="steps-mid")
    count.axhline(n_markers, color=GREY, linewidth=0.8, linestyle="--")
    count.set_ylim(-0.03 * n_markers, 1.06 * n_markers)
    count.set_ylabel("markers")
    if "frame_state" in tracks:
        # Frames that are dark, overexposed or duplicated.
        odd = np.flatnonzero(tracks["frame_state"].values != FINE)
        for t in odd[:: max(len(odd) // 2000, 1)]:
            count.axvline(float(time[t]), color=ORANGE, linewidth=0.6, alpha=0.5, zorder=0)
    step, intervals = float(np.median(np.diff(time))) if len(time) > 1 else 1.0, lost_intervals(tracks)
    for interval in intervals:
        left, length = time[interval.first] - 0.5 * step, interval.frames * step
        colour = SKY if interval.returned else VERMILLION
        lost.barh(interval.marker, length, left=left, height=0.9, color=colour)
    lost.set_ylim(-1, n_markers)
    lost.set_ylabel("marker")
    lost.set_title("Lost: found again (light), not found again (dark)" if intervals else "No marker was lost")
    return figure


@with_style
def noise_figure(tracks: xr.Dataset, frame: NDArray[np.uint8] | None = None) -> Figure:
    """Draw the markers where they rest, coloured by their noise there, on the first frame."""
    from fingerslip.vision.tracking.track import noise_at_rest

    figure, (axes,) = figure_grid(1, 1, (6.4, 5.4), "Noise at rest", ("x [px]", "y [px]"))
    name = "image_position" if "image_position" in tracks else "position"
    rest = tracks[name].values[: max(int(tracks.attrs.get("rest_frames", 1)), 1)]
    seen_once = np.isfinite(rest).all(axis=2).any(axis=0)
    if frame is not None:
        axes.imshow(frame, cmap="gray", vmin=0, vmax=255)
    places, noise = np.nanmean(rest[:, seen_once], axis=0), noise_at_rest(tracks)[seen_once]
    drawn = axes.scatter(places[:, 0], places[:, 1], c=noise, s=46, cmap="viridis", linewidths=1.4, vmin=0.0)
    # Rings, which leave the marker visible: without a face the colour goes to the edge. The stubs lack None.
    drawn.set_facecolor("none")
    drawn.set_edgecolor(None)  # type: ignore[arg-type]
    figure.colorbar(drawn, ax=axes, label="standard deviation [px]", shrink=0.8)
    outline = [withStroke(linewidth=1.5, foreground="white")]
    still = tracks["still"].values[seen_once] if "still" in tracks else np.zeros(len(places))
    for (x, y), number, rests in zip(places, tracks["marker"].values[seen_once], still, strict=True):
        look: dict[str, Any] = {"fontsize": 7, "color": VERMILLION if rests else BLACK, "path_effects": outline}
        axes.annotate(str(number), (x, y), xytext=(3, 3), textcoords="offset points", **look)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    # Only where markers are, so that their numbers can be read.
    (left, top), (right, bottom) = places.min(axis=0), places.max(axis=0)
    margin = _MARGIN * max(right - left, bottom - top, 1.0)
    axes.set_xlim(left - margin, right + margin)
    axes.set_ylim(bottom + margin, top - margin)
    return figure


@with_style
def jump_figure(tracks: xr.Dataset) -> Figure:
    """Draw how often markers moved by how much more than their neighbours between two frames."""
    from fingerslip.vision.tracking.track import jumps

    labels = ("displacement between frames beyond the neighbours' [px]", "marker-frames")
    figure, (axes,) = figure_grid(1, 1, _NARROW, "Jumps", labels)
    sizes = jumps(tracks)
    sizes = sizes[np.isfinite(sizes)]
    if not sizes.size:
        say(axes, "no two frames with neighbours")
        return figure
    edges = np.linspace(0.0, max(float(sizes.max()), 0.1) * 1.02, 61)
    axes.hist(sizes, bins=list(edges), color=BLUE)
    axes.set_yscale("log")
    return figure


_NARROW = (4.6, 2.0)  # inch: a panel whose letters can be read on a telephone
_OF_RECORDINGS: dict[str, Any] = {"color": BLACK, "linewidth": 0.5, "alpha": 0.7}
_MARGIN = 0.08  # around the markers, of their extent
_TITLES = {"internal": "internal markers, from inside", "external": "external markers, from below"}


@with_style
def marker_places_figure(tracks: xr.Dataset, title: str = "") -> Figure:
    """Draw where the markers of tracks [m] are at rest, coloured by ring: inside ones from above, others from below."""
    kinds = [kind for kind in _TITLES if (tracks["kind"].values == kind).any()]
    rest = 1e3 * tracks["position"].values[0]
    across = rest[:, 2] if rest.shape[1] == 3 else np.zeros(len(rest))
    labels, heading = ("x, along the slide [mm]", "z, across [mm]"), join_title("Markers at rest", title)
    figure, panels = figure_grid(len(kinds), 2, (3.6, 3.2), heading, labels, share="none")
    colours = ring_colours(tracks["ring"].values)
    for axes, kind in zip(panels, kinds, strict=True):
        rows = np.flatnonzero(tracks["kind"].values == kind)
        axes.scatter(rest[rows, 0], across[rows], s=16, c=colours[rows])
        axes.set_title(f"{rows.size} {_TITLES[kind]}")
        axes.set_aspect("equal", adjustable="datalim")
        if kind == "internal":
            # As the internal camera sees them: x to the right, z downwards.
            axes.invert_yaxis()
    add_legend(figure, ring_keys(tracks["ring"].values))
    return figure


@with_style
def slide_tracks_figure(tracks: xr.Dataset, history: xr.Dataset, title: str = "", recorded: Any = None) -> Figure:
    """Draw how far markers [m] move along the first slide, less the central one, by ring, over the plate's travel.

    `recorded` tracks [m], on the clock of the history, are drawn above those of their kind.
    """
    window = slide_window(history)
    if window is None:
        raise InputError("markers", "the history has no slide", "needs one", "add a slide to its programme")
    plate = history["counterface_displacement"].values[window.records, 0]
    direction = (plate[-1] - plate[0]) / np.linalg.norm(plate[-1] - plate[0])
    travel = 1e3 * (plate - plate[0]) @ direction
    positions = tracks["position"].values[window.records]
    along = 1e3 * (positions - positions[0]) @ direction
    kinds = [kind for kind in _TITLES if (tracks["kind"].values == kind).any()]
    labels, heading = ("travel of the plate [mm]", "displacement less the centre's [mm]"), "Markers in the slide"
    figure, panels = figure_grid(len(kinds), 2, (4.2, 3.0), join_title(heading, title), labels, share="x")
    rings, start = tracks["ring"].values, tracks["position"].values[0, :, 0]
    for axes, kind in zip(panels, kinds, strict=True):
        rows = np.flatnonzero(tracks["kind"].values == kind)
        colours = ring_colours(rings[rows])
        # All move with the body by millimetres; what tells of slip is by how much they differ.
        apart = along[:, rows] - along[:, rows[rings[rows].argmin()]][:, None]
        for number in centre_last(rings[rows]):
            style = "-" if start[rows[number]] >= -_MIDDLE else "--"
            axes.plot(travel, apart[:, number], style, color=tuple(colours[number]), linewidth=0.9)
        low, high = float(np.nanmin(apart)), float(np.nanmax(apart))
        if recorded is not None and (seen := _recorded_apart(recorded, kind, window)):
            seconds, measured = seen
            ways = np.interp(seconds, history["time"].values[window.records], travel)
            axes.plot(ways, measured, **_OF_RECORDINGS)
            low, high = min(low, float(np.nanmin(measured))), max(high, float(np.nanmax(measured)))
        room = 0.06 * max(high - low, 1e-3)
        axes.set_ylim(low - room, high + room)
        axes.set_title(f"{kind} markers")
    opposite = {"starts at x < 0": Line2D([], [], color=BLACK, linestyle="--")} if (start < -_MIDDLE).any() else {}
    others = {} if recorded is None else {"recorded": Line2D([], [], **_OF_RECORDINGS)}
    add_legend(figure, ring_keys(rings) | opposite | others)
    return figure


def _recorded_apart(recorded: xr.Dataset, kind: str, window: SlideWindow) -> tuple[Floats, Floats] | None:
    """Return the times (n,) [s] of recorded tracks [m] in a slide, and how far markers go less the central one [mm].

    None where fewer than two frames see any. Along what is the direction in which all of them go in the mean: the axes
    of a recording may be turned.
    """
    moved, times = recorded["position"].values[:, recorded["kind"].values == kind], recorded["time"].values
    inside = (times >= window.start) & (times <= window.end) & ~np.isnan(moved).all(axis=(1, 2))
    if not moved.size or inside.sum() < 2:
        return None
    moved = moved[inside]
    rest = moved[0]
    way = np.nanmean(moved[-1] - rest, axis=0)
    along = 1e3 * (moved - rest) @ (way / max(float(np.linalg.norm(way)), 1e-12))
    centre = int(np.nanargmin(np.linalg.norm(rest - np.nanmean(rest, axis=0), axis=1)))
    return times[inside], along - along[:, [centre]]


#: Distance in the image from where a marker was when the slide began, from which on it counts as slipping [px].
MOVED = 1.0
_REFERENCE = 5  # frames before the slide whose mean is where markers were


def film_times(start: float, end: float, first: float) -> tuple[float, ...]:
    """Return the times of the frames that a report shows [s]: at rest, at the start of the slide, in it, at its end."""
    return (first, start, start + (end - start) / 3.0, end)


@with_style
def frames_figure(history: xr.Dataset, frames: Mapping[float, NDArray[np.uint8]], title: str = "") -> Figure:
    """Draw frames (height, width) of a camera, by their times [s], above the body at the snapshots nearest in time."""
    times = list(frames)[:4]
    heading = join_title("What the camera sees, and the body at that time", title)
    figure, panels = figure_grid(2 * len(times), len(times), (2.7, 2.1), heading, ("", ""), share="none")
    numbers = [nearest_snapshot(history, max(time, 0.0)) for time in times]
    options = SceneOptions(scalar="region", cut=middle_cut(history), camera="side", written=False)
    bodies = crop(stills(history, numbers, options, (960, 660)))
    for number, time in enumerate(times):
        above, below = panels[number], panels[len(times) + number]
        above.imshow(frames[time], cmap="gray", vmin=0, vmax=255)
        above.set_title("frame at rest" if time < 0.0 else f"frame at {time:.2f} s")
        above.set_axis_off()
        show_picture(below, bodies[number], f"snapshot at {float(history['snapshot_time'][numbers[number]]):.2f} s")
    return figure


def onsets(tracks: xr.Dataset, start: float) -> tuple[Floats, Floats]:
    """Return when markers start to move in the image (n,) [s], and how far they are from the middle one (n,) [px].

    Tracks [px] are those of a camera that goes with the plate, in which a marker that sticks stands still. Times count
    from the start of the slide, NaN for a marker that is never more than `MOVED` from where it was then.
    """
    times, position = tracks["time"].values, tracks["position"].values
    first = int(np.searchsorted(times, start - 1e-9))
    before = np.nanmean(position[max(first - _REFERENCE, 0) : first + 1], axis=0)
    away = np.linalg.norm(position[first:] - before, axis=2) > MOVED
    onset_times = np.where(away.any(axis=0), times[first + away.argmax(axis=0)] - start, np.nan)
    centre = before[int(np.argmin(tracks["ring"].values))]
    return onset_times, np.linalg.norm(before - centre, axis=1)


@with_style
def slip_order_figure(tracks: xr.Dataset, start: float, touching: NDArray[np.bool_], title: str = "") -> Figure:
    """Draw how the touching markers of the skin move in the image of the external camera, and when each starts to."""
    labels = ("time since the slide began [s]", "")
    heading = join_title("Order of slip, seen through the plate", title)
    figure, (moved, where) = figure_grid(2, 2, (4.2, 3.1), heading, labels, share="none")
    when, distance = onsets(tracks, start)
    chosen = np.flatnonzero(touching)
    if not chosen.size:
        say(moved, "no marker touches the plate")
        return figure
    times, position = tracks["time"].values - start, tracks["position"].values
    first = int(np.searchsorted(times, -1e-9))
    # From the middle outwards.
    colours = colormaps["viridis"](0.9 * distance / (float(distance[chosen].max(initial=1.0)) or 1.0))
    for marker in chosen[np.argsort(-distance[chosen])]:
        path = np.linalg.norm(position[first:, marker] - position[first, marker], axis=1)
        moved.plot(times[first:], path, color=colours[marker], linewidth=0.8)
    latest = float(np.nanmax(when[chosen], initial=0.1))
    moved.set_xlim(0.0, 1.6 * latest)
    moved.set_ylim(0.0, 12.0 * MOVED)
    moved.axhline(MOVED, color=GREY, linewidth=0.8, linestyle="--")
    moved.set_ylabel("distance from where it stuck [px]")
    where.scatter(distance[chosen], when[chosen], s=14, c=colours[chosen])
    where.set_xlabel("distance from the central marker [px]")
    where.set_ylabel(f"moved by {MOVED:g} px after [s]")
    where.axhline(float(when[int(np.argmin(tracks["ring"].values))]), color=BLACK, linewidth=0.8, linestyle=":")
    return figure
