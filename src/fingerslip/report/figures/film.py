"""The frames of a film: the deformed body, the slip map and the force ratio, with the events as they come."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
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
from fingerslip.history import is_solid
from fingerslip.report.colours import BLACK, EVENT_COLOURS, FIELD_MAP
from fingerslip.report.figures.contact import draw_ratios, draw_states
from fingerslip.report.figures.deformed import draw_section
from fingerslip.report.figures.marks import ShownTime, event_times, mark_run
from fingerslip.report.figures.style import show_picture, with_style
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import check_options, field_limits
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import Events, SlipEvents, slide_window
from fingerslip.slip.windows import EVENTS, MAIN_EVENTS

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
    """Draw the frames (height, width, 3) of a film of a run, even in its time, each at the snapshot nearest to it."""
    options, film = options or SceneOptions(), film or Film()
    check_options(history, options)
    times = history["snapshot_time"].values
    moments = np.linspace(times[0], times[-1], max(round(film.seconds * film.frame_rate), 1))
    numbers = np.abs(times[:, None] - moments).argmin(axis=0)
    pictures: Iterator[Frame] = iter(())
    if is_solid(history):
        side = (film.size[0] // 2, film.size[1] - 80)
        bare = dataclasses.replace(options, written=False)
        pictures = stills(history, np.unique(numbers).tolist(), bare, side)
    last, frame = -1, np.zeros((0, 0, 3), dtype=np.uint8)
    for number in map(int, numbers):
        if number != last:
            last, frame = number, _draw_frame(history, events, number, next(pictures, None), options=options, film=film)
        yield frame


@with_style
def _draw_frame(
    history: xr.Dataset, events: Events, number: int, picture: Frame | None, *, options: SceneOptions, film: Film
) -> Frame:
    """Draw a snapshot beside its signals; a solid as the picture of it."""
    width, height = (side / _DOTS_PER_INCH for side in film.size)
    figure = Figure(figsize=(width, height), dpi=_DOTS_PER_INCH, layout="constrained")
    canvas: Any = FigureCanvasAgg(figure)
    grid = figure.add_gridspec(1, 2, width_ratios=(1.15, 1.0))
    time, limits = float(history["snapshot_time"].values[number]), field_limits(history, options)
    body = figure.add_subplot(grid[0])
    if picture is None:
        draw_section(body, history, number, options.scalar, limits)
        body.set_xlabel("x [mm]")
        body.set_ylabel("y [mm]")
    else:
        show_picture(body, picture)
    if options.scalar != "region":
        colours, label = ScalarMappable(Normalize(*limits), FIELD_MAP), SCALARS[options.scalar][0]
        figure.colorbar(colours, ax=body, label=label, location="bottom", extend="max", shrink=0.8)
    _draw_signals(grid[1], history, events.slip, time)
    figure.suptitle(f"t = {time:.3f} s   {_words(history, events.slip, time)}", x=0.02, ha="left")
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _draw_signals(cell: SubplotSpec, history: xr.Dataset, events: SlipEvents, time: float) -> None:
    """Draw signals with a line at a time, and with the events up to it."""
    rows, times = 1 if is_solid(history) else 2, history["time"].values
    panels: list[Axes] = list(cell.subgridspec(rows, 1).subplots(sharex=True, squeeze=False)[:, 0])
    if rows == 2:
        draw_states(panels[0], history, ShownTime(times))
        panels[0].set_ylabel("position along plate [mm]")
    draw_ratios(panels[-1], history, times)
    panels[-1].legend(loc="upper left")
    panels[-1].set_ylim(0.0, 1.35)
    panels[-1].set_xlabel("time [s]")
    later: dict[str, Any] = {name: None for name, event in event_times(events, EVENTS).items() if event > time}
    for axes in panels:
        mark_run(axes, history, dataclasses.replace(events, **later))
        axes.axvline(time, color=BLACK, linewidth=1.6, zorder=6)
        axes.set_xlim(0.0, float(times[-1]))
    # Names of events to come take their room unseen: nothing moves when a name appears.
    reached = -1.0
    for name, event in event_times(events, MAIN_EVENTS).items():
        at = max(event / float(times[-1]), reached)
        reached = at + 0.06
        look: dict[str, Any] = {"color": EVENT_COLOURS[name], "alpha": float(event <= time)}
        transform = panels[0].transAxes
        panels[0].text(at, 1.02, EVENTS[name], transform=transform, rotation=30, rotation_mode="anchor", **look)


def _words(history: xr.Dataset, events: SlipEvents, time: float) -> str:
    """Say what is going on: the phase, and the last event."""
    happened = [EVENTS[name] for name, event in event_times(events, EVENTS).items() if event <= time]
    window, phase = slide_window(history), ""
    if window is not None:
        phase = "pressing" if time < window.start else f"{time - window.start:.3f} s into the slide"
    return f"{phase}, after {happened[-1]} slip" if happened else phase
