"""Draw the figures of docs/large-strain.md: the deformed finger, and what moves its slip.

python docs/figures/large_strain_figure.py [RESULTS]

Needs the results of `fingerslip converge` of studies/finite_strain.yaml, viscoelastic.yaml and viscoelastic_3d.yaml, of
the last for its run at 5 mm/s alone.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.history import nearest_record, read_history
from fingerslip.results import RunResult
from fingerslip.study.definition.runs import plan_study
from fingerslip.study.storage.store import read_convergences, read_run

ROOT = Path(__file__).parents[2]
VARIANTS = ("original", "flattened", "scaled")
KINEMATICS = {"small": "small strain", "finite": "large strain"}
TISSUE = "fingertip.materials.tissue"
EVENTS = {"incipient": ("incipient slip", "o"), "overall": ("overall slip", "s")}
BLUE, VERMILLION, GREEN, BONE = "#0072b2", "#d55e00", "#009e73", "#c9ced3"
MOST_ENERGY = 4.0  # [kJ/m^3]


def main(results: Path) -> None:
    """Draw both figures."""
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    save(finger_figure(results / "finite_strain"), "large-strain-finger.png")
    save(slip_figure(results), "large-strain-slip.png")


def save(figure: Figure, name: str) -> None:
    """Write a figure beside this script."""
    figure.savefig(Path(__file__).with_name(name), dpi=130, bbox_inches="tight")


def finger_figure(study: Path) -> Figure:
    """Draw the deformed section at the end of the press and at overall slip, small beside large strain."""
    figure = Figure(figsize=(8.2, 4.0), layout="constrained")
    colours = ScalarMappable(Normalize(0.0, MOST_ENERGY), "viridis")
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    for column, (kinematics, words) in zip(panels.T, KINEMATICS.items(), strict=True):
        folder = study / f"kinematics-{kinematics}_variant-original"
        history, overall = read_history(folder / "history.nc"), read_run(folder, {}).events.slip.overall
        for axes, name, time in zip(column, ("end of the press", "overall slip"), (1.0, overall), strict=True):
            shown = draw_section(axes, history, time, colours)
            axes.set_title(f"{words}, {name} ({shown:.2f} s)", loc="left", fontsize=9)
    for axes in panels[-1]:
        axes.set_xlabel("along the finger [mm]")
    for axes in panels[:, 0]:
        axes.set_ylabel("height [mm]")
    label = "strain energy per reference volume [kJ/m³]"
    figure.colorbar(colours, ax=panels, label=label, shrink=0.9, extend="max")
    return figure


def draw_section(axes: Axes, history: xr.Dataset, time: float, colours: ScalarMappable) -> float:
    """Draw the deformed section and the plate at the snapshot nearest to a time; return its time [s]."""
    number = int(np.abs(history["snapshot_time"].values - time).argmin())
    shown = float(history["snapshot_time"][number])
    start = 1e3 * history["node_position"].values
    points = start + 1e3 * history["snapshot_displacement"].values[number]
    paint = colours.to_rgba(1e-3 * history["snapshot_strain_energy_density"].values[number])
    names = history.attrs["regions"].split(", ")
    paint[history["cell_region"].values == names.index("phalanx")] = mpl.colors.to_rgba(BONE)
    cells = PolyCollection(points[history["cell_nodes"].values], facecolors=paint, edgecolors="face", linewidths=0.2)
    axes.add_collection(cells)
    axes.add_collection(LineCollection(start[outline(history["cell_nodes"].values)], colors="#606060", linewidths=0.7))
    record = nearest_record(history, shown)
    plate = start[:, 1].min() + 1e3 * float(history["counterface_displacement"][record, 0, 1])
    axes.axhspan(plate - 2.0, plate, color="#a8b4bd")
    axes.set(xlim=(-17.0, 9.0), ylim=(-7.4, 4.0), aspect="equal")
    return shown


def outline(cells: np.ndarray) -> np.ndarray:
    """Return the edges (n, 2) that one cell alone has."""
    edges = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    found, counts = np.unique(edges, axis=0, return_counts=True)
    return found[counts == 1]


def slip_figure(results: Path) -> Figure:
    """Draw how large strain, and the speed of the slide over pulp that relaxes, move incipient and overall slip."""
    figure = Figure(figsize=(8.2, 3.6), layout="constrained")
    phalanges, speeds = figure.subplots(1, 2)
    draw_phalanges(phalanges, runs_of(results, "finite_strain"))
    draw_speeds(speeds, runs_of(results, "viscoelastic"), BLUE, start=1.0)
    relaxing = [run for run in runs_of(results, "viscoelastic_3d") if run.swept[TISSUE] == {"preset": "pulp-relaxing"}]
    draw_speeds(speeds, relaxing, GREEN, start=0.5)
    places = [("section", BLUE), ("in 3D", GREEN)]
    speeds.legend(
        handles=[Line2D([], [], color=colour, marker="s", linestyle="", label=words) for words, colour in places],
        loc="center right",
        bbox_to_anchor=(1.0, 0.68),
        frameon=False,
    )
    keys = [(words, BLUE if name == "small" else VERMILLION, "s", "") for name, words in KINEMATICS.items()]
    keys += [
        (words, "black", marker, "black" if name == "overall" else "white") for name, (words, marker) in EVENTS.items()
    ]
    handles = [
        Line2D([], [], color=colour, marker=marker, markerfacecolor=fill or colour, linestyle="", label=words)
        for words, colour, marker, fill in keys
    ]
    figure.legend(handles=handles, loc="outside lower left", ncols=4, frameon=False)
    return figure


def runs_of(results: Path, name: str) -> tuple[RunResult, ...]:
    """Read the runs of a study with their uncertainties."""
    plan = plan_study(ROOT / "studies" / f"{name}.yaml", results)
    known = {name: each.uncertainties for name, each in read_convergences(plan.folder, plan.identities).items()}
    return tuple(read_run(plan.folder / run.name, known.get(run.name, {})) for run in plan.runs)


def draw_events(axes: Axes, run: RunResult, place: float, colour: str, shown: Callable[[float], float]) -> None:
    """Draw both events of a run with their error bars at a place, in the unit that `shown` makes of a time."""
    for event, (_, marker) in EVENTS.items():
        time, error = run.events.slip.time(event), run.uncertainty.get(f"slip.{event}")
        if time is not None:
            bar = None if error is None else shown(time + error) - shown(time)
            fill = colour if event == "overall" else "white"
            axes.errorbar(
                place, shown(time), bar, color=colour, marker=marker, markerfacecolor=fill, markersize=3.5, capsize=4
            )


def draw_phalanges(axes: Axes, runs: Sequence[RunResult]) -> None:
    """Draw the times of both events, a row of each phalanx and kinematics."""
    for run in runs:
        finite = run.swept["kinematics"] == "finite"
        place = VARIANTS.index(str(run.swept["fingertip.phalanx.variant"])) + (0.12 if finite else -0.12)
        draw_events(axes, run, place, VERMILLION if finite else BLUE, lambda time: time)
    axes.set_xticks(range(3), VARIANTS)
    axes.set(xlim=(-0.5, 2.5), xlabel="phalanx", ylabel="time from the start of the press [s]")
    axes.set_title("a  geometrical nonlinearity", loc="left", fontsize=9)


def draw_speeds(axes: Axes, runs: Sequence[RunResult], colour: str, start: float) -> None:
    """Draw the travel of the plate until both events against the speed of the slide, which starts at a time [s]."""
    for run in runs:
        speed = float(str(run.swept["programme.1.slide.speed"]).split()[0])
        draw_events(axes, run, speed, colour, lambda time, speed=speed: speed * (time - start))
    axes.set_xscale("log")
    axes.set(xlabel="speed of the slide [mm/s]", ylabel="travel of the plate until slip [mm]", ylim=(0.0, 4.2))
    axes.set_title("b  pulp that relaxes, small strain", loc="left", fontsize=9)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "results"))
