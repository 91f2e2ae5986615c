"""What a viewer can change in a scene, the same in a window and in a browser; and the signals of a picked node."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingerslip.history import nearest_snapshot, site_kinds
from fingerslip.report.colours import BLUE, GREEN, RECEPTOR_COLOURS, VERMILLION
from fingerslip.report.figures.marks import event_keys, happened, mark_run
from fingerslip.report.figures.style import add_legend, figure_grid, styled
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import aim, draw_scene, region_names
from fingerslip.slip import Events

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["SceneControl", "nearest_node", "picked_figure", "receptor_legend"]

Floats = NDArray[np.float64]


class SceneControl:
    """A scene that is drawn anew when something of it is changed.

    Units: time [s].
    """

    def __init__(self, plotter: Any, history: xr.Dataset, options: SceneOptions, time: float | None = None) -> None:
        self.plotter, self.history, self.options = plotter, history, options
        self.number = nearest_snapshot(history, time)
        self.plotter.set_background("white")
        self.draw()
        aim(plotter, history, options)

    def draw(self) -> None:
        """Draw the snapshot."""
        draw_scene(self.plotter, self.history, self.number, self.options)

    def show(self, time: float) -> None:
        """Show the snapshot nearest to a time [s]."""
        self.number = nearest_snapshot(self.history, time)
        self.draw()

    def choose(self, **values: Any) -> None:
        """Change options by name, such as the field, the cut or what is drawn."""
        self.options = dataclasses.replace(self.options, **values)
        self._clear()
        self.draw()
        if "camera" in values:
            aim(self.plotter, self.history, self.options)

    def toggle(self, region: str, visible: bool) -> None:
        """Show or hide a layer; at least one stays."""
        hidden = {*self.options.hidden, region} if not visible else {*self.options.hidden} - {region}
        shown = [name for name in region_names(self.history) if name not in hidden]
        if shown:
            self.choose(hidden=tuple(sorted(hidden)))

    def _clear(self) -> None:
        """Remove what the options decide, bars of colours included."""
        for name in list(self.plotter.actors):
            if name.split(" ")[0] in {"layer", "plate", "arrow", "sites", "contact", "time"}:
                self.plotter.remove_actor(name, render=False)
        for title in list(self.plotter.scalar_bars.keys()):
            self.plotter.remove_scalar_bar(title, render=False)


def nearest_node(history: xr.Dataset, number: int, point: Floats) -> int:
    """Return the node of the mesh nearest to a point of the scene.

    Arrays: point (3,) [mm].
    """
    positions = 1e3 * (history["node_position"].values + history["snapshot_displacement"].values[number])
    return int(np.linalg.norm(positions - np.asarray(point)[: positions.shape[1]], axis=1).argmin())


@styled
def picked_figure(history: xr.Dataset, node: int, events: Events | None = None) -> Figure:
    """Draw what a node does over the snapshots: displacement by components, and von Mises stress around it."""
    times = history["snapshot_time"].values
    place = ", ".join(f"{value:.2f}" for value in 1e3 * history["node_position"].values[node])
    title = f"Node {node} at ({place}) mm"
    figure, (above, below) = figure_grid(2, 1, (4.6, 1.7), title, ("time [s]", ""), share="x")
    moved = 1e3 * history["snapshot_displacement"].values[:, node]
    for component, values, colour in zip("xyz", moved.T, (BLUE, VERMILLION, GREEN), strict=False):
        above.plot(times, values, color=colour, label=component)
    above.set_ylabel("displacement [mm]")
    above.legend(loc="upper left", ncols=3)
    around = (history["cell_nodes"].values == node).any(axis=1)
    factor = SCALARS["von_mises"][1]
    below.plot(times, factor * history["snapshot_von_mises"].values[:, around].mean(axis=1), color=BLUE)
    below.set_ylabel("von Mises stress [kPa]")
    below.set_ylim(bottom=0.0)
    for axes in (above, below):
        mark_run(axes, history, events.slip if events else None)
    add_legend(figure, event_keys(happened([events.slip] if events else ())))
    return figure


def receptor_legend(history: xr.Dataset) -> list[tuple[str, str]]:
    """Return the types of recorded receptors with their colours."""
    known = dict.fromkeys(str(kind) for kind in site_kinds(history))
    return [(kind, RECEPTOR_COLOURS[kind]) for kind in RECEPTOR_COLOURS if kind in known]
