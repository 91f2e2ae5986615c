"""Held objects in motion, side by side: what holds them on both sides, and what load and grip do meanwhile."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Rectangle
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.states import OPEN
from fingerslip.history import nearest_record, nearest_snapshot
from fingerslip.libraries import xr
from fingerslip.react.loop import Grasp, Outcome
from fingerslip.react.reflex import Reaction, Response
from fingerslip.react.scenario import PLATE
from fingerslip.report.colours import BLACK, BLUE, FIELD_MAP, SKY, STATE_COLOURS, VERMILLION, YELLOW
from fingerslip.report.figures.motion import Film
from fingerslip.report.figures.style import picture_bytes, pixels, with_style
from fingerslip.report.scene.scene import CORNERS
from fingerslip.vision.video import write_video

Frame = NDArray[np.uint8]

#: How films of a report are made.
SHOWN_FILM = Film(size=(1280, 800), frame_rate=10.0, seconds=8.0)

_DOTS_PER_INCH = 100
_CODEC = "vp09"  # what browsers play
_BEFORE, _AFTER, _LAST = 20e-3, 10e-3, 0.12  # [s] shown before the load and after the decision; share of a still end
_HALF_WIDTH, _LENGTH, _PLATE_WIDTH = 5.0, 26.0, 3.0  # [mm] of the object, and of a plate on its other side
_MOST, _STRESS = 99.5, "von Mises stress [kPa]"  # share of the stresses within the colours [%]
_ROOM, _ARROW = 6.0, 4.0  # [mm] around the fingers; length of an arrow for the first force


@dataclass(frozen=True)
class _Run:
    """An object on its way, and what it is drawn from."""

    name: str
    grasp: Grasp
    alarm: float | None  # [s]
    response: Response | None
    outcome: Outcome
    history: xr.Dataset

    def force(self, time: float) -> float:
        """Return the grip force [N] at a time since the load began [s]."""
        return self.grasp.held.first_grip if self.response is None else self.response.force(time)


def write_film(path: Path, grasp: Grasp, detector: str, reactions: Mapping[str, Reaction]) -> bytes:
    """Film one object under some reactions, by name, to a detector, for browsers; return the last frame as PNG."""
    runs, alarm = [], grasp.open_loop.alarms.get(detector)
    for name, reaction in reactions.items():
        response = grasp.response_to(reaction, detector)
        outcome = grasp.branch(response)
        history = grasp.history(response, snapshots_every=grasp.held.step)
        runs.append(_Run(name, grasp, None if alarm is None else alarm.time, response, outcome, history))
    last = max(run.outcome.end for run in runs) + _AFTER
    count = max(round(SHOWN_FILM.seconds * SHOWN_FILM.frame_rate), 2)
    still = round(_LAST * count)
    figure, views = _figure(runs)

    def frames() -> Iterator[Frame]:
        for number, moment in enumerate([*np.linspace(-_BEFORE, last, count - still).tolist(), *[last] * still]):
            for view in views:
                view.show(moment)
            yield pixels(figure)[..., ::-1]
            if number == 0:
                # Nothing moves from frame to frame, and a layout costs more than a frame.
                figure.set_layout_engine("none")

    write_video(path, frames(), SHOWN_FILM.frame_rate, codec=_CODEC)
    return picture_bytes([pixels(figure)], ".png")


@with_style
def _figure(runs: Sequence[_Run]) -> tuple[Figure, list[_View]]:
    width, height = (side / _DOTS_PER_INCH for side in SHOWN_FILM.size)
    figure = Figure(figsize=(width, height), dpi=_DOTS_PER_INCH, layout="constrained")
    grid = figure.add_gridspec(2, len(runs), height_ratios=(1.7, 1.0))
    most = max(float(np.percentile(run.history["snapshot_von_mises"], _MOST)) for run in runs)
    colours = ScalarMappable(Normalize(0.0, 1e-3 * most), FIELD_MAP)
    views, last = [], max(run.outcome.end for run in runs) + _AFTER
    for column, run in enumerate(runs):
        above, below = figure.add_subplot(grid[0, column]), figure.add_subplot(grid[1, column])
        views.append(_View(run, above, colours, _draw_forces(below, run, last)))
    figure.colorbar(colours, ax=[view.axes for view in views], label=_STRESS, extend="max", shrink=0.8, pad=0.01)
    # All views have the same keys, and the same forces.
    lower = [axes for axes in figure.axes if axes.get_legend_handles_labels()[1]]
    for axes in lower:
        axes.set_ylim(top=max(other.get_ylim()[1] for other in lower))
    figure.legend(*below.get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure, views


def _draw_forces(axes: Axes, run: _Run, last: float) -> Line2D:
    """Draw load and what friction bears, with alarm, latency and rise; return the line of the present."""
    held = run.grasp.held
    times = np.linspace(-_BEFORE, last, 400)
    bears = [2.0 * held.friction * run.force(time) for time in times.tolist()]
    loads = [held.total_load(time) for time in times.tolist()]
    axes.plot(1e3 * times, bears, color=BLUE, label="what friction bears")
    axes.plot(1e3 * times, loads, color=BLACK, label="load")
    if run.alarm is not None and run.response is not None:
        start = run.response.start
        # Up to 99 % of what is added.
        rises = np.linspace(0.0, 2.0, 2001)
        added = np.array([run.response.force(start + time) - run.response.grip for time in rises.tolist()])
        full = start + float(rises[min(int(np.searchsorted(added, 0.99 * run.response.addition)), rises.size - 1)])
        for low, high, colour, name in ((run.alarm, start, YELLOW, "latency"), (start, full, SKY, "grip rises")):
            if high > low:
                axes.axvspan(1e3 * low, 1e3 * min(high, last), color=colour, alpha=0.28, linewidth=0.0, label=name)
        axes.axvline(1e3 * run.alarm, color=VERMILLION, linewidth=1.2, label="alarm")
    axes.set(xlim=(-1e3 * _BEFORE, 1e3 * last), ylim=(0.0, 1.1 * max(*bears, *loads)))
    axes.set(xlabel="time since the load began [ms]", ylabel="force along the object [N]")
    return axes.axvline(0.0, color=BLACK, linewidth=1.6, zorder=6)


class _View:
    """An object between two fingers, or a finger and a plate, at one time after another."""

    def __init__(self, run: _Run, axes: Axes, colours: ScalarMappable, now: Line2D) -> None:
        self.run, self.axes, self._now, self._colours = run, axes, now, colours
        history, held = run.history, run.grasp.held
        self._skin = history["contact_counterface"].values == 0
        self._nodes = history["contact_node"].values[self._skin]
        # A plate is drawn as such, and not as the slab that stands for it.
        regions = np.array([*str(history.attrs["regions"]).split(", "), ""])[history["cell_region"].values]
        self._is_body = regions != f"{PLATE}_slab"
        self._cells = history["cell_nodes"].values[self._is_body, : CORNERS[history.attrs["element"]]]
        self._sides = (1.0, -1.0) if held.opposite == "mirror" else (1.0,)
        self._surface = float(history["node_position"].values[self._nodes, 1].min())
        self._object = Rectangle((-_HALF_WIDTH, 0.0), 2 * _HALF_WIDTH, _LENGTH, facecolor="#d9d9d9", edgecolor=BLACK)
        axes.add_patch(self._object)
        if held.opposite == "plate":
            corner = -_HALF_WIDTH - _PLATE_WIDTH, -0.5 * _LENGTH
            axes.add_patch(Rectangle(corner, _PLATE_WIDTH, _LENGTH, facecolor="#8c8c8c", edgecolor=BLACK))
        self._bodies = [PolyCollection([], edgecolors="none", antialiaseds=False, zorder=3) for _ in self._sides]
        self._skins = [axes.scatter([], [], s=14.0, zorder=4, edgecolors="none") for _ in self._sides]
        for body in self._bodies:
            axes.add_collection(body)
        look: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 14.0, "linewidth": 2.0}
        look |= {"shrinkA": 0.0, "shrinkB": 0.0, "zorder": 5}
        self._arrows = [FancyArrowPatch((0, 0), (0, 0), color=colour, **look) for colour in (BLACK, BLUE, BLUE)]
        for arrow in self._arrows:
            axes.add_patch(arrow)
        self._grip = axes.text(0.0, 1.0, "grip", ha="center", va="bottom", color=BLUE)
        self._load = axes.text(0.8, 0.0, "load", ha="left", va="center")
        self._words = axes.set_title("", fontsize=12.0)
        places = self._places(0)[np.unique(self._cells)]
        low, high = places.min(axis=0), places.max(axis=0)
        travel = 1e3 * held.travel_limit
        axes.set_xlim(-high[0] - 2.0 * _ROOM, high[0] + 2.0 * _ROOM)
        axes.set_ylim(min(low[1], -0.5 * _LENGTH) - 1.1 * travel, max(high[1], 0.5 * _LENGTH) + 1.0)
        axes.axhline(-0.5 * _LENGTH - travel, color=VERMILLION, linewidth=1.0, linestyle=(0, (4, 2)), zorder=1)
        axes.text(axes.get_xlim()[0], -0.5 * _LENGTH - travel, " lost", va="bottom", color=VERMILLION)
        axes.set_aspect("equal")
        axes.set_axis_off()

    def _places(self, number: int) -> Floats:
        """Return where the nodes of the right finger are drawn at a snapshot, (n, 2) [mm]: the load points down."""
        history = self.run.history
        points = history["node_position"].values + history["snapshot_displacement"].values[number]
        record = nearest_record(history, float(history["snapshot_time"].values[number]))
        surface = self._surface + float(history["rigid_body_displacement"].values[record, 0, 1])
        down = -self.run.grasp.held.direction * points[:, 0]
        return 1e3 * np.stack([points[:, 1] - surface, down], axis=1) + (_HALF_WIDTH, 0.0)

    def show(self, moment: float) -> None:
        """Show the time [s] since the load began; after the decision the last there is."""
        run, history = self.run, self.run.history
        held, time = run.grasp.held, min(moment, run.outcome.end)
        number = nearest_snapshot(history, held.begins + time)
        record = nearest_record(history, held.begins + time)
        right = self._places(number)
        stresses: Any = self._colours.to_rgba(1e-3 * history["snapshot_von_mises"].values[number, self._is_body])
        states = history["contact_state"].values[record, self._skin]
        touching, colours = self._nodes[states != OPEN], [STATE_COLOURS[state] for state in states[states != OPEN]]
        for body, skin, side in zip(self._bodies, self._skins, self._sides, strict=True):
            places = right * (side, 1.0)
            body.set_verts(list(places[self._cells]))
            body.set_facecolor(stresses)
            skin.set_offsets(places[touching])
            skin.set_facecolor(colours)
        first = round(held.begins / held.step)
        positions = held.direction * history["rigid_body_displacement"].values[:, 0, 0]
        travel = 1e3 * float(positions[record] - positions[first])
        middle = -travel
        self._object.set_y(middle - 0.5 * _LENGTH)
        load, grip = held.total_load(time) / held.first_load, run.force(time) / held.first_grip
        self._arrows[0].set_positions((0.0, middle), (0.0, middle - _ARROW * load))
        self._load.set_y(middle - 0.5 * _ARROW * load)
        outside = right[self._cells, 0].max() + 1.0
        self._grip.set_x(outside + 0.5 * _ARROW * grip)
        for arrow, side in zip(self._arrows[1:], (1.0, -1.0), strict=True):
            tip = side * outside if side in self._sides else side * (_HALF_WIDTH + _PLATE_WIDTH + 1.0)
            arrow.set_positions((tip + side * _ARROW * grip, 0.0), (tip, 0.0))
        decided = f": {'saved' if run.outcome.saved else 'lost'}" if moment >= run.outcome.end else ""
        self._words.set_text(f"{run.name}{decided}\n{1e3 * time:.0f} ms, travel {max(travel, 0.0):.1f} mm")
        self._now.set_xdata([1e3 * time] * 2)
