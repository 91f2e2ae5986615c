"""A history to browse: contact pressure and state along the skin at the time of a slider, and the forces over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.animation import FuncAnimation
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.widgets import Slider

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import InputError
from fingerslip.report.colours import BLACK, BLUE, GREY, ORANGE, STATE_NAMES, VERMILLION
from fingerslip.report.figures.style import with_style
from fingerslip.slip.windows import contact_forces, slide_tangent

_COLOURS = {OPEN: GREY, STICK: BLUE, SLIP: ORANGE}
_SIZE = (7.2, 5.4)  # inch
_FRAMES = 40
_MILLISECONDS = 150


@dataclass(frozen=True, repr=False)
class HistoryPlot:
    """A history at one time of many: a slider in notebooks and in windows.

    Parameters
    ----------
    history : xarray.Dataset
        The history.
    figure : matplotlib.figure.Figure
        The figure at the time that was set last.
    parts : object
        What in the figure changes with the time.
    """

    history: xr.Dataset
    figure: Figure
    parts: _Parts

    def at(self, time: float) -> HistoryPlot:
        """Show the record that is nearest to a time [s], and return the plot."""
        self.parts.show_nearest(time)
        return self

    def show(self) -> Slider:
        """Open a window with a slider, where there is a screen; the slider lives as long as it is kept."""
        import matplotlib.pyplot as plt

        figure = plt.figure(figsize=_SIZE)
        changing = _draw(figure, self.history)
        figure.subplots_adjust(left=0.11, right=0.97, top=0.96, bottom=0.2, hspace=0.35)
        bar, times = figure.add_axes((0.15, 0.05, 0.7, 0.03)), self.history["time"].values
        slider = Slider(bar, "time [s]", float(times[0]), float(times[-1]), valinit=float(times[0]))
        slider.on_changed(changing.show_nearest)
        plt.show()
        return slider

    def _repr_html_(self) -> str:
        """Return the plot with a slider, as notebooks show it; it works without the kernel."""
        numbers = np.unique(np.linspace(0, self.history.sizes["time"] - 1, _FRAMES).round().astype(int)).tolist()
        animation = FuncAnimation(self.figure, self.parts.show, numbers, interval=_MILLISECONDS, repeat=False)
        return str(animation.to_jshtml(default_mode="once"))

    def __repr__(self) -> str:
        times = self.history["time"].values
        return f"<HistoryPlot: {times.size} records, {times[0]:g} to {times[-1]:g} s>"


@with_style
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


@dataclass(frozen=True)
class _Parts:
    """What changes with the time."""

    points: PathCollection
    cursor: Line2D
    text: Any
    times: np.ndarray
    offsets: np.ndarray
    colours: np.ndarray

    def show(self, number: int) -> list[Any]:
        self.points.set_offsets(self.offsets[number])
        self.points.set_facecolor(self.colours[number])
        self.cursor.set_xdata([self.times[number]] * 2)
        self.text.set_text(f"{self.times[number]:.3f} s")
        return [self.points, self.cursor, self.text]

    def show_nearest(self, time: float) -> None:
        self.show(int(np.abs(self.times - time).argmin()))


def _draw(figure: Figure, history: xr.Dataset) -> _Parts:
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
    forces = contact_forces(history)
    below.plot(times, forces.normal, color=BLACK, label="normal")
    below.plot(times, forces.friction, color=VERMILLION, label="friction")
    below.set(xlabel="time [s]", ylabel="force [N]", xlim=(times[0], times[-1]))
    below.legend(loc="upper left")
    return _Parts(points, below.axvline(times[0], color=GREY), text, times, offsets, colours)
