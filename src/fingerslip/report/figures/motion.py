"""A run in motion: the frames of a film, and a history to browse with a slider."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.animation import FuncAnimation
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.widgets import Slider
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import InputError
from fingerslip.history import is_solid, nearest_record
from fingerslip.report.colours import BLACK, BLUE, GREY, ORANGE, STATE_NAMES
from fingerslip.report.figures import style, time_axis
from fingerslip.report.figures.bodies import add_field_bar, draw_section
from fingerslip.report.figures.signals import draw_forces, draw_ratios, draw_states
from fingerslip.report.labels import of_histories
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import check_options, field_limits
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import Events, SlipEvents, slide_window
from fingerslip.slip.windows import EVENTS, slide_tangent

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


@style.with_style
def _draw_frame(
    history: xr.Dataset, events: Events, number: int, picture: Frame | None, *, options: SceneOptions, film: Film
) -> Frame:
    """Draw a snapshot beside its signals; a solid as the picture of it."""
    width, height = (side / _DOTS_PER_INCH for side in film.size)
    figure = Figure(figsize=(width, height), dpi=_DOTS_PER_INCH, layout="constrained")
    grid = figure.add_gridspec(1, 2, width_ratios=(1.15, 1.0))
    time, limits = float(history["snapshot_time"].values[number]), field_limits(history, options)
    body = figure.add_subplot(grid[0])
    if picture is None:
        draw_section(body, history, number, options.scalar, limits)
    else:
        style.show_picture(body, picture)
    if options.scalar != "region":
        add_field_bar(figure, [body], SCALARS[options.scalar][0], limits, location="bottom")
    rows, times = 1 if is_solid(history) else 2, time_axis.ShownTime(history["time"].values)
    panels: list[Axes] = list(grid[1].subgridspec(rows, 1).subplots(sharex=True, squeeze=False)[:, 0])
    if rows == 2:
        draw_states(panels[0], history, times)
        panels[0].set_ylabel(of_histories("position along plate [mm]", [history]))
    draw_ratios(panels[-1], history, times)
    panels[-1].legend(loc="upper left")
    panels[-1].set(xlim=(0.0, float(times.values[-1])), ylim=(0.0, 1.35), xlabel="time [s]")
    time_axis.mark_panels(panels, history, events.slip)
    for axes in panels:
        axes.axvline(time, color=BLACK, linewidth=1.6, zorder=6)
    figure.suptitle(f"t = {time:.3f} s   {_words(history, events.slip, time)}", x=0.02, ha="left")
    return style.pixels(figure)


def _words(history: xr.Dataset, events: SlipEvents, time: float) -> str:
    """Say what is going on: the phase, and the last event."""
    happened = [EVENTS[name] for name, event in time_axis.event_times(events).items() if event <= time]
    window, phase = slide_window(history), ""
    if window is not None:
        phase = "pressing" if time < window.start else f"{time - window.start:.3f} s into the slide"
    return f"{phase}, after {happened[-1]} slip" if happened else phase


_COLOURS = {OPEN: GREY, STICK: BLUE, SLIP: ORANGE}
_SIZE = (7.2, 5.4)  # inch
_FRAMES = 40
_MILLISECONDS = 150


@dataclass(frozen=True, repr=False)
class HistoryPlot:
    """A history at one time of many: a slider in notebooks and in windows.

    See :func:`plot`.

    Parameters
    ----------
    history : xarray.Dataset
        The history.
    figure : matplotlib.figure.Figure
        The figure at the time that was set last.
    show_record : callable
        Shows the record of a number, and returns what changes in the figure.
    """

    history: xr.Dataset
    figure: Figure
    show_record: Callable[[int], list[Any]]

    def at(self, time: float) -> HistoryPlot:
        """Show the record that is nearest to a time [s], and return the plot."""
        self.show_record(nearest_record(self.history, time))
        return self

    def show(self) -> Slider:
        """Open a window with a slider, where there is a screen; the slider lives as long as it is kept."""
        import matplotlib.pyplot as plt

        figure = plt.figure(figsize=_SIZE)
        show_record = _draw(figure, self.history)
        figure.subplots_adjust(left=0.11, right=0.97, top=0.96, bottom=0.2, hspace=0.35)
        bar, times = figure.add_axes((0.15, 0.05, 0.7, 0.03)), self.history["time"].values
        slider = Slider(bar, "time [s]", float(times[0]), float(times[-1]), valinit=float(times[0]))
        slider.on_changed(lambda time: show_record(nearest_record(self.history, time)))
        plt.show()
        return slider

    def _repr_html_(self) -> str:
        """Return the plot with a slider, as notebooks show it; it works without the kernel."""
        numbers = np.unique(np.linspace(0, self.history.sizes["time"] - 1, _FRAMES).round().astype(int)).tolist()
        animation = FuncAnimation(self.figure, self.show_record, numbers, interval=_MILLISECONDS, repeat=False)
        return str(animation.to_jshtml(default_mode="once"))

    def __repr__(self) -> str:
        times = self.history["time"].values
        return f"<HistoryPlot: {times.size} records, {times[0]:g} to {times[-1]:g} s>"


@style.with_style
def plot(history: xr.Dataset) -> HistoryPlot:
    """Plot contact pressure and contact state along the skin at one time, and the forces over time, with a slider.

    In a notebook the plot appears with its slider where it is the last value of a cell; :meth:`HistoryPlot.show` opens
    a window.

    Parameters
    ----------
    history : xarray.Dataset
        What :func:`fingerslip.simulate` returned.

    Returns
    -------
    HistoryPlot
        The plot; ``plot(history).at(1.2).figure.savefig("x.png")`` keeps one time.

    Raises
    ------
    InputError
        For a history without contact.

    Examples
    --------
    In a notebook::

        fs.plot(history)
    """
    if history.sizes.get("contact_node", 0) == 0:
        raise InputError("history", "has no contact nodes", "needs a history of a model with contact")
    figure = Figure(figsize=_SIZE, layout="constrained")
    FigureCanvasAgg(figure)
    return HistoryPlot(history, figure, _draw(figure, history))


def _draw(figure: Figure, history: xr.Dataset) -> Callable[[int], list[Any]]:
    """Draw the first record of a history, and return what shows another one."""
    above, below = figure.subplots(2, 1)
    times, states = history["time"].values, history["contact_state"].values
    along = 1e3 * history["contact_position"].values @ slide_tangent(history)
    pressure = 1e-3 * history["normal_traction"].values
    offsets = np.stack([np.broadcast_to(along, pressure.shape), pressure], axis=-1)
    order = sorted(_COLOURS)
    colours = to_rgba_array([_COLOURS[state] for state in order])[np.searchsorted(order, states)]
    points = above.scatter(offsets[0][:, 0], offsets[0][:, 1], c=colours[0], s=14)
    touched, top = along[(states != OPEN).any(axis=0)], max(pressure.max(), 1e-9)
    low, high = (touched.min(), touched.max()) if touched.size else (0.0, 1.0)
    margin = 0.05 * max(high - low, 1e-6)
    limits: dict[str, Any] = {"xlim": (low - margin, high + margin), "ylim": (-0.03 * top, 1.1 * top)}
    above.set(**limits, xlabel="position along the slide [mm]", ylabel="contact pressure [kPa]")
    keys = [Line2D([], [], color=colour, marker="o", linestyle="", markersize=4) for colour in _COLOURS.values()]
    above.legend(keys, [STATE_NAMES[state] for state in _COLOURS], loc="upper right")
    text = above.text(0.01, 0.95, f"{times[0]:.3f} s", transform=above.transAxes, va="top")
    draw_forces(below, history, times)
    below.set(xlabel="time [s]", xlim=(times[0], times[-1]))
    style.add_keys_inside(below)
    cursor = below.axvline(times[0], color=GREY)

    def show_record(number: int) -> list[Any]:
        points.set_offsets(offsets[number])
        points.set_facecolor(colours[number])
        cursor.set_xdata([times[number]] * 2)
        text.set_text(f"{times[number]:.3f} s")
        return [points, cursor, text]

    return show_record
