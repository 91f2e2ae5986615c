"""The frames of a film: the deformed body, the slip map and the force ratio, with the events as they come."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.history import is_solid, nearest_snapshot
from fingerslip.report.colours import BLACK, EVENT_COLOURS, FIELD_MAP, GREY
from fingerslip.report.figures.contact import draw_ratios
from fingerslip.report.figures.deformed import draw_section
from fingerslip.report.figures.marks import mark_run
from fingerslip.report.figures.slip import ShownTime, draw_states
from fingerslip.report.figures.solid import crop
from fingerslip.report.figures.style import figure_grid, join_title, say, with_style
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import check_options, field_limits
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import Events, slide_window
from fingerslip.slip.windows import EVENTS

__all__ = [
    "MOVED",
    "Film",
    "film_frames",
    "film_times",
    "frames_figure",
    "onsets",
    "slip_order_figure",
]


Frame = NDArray[np.uint8]

_DOTS_PER_INCH = 100
_LEAST = (320, 240)


@dataclass(frozen=True)
class Film:
    """How a film is made."""

    size: tuple[int, int] = (1280, 720)  # width and height [pixels], both even
    frame_rate: float = 25.0  # frames a second [1/s]
    seconds: float = 8.0  # how long it lasts [s]

    def __post_init__(self) -> None:
        if any(side % 2 or side < least for side, least in zip(self.size, _LEAST, strict=True)):
            fault = f"got {self.size[0]}x{self.size[1]}"
            raise InputError("figure: --size", fault, "needs an even width and height of at least 320x240")
        for name, value in (("--rate", self.frame_rate), ("--seconds", self.seconds)):
            if not 0.0 < value < np.inf:
                raise InputError(f"figure: {name}", f"got {value:g}", "needs a number > 0")


def film_frames(
    history: xr.Dataset, events: Events, options: SceneOptions | None = None, film: Film | None = None
) -> Iterator[Frame]:
    """Draw the frames of a film of a run, even in its time; the body is drawn at the snapshot nearest to each.

    Arrays: returns (height, width, 3).
    """
    options, film = options or SceneOptions(), film or Film()
    check_options(history, options)
    times = history["snapshot_time"].values
    moments = np.linspace(times[0], times[-1], max(round(film.seconds * film.frame_rate), 1))
    numbers = np.abs(times[:, None] - moments).argmin(axis=0)
    pictures = _pictures(history, np.unique(numbers), options, film)
    number, frame = -1, np.zeros((0, 0, 3), dtype=np.uint8)
    for wanted in numbers:
        if wanted != number:
            picture = next(pictures)
            number, frame = int(wanted), _drawn((history, events), int(wanted), picture, (options, film))
        yield frame


def _pictures(history: xr.Dataset, numbers: NDArray[Any], options: SceneOptions, film: Film) -> Iterator[Frame | None]:
    """Yield rendered views of a solid; of a section nothing, which is drawn in the frame itself."""
    if not is_solid(history):
        yield from (None for _ in numbers)
        return
    side = (film.size[0] // 2, film.size[1] - 80)
    bare = dataclasses.replace(options, written=False)
    yield from stills(history, [int(number) for number in numbers], bare, side)


@with_style
def _drawn(
    run: tuple[xr.Dataset, Events], number: int, picture: Frame | None, scene: tuple[SceneOptions, Film]
) -> Frame:
    (history, events), (options, film) = run, scene
    width, height = (side / _DOTS_PER_INCH for side in film.size)
    figure = Figure(figsize=(width, height), dpi=_DOTS_PER_INCH, layout="constrained")
    canvas: Any = FigureCanvasAgg(figure)
    grid = figure.add_gridspec(1, 2, width_ratios=(1.15, 1.0))
    time = float(history["snapshot_time"].values[number])
    _draw_body(figure, grid[0], (history, number), (picture, options))
    _draw_signals(grid[1], history, events, time)
    figure.suptitle(f"t = {time:.3f} s   {_now(history, events, time)}", x=0.02, ha="left")
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _draw_body(
    figure: Figure, cell: SubplotSpec, snapshot: tuple[xr.Dataset, int], look: tuple[Frame | None, SceneOptions]
) -> None:
    (history, number), (picture, options) = snapshot, look
    axes, limits = figure.add_subplot(cell), field_limits(history, options)
    if picture is None:
        draw_section(axes, history, number, options.scalar, limits)
        axes.set_xlabel("x [mm]")
        axes.set_ylabel("y [mm]")
    else:
        axes.imshow(picture)
        axes.set_axis_off()
    if options.scalar != "region":
        colours = ScalarMappable(Normalize(*limits), FIELD_MAP)
        figure.colorbar(colours, ax=axes, label=SCALARS[options.scalar][0], location="bottom", extend="max", shrink=0.8)


def _draw_signals(cell: SubplotSpec, history: xr.Dataset, events: Events, time: float) -> None:
    rows = 1 if is_solid(history) else 2
    panels: list[Axes] = list(cell.subgridspec(rows, 1).subplots(sharex=True, squeeze=False)[:, 0])
    if rows == 2:
        draw_states(panels[0], history, ShownTime(history["time"].values))
        panels[0].set_ylabel("position along plate [mm]")
    draw_ratios(panels[-1], history, history["time"].values)
    panels[-1].legend(loc="upper left")
    panels[-1].set_ylim(0.0, 1.35)
    panels[-1].set_xlabel("time [s]")
    for axes in panels:
        mark_run(axes, history, _until(events, time))
        axes.axvline(time, color=BLACK, linewidth=1.6, zorder=6)
        axes.set_xlim(0.0, float(history["time"].values[-1]))
    _name(panels[0], history, events, time)


def _until(events: Events, time: float) -> Any:
    """Return the events from accumulated slip that have happened by a time."""
    later: dict[str, Any] = {
        name: None for name in EVENTS if (element := events.slip.time(name)) is not None and element > time
    }
    return dataclasses.replace(events.slip, **later)


def _name(axes: Axes, history: xr.Dataset, events: Events, time: float) -> None:
    """Write the names of the events that have happened above a panel.

    Those to come take their room unseen: nothing moves when a name appears.
    """
    end = float(history["time"].values[-1])
    reached = -1.0
    for name, words in EVENTS.items():
        element = events.slip.time(name)
        if element is None or name == "noticed":
            continue
        at = max(element / end, reached)
        reached = at + 0.06
        look: dict[str, Any] = {"color": EVENT_COLOURS[name], "alpha": float(element <= time)}
        axes.text(at, 1.02, words, transform=axes.transAxes, rotation=30, rotation_mode="anchor", **look)


def _now(history: xr.Dataset, events: Events, time: float) -> str:
    """Say what is going on: the phase, and the last event."""
    happened = [
        words for name, words in EVENTS.items() if (element := events.slip.time(name)) is not None and element <= time
    ]
    window = slide_window(history)
    phase = ""
    if window is not None:
        phase = "pressing" if time < window.start else f"{time - window.start:.3f} s into the slide"
    return f"{phase}, after {happened[-1]} slip" if happened else phase


Floats = NDArray[np.float64]

#: Distance in the image from where a marker was when the slide began, from which on it counts as slipping [px].
MOVED = 1.0
_PANELS = 4
_SIZE = (960, 660)
_REFERENCE = 5  # frames before the slide whose mean is where markers were
_PANEL = (2.7, 2.1)


def film_times(start: float, end: float, first: float) -> tuple[float, ...]:
    """Return the times of the frames that a report shows [s]: at rest, at the start of the slide, in it, at its end."""
    return (first, start, start + (end - start) / 3.0, end)


@with_style
def frames_figure(history: xr.Dataset, frames: Mapping[float, Frame], title: str = "") -> Figure:
    """Draw frames of a camera above the computed body at the snapshots that are nearest in time.

    Arrays: frames (height, width) [s].
    """
    times = list(frames)[:_PANELS]
    heading = join_title("What the camera sees, and the body at that time", title)
    figure, panels = figure_grid(2 * len(times), len(times), _PANEL, heading, ("", ""), share="none")
    numbers = [nearest_snapshot(history, max(time, 0.0)) for time in times]
    options = SceneOptions(scalar="region", cut="z" if is_solid(history) else "none", camera="side", written=False)
    bodies = crop(stills(history, numbers, options, _SIZE))
    for number, time in enumerate(times):
        above, below = panels[number], panels[len(times) + number]
        above.imshow(frames[time], cmap="gray", vmin=0, vmax=255)
        above.set_title("frame at rest" if time < 0.0 else f"frame at {time:.2f} s")
        below.imshow(bodies[number])
        below.set_title(f"snapshot at {float(history['snapshot_time'][numbers[number]]):.2f} s")
        for axes in (above, below):
            axes.set_axis_off()
    return figure


def onsets(tracks: xr.Dataset, start: float) -> tuple[Floats, Floats]:
    """Return when each marker starts to move in the image, and how far it is from the middle one.

    Parameters
    ----------
    tracks : xarray.Dataset
        Tracks [px] of an external camera that goes with the plate: a marker that sticks stands still.
    start : float
        Start of the slide [s].

    Returns
    -------
    (n,) array, (n,) array
        Time after `start` from which a marker is more than `MOVED` from where it was [s], NaN for one that is not; its
        distance from the marker of ring 0 at the start [px].
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
    """Draw how markers of the skin move in the image of the external camera, and when each starts to.

    Arrays: tracks [px]; start [s]; touching (n,).
    """
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
    colour = _colours(distance, chosen)
    for marker in map(int, chosen[np.argsort(-distance[chosen])]):
        path = np.linalg.norm(position[first:, marker] - position[first, marker], axis=1)
        moved.plot(times[first:], path, color=colour[marker], linewidth=0.8)
    latest = float(np.nanmax(when[chosen], initial=0.1))
    moved.set_xlim(0.0, 1.6 * latest)
    moved.set_ylim(0.0, 12.0 * MOVED)
    moved.axhline(MOVED, color=GREY, linewidth=0.8, linestyle="--")
    moved.set_ylabel("distance from where it stuck [px]")
    where.scatter(distance[chosen], when[chosen], s=14, c=[colour[marker] for marker in map(int, chosen)])
    where.set_xlabel("distance from the central marker [px]")
    where.set_ylabel(f"moved by {MOVED:g} px after [s]")
    where.axhline(float(when[int(np.argmin(tracks["ring"].values))]), color=BLACK, linewidth=0.8, linestyle=":")
    return figure


def _colours(distance: Floats, chosen: NDArray[np.intp]) -> dict[int, tuple[float, float, float, float]]:
    """Return a colour for each chosen marker, from the middle outwards."""
    from matplotlib import colormaps

    largest = float(distance[chosen].max(initial=1.0)) or 1.0
    return {int(marker): colormaps["viridis"](0.9 * distance[marker] / largest) for marker in chosen}
