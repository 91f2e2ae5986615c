"""Draw the figures of docs/tactip.md.

First: fingerslip run studies/tactip_slide.yaml studies/ridged_vs_smooth.yaml studies/tactip_gate_3d.yaml
and: fingerslip run studies/gel_slide.yaml
Then: python docs/figures/tactip_figures.py [RESULTS]
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pyvista
import xarray as xr
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.history import nearest_snapshot, phase_times, read_history
from fingerslip.marker_tracks import marker_tracks
from fingerslip.report.colours import BLUE
from fingerslip.report.figures.markers import ring_colours
from fingerslip.report.figures.style import add_legend, figure_grid, save_figure, with_style
from fingerslip.specimens.choice import presets_of
from fingerslip.specimens.tactip.tactip import SensorSectionSizes, SensorSolidSizes

HERE = Path(__file__).parent
COLOURS = {"skin": "#4a4a4a", "gel": "#cfe6f5", "rods": "#f4f1e6", "window": "#d9d9d9"}
DEPTHS = (2, 3, 4, 5)
# Slip travel at which the central pin of two real smooth sensors saturates, by nominal depth, both in mm.
REAL = {"sensor A": {1.0: 0.3, 2.0: 0.9, 3.0: 2.25}, "sensor B": {1.0: 0.95, 2.0: 0.65, 3.0: 1.0}}


def main() -> None:
    """Draw all figures; those of meshes need no results."""
    results = Path(sys.argv[1] if len(sys.argv) > 1 else "results")
    draw_sections()
    draw_states(read_history(results / "tactip_slide" / "run" / "history.nc"))
    draw_tracks(results / "ridged_vs_smooth")
    draw_gate(results / "tactip_gate_3d")
    draw_solid()
    save_figure(gel_figure(read_history(results / "gel_slide" / "run" / "history.nc")), HERE / "gel-slide.png")


def cells(axes: plt.Axes, points: np.ndarray, corners: np.ndarray, colour: str, edge: float) -> None:
    """Fill the cells of a region; lengths in mm."""
    axes.add_collection(PolyCollection(1e3 * points[corners], facecolor=colour, edgecolor="k", linewidth=edge))


def level(axes: plt.Axes, title: str) -> None:
    """Give a picture of a section its title and equal scales."""
    axes.autoscale()
    axes.set_aspect("equal")
    axes.set_title(title)
    axes.set_xlabel("x [mm]")


def draw_sections() -> None:
    """Draw the meshes of both sections."""
    figure, both = plt.subplots(1, 2, figsize=(12, 5.2), sharey=True, layout="constrained")
    for axes, kind in zip(both, ("ridged", "smooth"), strict=True):
        sensor = presets_of(f"tactip-{kind}-2d").read(f"tactip-{kind}-2d")
        mesh = SensorSectionSizes(contact_size=0.4e-3, bulk_size=1.6e-3).build(sensor)
        for name, colour in COLOURS.items():
            cells(axes, mesh.p.T, mesh.t[:, mesh.subdomains[name]].T, colour, 0.25)
        level(axes, f"{kind}: {mesh.p.shape[1]} nodes")
        axes.set_xlim(-21.0, 21.0)
    both[0].set_ylabel("y [mm]")
    figure.savefig(HERE / "tactip-section.png", dpi=110)


def draw_states(history: xr.Dataset) -> None:
    """Draw the section at rest, pressed, before the first slip and at the end."""
    start, end = phase_times(history, "slide")[0]
    friction = history["counterface_force"].values[:, 0, 0]
    largest = float(history["time"].values[friction.argmax()])
    moments = {"at rest": 0.0, "pressed": start, "largest friction": largest, "end of the slide": end}
    names = [str(name) for name in history.attrs["regions"].split(", ")]
    figure, axes = plt.subplots(1, 4, figsize=(15, 4.2), sharey=True, layout="constrained")
    for one, (title, moment) in zip(axes, moments.items(), strict=True):
        row = nearest_snapshot(history, moment)
        points = history["node_position"].values + history["snapshot_displacement"].values[row]
        for number, name in enumerate(names):
            own = history["cell_nodes"].values[history["cell_region"].values == number]
            cells(one, points, own, COLOURS[name], 0.05)
        plate = history["counterface_displacement"].values[
            np.abs(history["time"].values - float(history["snapshot_time"].values[row])).argmin(), 0
        ]
        one.axhline(1e3 * plate[1], color="#d55e00", linewidth=1.5)
        level(one, f"{title}, {float(history['snapshot_time'].values[row]):.1f} s")
        one.set(xlim=(-19.0, 21.0), ylim=(-1.5, 24.0))
    axes[0].set_ylabel("y [mm]")
    figure.savefig(HERE / "tactip-states.png", dpi=110)


def ring_lines(axes: plt.Axes, history: xr.Dataset) -> None:
    """Draw the displacement of internal markers along x in the slide, coloured by ring."""
    tracks = marker_tracks(history, ("internal",))
    start, end = phase_times(history, "slide")[0]
    slide = (tracks["time"].values >= start - 1e-9) & (tracks["time"].values <= end + 1e-9)
    x = 1e3 * tracks["position"].values[slide, :, 0]
    rings = tracks["ring"].values
    colours = ring_colours(np.arange(int(rings.max()) + 1))
    for number, ring in enumerate(rings):
        name = f"ring {ring}" if ring else "centre"
        label = name if number == np.flatnonzero(rings == ring)[0] else None
        style = "-" if tracks["position"].values[0, number, 0] >= 0 else "--"
        travel = 0.3 * (tracks["time"].values[slide] - start)
        axes.plot(travel, x[:, number] - x[0, number], style, color=colours[ring], label=label, linewidth=1)


def draw_tracks(folder: Path) -> None:
    """Draw the markers of both skins at all indentations."""
    figure, axes = plt.subplots(2, 4, figsize=(15, 6.4), sharex=True, sharey="row", layout="constrained")
    for row, (kind, flag) in enumerate((("ridged", "true"), ("smooth", "false"))):
        for column, depth in enumerate(DEPTHS):
            name = next(folder.glob(f"*{flag}*depth-{depth}mm"))
            ring_lines(axes[row, column], read_history(name / "history.nc"))
            axes[row, column].set_title(f"{kind}, {depth} mm deep")
    for one in axes[1]:
        one.set_xlabel("travel of the plate [mm]")
    for one in axes[:, 0]:
        one.set_ylabel("displacement along x [mm]")
    axes[0, 0].legend(fontsize=8)
    figure.savefig(HERE / "tactip-tracks.png", dpi=110)


def central_pin(folder: Path) -> dict[float, tuple[np.ndarray, np.ndarray]]:
    """Return travel of the plate and of the central pin in the slide [mm], by depth [mm]."""
    found = {}
    for path in sorted(folder.glob("*/history.nc")):
        history = read_history(path)
        tracks = marker_tracks(history, ("internal",))
        start, _ = phase_times(history, "slide")[0]
        centre = int(np.flatnonzero(tracks["ring"].values == 0)[0])
        rows = tracks["time"].values >= start - 1e-9
        plate = 1e3 * history["counterface_displacement"].values[rows, 0]
        x = 1e3 * tracks["position"].values[rows, centre, 0]
        found[float(np.round(plate[0, 1], 3))] = (plate[:, 0] - plate[0, 0], x - x[0])
    return found


def saturation(travel: np.ndarray, pin: np.ndarray) -> float:
    """Return the travel of the plate at which the pin has 95 % of its largest displacement [mm]."""
    return float(np.interp(0.95 * pin.max(), np.maximum.accumulate(pin), travel))


def draw_gate(folder: Path) -> None:
    """Draw the displacement of the central pin of the smooth sensor in 3D, and where it saturates."""
    save_figure(gate_figure(central_pin(folder)), HERE / "tactip-gate.png")


@with_style
def gate_figure(pins: dict[float, tuple[np.ndarray, np.ndarray]]) -> Figure:
    """Return the figure for the travel and the displacement of the pin [mm], by depth [mm]."""
    labels = ("travel of the plate [mm]", "displacement of the central pin [mm]")
    title = "Central pin of the smooth sensor"
    figure, (left, right) = figure_grid(2, 2, (4.2, 3.2), title, labels, share="none")
    keys = {}
    for (depth, (travel, pin)), colour in zip(pins.items(), ring_colours(np.arange(len(pins))), strict=True):
        (keys[f"{depth:g} mm deep"],) = left.plot(travel, pin, color=colour)
    for (name, real), look in zip(REAL.items(), ("ks", "k^"), strict=True):
        (keys[f"real smooth {name}"],) = right.plot(list(real), list(real.values()), look)
    travels = [saturation(*pin) for pin in pins.values()]
    (keys["simulated, 95 % of the end"],) = right.plot(list(pins), travels, "o-", color=BLUE)
    right.set_xlabel("depth [mm]")
    right.set_ylabel("travel at saturation [mm]")
    right.set_ylim(bottom=0.0)
    add_legend(figure, keys)
    return figure


@with_style
def gel_figure(history: xr.Dataset) -> Figure:
    """Draw where the markers of the flat gel went when pressed and when sheared, and their displacement over travel."""
    tracks, start = marker_tracks(history), phase_times(history, "slide")[0][0]
    positions, begin = 1e3 * tracks["position"].values, int(np.searchsorted(history["time"], start))
    travel = 1e3 * history["counterface_displacement"].values[begin:, 0, 0]
    end = begin + int(np.searchsorted(travel, 0.9 - 1e-9))
    colours = ring_colours(np.arange(int(tracks["ring"].max()) + 1))
    shades = [colours[ring] for ring in tracks["ring"].values]
    figure, panels = figure_grid(3, 3, (2.9, 2.8), "", ("x [mm]", ""), share="none", widths=(1.2, 1.2, 1.0))
    fields = {
        "pressed by 0.7 mm, arrows 20 times as long": (begin, 20),
        "slid by 0.9 mm, arrows twice as long": (end, 2),
    }
    x, z = positions[0][:, [0, 2]].T
    for axes, (title, (row, factor)) in zip(panels, fields.items(), strict=False):
        along, across = factor * (positions[row] - positions[0])[:, [0, 2]].T
        axes.scatter(x, z, s=5, c=shades)
        axes.quiver(x, z, along, across, color=shades, angles="xy", scale_units="xy", scale=1.0, width=0.006)
        axes.set_aspect("equal")
        axes.set(title=title, ylabel="z [mm]", xlim=(-9.3, 9.3), ylim=(7.0, -7.0))
    for marker in np.flatnonzero(np.abs(z) < 1e-9):
        panels[2].plot(travel, (positions[begin:] - positions[begin])[:, marker, 0], color=shades[marker])
    panels[2].axline((0.0, 0.0), slope=1.0, color="0.5", linestyle=":", zorder=0)
    panels[2].set(title="middle row", xlabel="travel of the ball [mm]", ylabel="since the slide began, along x [mm]")
    panels[2].set_ylim(-0.05, 1.05)
    names = ["centre", *(f"ring {ring}" for ring in range(1, len(colours))), "with the ball"]
    lines = [*(Line2D([], [], color=colour) for colour in colours), Line2D([], [], color="0.5", linestyle=":")]
    add_legend(figure, dict(zip(names, lines, strict=True)))
    return figure


def draw_solid() -> None:
    """Draw the ridged sensor in 3D, cut open along its plane of symmetry."""
    sensor = presets_of("tactip-ridged-3d").read("tactip-ridged-3d")
    mesh = SensorSolidSizes(contact_size=1e-3, bulk_size=3e-3).build(sensor)
    plotter = pyvista.Plotter(off_screen=True, window_size=(1100, 760))
    plotter.set_background("white")
    for name, colour in COLOURS.items():
        own = mesh.t[:, mesh.subdomains[name]].T
        grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: own}, mesh.p.T * 1e3)
        opacity = 0.25 if name == "gel" else 1.0
        plotter.add_mesh(grid, color=colour, show_edges=name != "gel", line_width=0.3, opacity=opacity)
    plotter.view_vector((0.35, -0.35, -1.0), viewup=(0.0, 1.0, 0.0))
    plotter.camera.zoom(1.3)
    plotter.screenshot(HERE / "tactip-solid.png")
    plotter.close()


if __name__ == "__main__":
    main()
