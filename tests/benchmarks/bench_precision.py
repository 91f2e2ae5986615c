"""What factors of single precision save in 3D, and what they change.

Run it as it is: ``python tests/benchmarks/bench_precision.py [--steps 300] [--coarse]``. The fingertip of
studies/wang2014_3d_tetrahedra.yaml, or of studies/directions_3d.yaml with ``--coarse``, is pressed and slid twice in
one process: with factors of double and of single precision. Seconds of the processor (all threads) and by the clock,
then the largest differences of what was recorded, as shares of the largest value, and those of the energy balance.
"""

from __future__ import annotations

import sys

import numpy as np
from bench_solid import SIZES
from rows import line, options_of
from solids import finger_mesh, model, pad_mesh

import fingerslip as fs
from fingerslip.linear.solvers.pardiso import Pardiso

PARTS = ("factorisation", "substitution", "contact", "stepping")
NAMES = ("contact_displacement", "contact_velocity", "contact_acceleration", "normal_traction", "tangential_traction")


class Exact(Pardiso):
    """MKL PARDISO, all of whose factors are of double precision."""

    def rough(self) -> Pardiso:
        return self.series()


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("--steps", type=int, default=300, help="steps of 5 ms; the first 100 press")
    parser.add_argument("--coarse", action="store_true", help="the mesh of studies/directions_3d.yaml")
    options = parser.parse_args()
    solvers = {"double": Exact(), "single": Pardiso()}
    for solver in solvers.values():
        fs.simulate(model(pad_mesh(12_000), steps=5), solver=solver)
    given = model(
        finger_mesh(*SIZES["coarse" if options.coarse else "shipped"]),
        steps=options.steps,
        integration="nodal" if options.coarse else "selective",
    )
    found = {name: fs.simulate(given, solver=solver) for name, solver in solvers.items()}
    line("factors", *(f"{part} [{unit}]" for part in PARTS for unit in ("CPU s", "s")))
    for name, own in found.items():
        line(name, *(float(own.attrs[kind + part]) for part in PARTS for kind in ("cpu_seconds_", "seconds_")))
    exact, single = found["double"], found["single"]
    sys.stdout.write(f"{exact.attrs['condensation']}; {single.attrs['condensation']}\n")
    line("recorded", "largest difference / largest value")
    for name in NAMES:
        line(name, f"{_difference(exact[name].values, single[name].values):.1e}")
    other = int((exact["contact_state"].values != single["contact_state"].values).sum())
    work = float(exact["external_work"].max())
    shares = [f"{float(np.abs(own['energy_imbalance']).max()) / work:.1e}" for own in found.values()]
    sys.stdout.write(f"states that differ: {other}; imbalance of energies over work: {' and '.join(shares)}\n")


def _difference(expected: np.ndarray, found: np.ndarray) -> float:
    return float(np.nanmax(np.abs(found - expected)) / np.nanmax(np.abs(expected)))


if __name__ == "__main__":
    main()
