"""What slides of the sensor cost, and how much they depend on the mesh in 3D; the tables of docs/tactip.md.

    OMP_NUM_THREADS=1 python tests/benchmarks/bench_sensor.py [--cases section meshes] [--sizes coarse shipped fine]
                                                              [--depths 2 3] [--deepest 3]

`section` is the slide of 47 s in 2D. `meshes` slides the ridged half in 3D over 14 mm on meshes of which all
sizes have a common factor, with the surface in patches of one size; memory is that of the largest so far.
"""

from __future__ import annotations

import dataclasses
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rows import line, options_of, table

import fingerslip as fs
from fingerslip.dynamics.statics.body import StaticBody, static_body
from fingerslip.dynamics.statics.motion import static_motion
from fingerslip.linear.resources import limited_threads
from fingerslip.specimens.tactip.meshing.sources import SensorSolidSizes
from fingerslip.specimens.tactip.sites import modelled_places
from fingerslip.study.definition.runs import Run, read_runs
from fingerslip.study.running.build import build_mesh, build_model

STUDIES = Path(__file__).parents[2] / "studies"
#: Sizes at the contact, in the gel and at rods [mm].
SIZES = {"coarse": (1.5, 4.0, 0.5), "shipped": (1.0, 3.0, 0.35), "fine": (0.75, 2.2, 0.25)}
PATCH, HIDDEN = 0.8e-3, 1e-3
TRAVELS = (0.5e-3, 1e-3, 2e-3)
# Distance over which a ring has slipped, and over which the centre has: 2 px and 1 px of 0.07 mm.
SLIPPED = (0.07e-3, 0.14e-3)


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Return what a call gives, and its processor seconds on one thread."""
    start = time.process_time()
    with limited_threads(1):
        found = work()
    return found, time.process_time() - start


def run_of(name: str) -> Run:
    return read_runs(STUDIES / name).runs[0]


def section() -> None:
    """Print what the slide in 2D costs."""
    run = run_of("tactip_slide.yaml")
    mesh, meshing = timed(lambda: build_mesh(run))
    model = build_model(run, mesh)
    model = dataclasses.replace(model, record=dataclasses.replace(model.record, snapshots_every=0.0))
    history, stepping = timed(lambda: fs.simulate(model, threads=1))
    table("nodes", "steps", "simulated [s]", "mesh [CPU s]", "stepping [CPU s]")
    line(mesh.p.shape[1], history.sizes["time"] - 1, float(history["time"][-1]), meshing, stepping)


def body_of(run: Run, sizes: tuple[float, ...], deepest: float) -> tuple[StaticBody, list[object]]:
    """Return the condensed body on a mesh, and what it cost: nodes, patches, seconds of mesh and body, memory."""
    contact, bulk, rods = (1e-3 * size for size in sizes)
    source = SensorSolidSizes(contact_size=contact, bulk_size=bulk, rod_size=rods)
    mesh, meshing = timed(lambda: source.build(run.specimen))
    model, reach = build_model(run, mesh), 1.5 * deepest
    contacts = tuple(dataclasses.replace(one, search_distance=reach) for one in model.contacts)
    model = dataclasses.replace(model, contacts=contacts)
    body, condensing = timed(lambda: static_body(model, reach=reach, hidden=HIDDEN, patch=PATCH))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return body, [mesh.p.shape[1], len(body.nodes), meshing, condensing, memory]


def slide(run: Run, body: StaticBody, depth: float) -> list[object]:
    """Return what a slide came to: forces and area of the whole sensor, markers at some travels, when they slip."""
    study = run.study
    press, hold, along = (entry.phase for entry in study.programme)
    programme = (dataclasses.replace(press, depth=depth), hold, along)
    contact = study.all_contacts[0].contact(3)
    motion, seconds = timed(lambda: static_motion(body, contact, programme, study.time.stepping.step))
    start = int(np.searchsorted(motion.time, depth / press.speed + hold.duration - 1e-9))
    elapsed = motion.time[start:] - motion.time[start]
    moved = motion.displacement[start:] - motion.displacement[start]
    places = modelled_places(run.specimen)
    count, weight = len(places.ring), np.where(places.on_plane(run.specimen.markers.spacing), 1.0, 2.0)
    left = (moved[:, count:] - (motion.counterface[start:] - motion.counterface[start])[:, None])[..., [0, 2]]
    away = np.linalg.norm(left, axis=2)
    slips = [_when(elapsed, away[:, 0], SLIPPED[0])]
    ring = places.ring == 1
    slips.append(_when(elapsed, away[:, ring] @ weight[ring] / weight[ring].sum(), SLIPPED[1]))
    rows = np.searchsorted(along.speed * elapsed, np.array(TRAVELS) - 1e-9)
    force = 2.0 * motion.force[start:]
    outer = places.ring == places.ring.max()
    share = 1e3 * weight[outer] / weight[outer].sum()
    markers = [[1e3 * moved[row, 0, 0], share @ moved[row, :count][outer, 0]] for row in rows]
    area = 2e6 * float(motion.contact_area[start])
    return [1e3 * depth, force[0, 1], force[:, 0].max(), area, *np.ravel(markers).tolist(), slips[1], slips[0], seconds]


def _when(times: np.ndarray, values: np.ndarray, limit: float) -> float:
    over = np.flatnonzero(values > limit)
    return float(times[over[0]]) if over.size else float("nan")


def meshes(names: list[str], depths: list[float], deepest: float) -> None:
    """Print the slides on all meshes, and what these cost."""
    run, rows = run_of("tactip_directions_3d.yaml"), []
    table("mesh", "nodes", "patches", "mesh [CPU s]", "body [CPU s]", "memory [GB]")
    for name in names:
        body, cost = body_of(run, SIZES[name], 1e-3 * deepest)
        line(name, *cost)
        rows += [[name, *slide(run, body, 1e-3 * depth)] for depth in depths]
    markers = [f"{which} at {1e3 * travel:g} mm [mm]" for travel in TRAVELS for which in ("centre", "outermost")]
    forces = ["pressed by [N]", "largest friction force [N]", "area that touches [mm²]"]
    sys.stdout.write("\n")
    table("mesh", "depth [mm]", *forces, *markers, "ring 1 slips [s]", "centre slips [s]", "slide [CPU s]")
    for row in sorted(rows, key=lambda row: row[1]):
        line(*row)


def main() -> None:
    """Print the tables that are asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--cases", nargs="+", default=["section"], choices=["section", "meshes"])
    parser.add_argument("--sizes", nargs="+", default=list(SIZES), choices=list(SIZES))
    parser.add_argument("--depths", nargs="+", type=float, default=[2.0, 3.0])
    parser.add_argument("--deepest", type=float, default=3.0)
    given = parser.parse_args()
    if "section" in given.cases:
        section()
    if "meshes" in given.cases:
        meshes(given.sizes, given.depths, given.deepest)


if __name__ == "__main__":
    main()
