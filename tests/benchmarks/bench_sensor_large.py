"""The half sensor in 3D at large strain beside small strain, on one mesh; a table of docs/tactip.md.

    OMP_NUM_THREADS=1 python tests/benchmarks/bench_sensor_large.py [--skins smooth ridged] [--sizes 1.5 4 0.5]
        [--depth 3] [--travel 1.5] [--part 0.25] [--strains small finite]

A plate with Coulomb friction 0.85 presses the sensor and slides along its plane of symmetry, in quasi-static steps of
`--part` [mm]. Linear tetrahedra with nodal integration, as in the sections that go through at large strain. A run that
ends early says where, also by Ctrl-C, which ends it after the step; its rows until then are printed. Forces are those
of the whole sensor; the error stream has them for each step.
"""

from __future__ import annotations

import dataclasses
import signal
import sys
import time
from pathlib import Path

import numpy as np
import xarray as xr

sys.path.insert(0, str(Path(__file__).parents[1]))

from rows import line, options_of, table

import fingerslip as fs
from fingerslip.errors import FingerslipError
from fingerslip.linear.resources import limited_threads
from fingerslip.marker_tracks import marker_tracks
from fingerslip.specimens.tactip import PRESETS
from fingerslip.specimens.tactip.meshing.sources import SensorSolidSizes
from problems.sensors import pressed_sensor

SPEED = 5e-3


def model_of(skin: str, sizes: tuple[float, ...], depth: float, travel: float, part: float) -> fs.Model:
    """Return the model at small strain; lengths in m."""
    sensor = PRESETS.changed({"preset": f"tactip-{skin}-3d"})
    contact_size, bulk_size, rod_size = sizes
    mesh = SensorSolidSizes(contact_size=contact_size, bulk_size=bulk_size, rod_size=rod_size).build(sensor)
    programme = (fs.Press(depth, SPEED), fs.Slide(travel, SPEED))
    return pressed_sensor(sensor, mesh, fs.Coulomb(0.85), programme, step=part / SPEED)


def stepped(model: fs.Model) -> tuple[xr.Dataset, str, float]:
    """Return the history as far as it goes, why it ended early, and processor seconds."""
    start, why = time.process_time(), ""
    stops: list[str] = []
    # A step that is interrupted has no factors, so that one stops between steps.
    signal.signal(signal.SIGINT, lambda *_: stops.append("interrupted"))
    with limited_threads(1), fs.Simulation(model, threads=1) as sim:
        try:
            while not (sim.is_finished or stops):
                seen = sim.step()
                force = 2.0 * seen["counterface_force"][0]
                sys.stderr.write(f"{sim.time:.3f} s, {force[1]:.3f} N, {time.process_time() - start:.0f} CPU s\n")
        except FingerslipError as error:
            why = str(error)
        return sim.history(), why or "".join(stops[:1]), time.process_time() - start


def rows_of(history: xr.Dataset, depth: float, travel: float) -> list[list[float]]:
    """Return depth, travel, normal and friction force, central marker, outermost ring along x and y [mm, N]."""
    tracks = marker_tracks(history, ("internal",))
    moved = 1e3 * (tracks["position"].values - tracks["position"].values[0])
    outer = tracks["ring"].values == tracks["ring"].values.max()
    far = outer & (np.abs(tracks["angle"].values) < 1e-6)
    force = 2.0 * history["counterface_force"].values[:, 0]
    rows = []
    for number, now in enumerate(history["time"].values):
        down, along = min(SPEED * now, depth), max(SPEED * now - depth, 0.0)
        middle, outermost = moved[number, 0], moved[number, far][0]
        values = [force[number, 1], force[number, 0], *middle[:2], *outermost[:2]]
        if _is_told(down if along < 1e-9 else along) and along <= travel + 1e-9:
            rows.append([1e3 * down, 1e3 * along, *values])
    return rows


def _is_told(length: float) -> bool:
    """Tell whether a length is a whole number of half millimetres above none."""
    halves = length / 0.5e-3
    return round(halves) > 0 and abs(halves - round(halves)) < 1e-6


def main() -> None:
    """Print the table of each skin."""
    parser = options_of(__doc__)
    parser.add_argument("--skins", nargs="+", default=["smooth", "ridged"], choices=["smooth", "ridged"])
    parser.add_argument("--sizes", nargs=3, type=float, default=[1.5, 4.0, 0.5])
    parser.add_argument("--depth", type=float, default=3.0)
    parser.add_argument("--travel", type=float, default=1.5)
    parser.add_argument("--part", type=float, default=0.25)
    parser.add_argument("--strains", nargs="+", default=["small", "finite"], choices=["small", "finite"])
    given = parser.parse_args()
    depth, travel, part = (1e-3 * value for value in (given.depth, given.travel, given.part))
    forces = ("normal force [N]", "friction force [N]")
    markers = ("centre x [mm]", "centre up [mm]", "outermost x [mm]", "outermost up [mm]")
    table("skin", "strain", "depth [mm]", "travel [mm]", *forces, *markers)
    for skin in given.skins:
        model = model_of(skin, tuple(1e-3 * size for size in given.sizes), depth, travel, part)
        for strain in given.strains:
            history, why, seconds = stepped(dataclasses.replace(model, kinematics=strain))
            for row in rows_of(history, depth, travel):
                line(skin, strain, *row)
            cost = {name: history.attrs.get(name) for name in ("newton_iterations", "factorisations", "halved_steps")}
            ended = f"ended early: {why}" if why else "went through"
            sys.stdout.write(f"{model.mesh.p.shape[1]} nodes, {seconds:.0f} CPU s, {cost}, {ended}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
