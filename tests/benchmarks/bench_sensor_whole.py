"""A whole sensor slid along x and at 45 degrees beside its half; a table of docs/tactip.md.

    OMP_NUM_THREADS=1 python tests/benchmarks/bench_sensor_whole.py [--skins ridged smooth] [--sizes 1.5 4 0.5]
        [--depth 2] [--travel 2] [--part 0.25]

Small strain, Coulomb friction 0.85, quasi-static steps of `--part` [mm]. Errors are the largest at any time, over the
largest displacement of a marker and the largest force; memory is the largest so far.
"""

from __future__ import annotations

import dataclasses
import resource
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from rows import line, options_of, table

import fingerslip as fs
from fingerslip.linear.resources import limited_threads
from fingerslip.specimens.tactip import PRESETS
from fingerslip.specimens.tactip.meshing.sources import SensorSolidSizes
from problems.whole_sensors import half_of, slid_beside_half


def main() -> None:
    """Print a row for each skin and direction."""
    parser = options_of(__doc__)
    parser.add_argument("--skins", nargs="+", default=["ridged", "smooth"], choices=["ridged", "smooth"])
    parser.add_argument("--sizes", nargs=3, type=float, default=[1.5, 4.0, 0.5])
    parser.add_argument("--depth", type=float, default=2.0)
    parser.add_argument("--travel", type=float, default=2.0)
    parser.add_argument("--part", type=float, default=0.25)
    given = parser.parse_args()
    contact, bulk, rods = (1e-3 * size for size in given.sizes)
    depth, travel, part = (1e-3 * value for value in (given.depth, given.travel, given.part))
    table("skin", "direction", "error of markers", "error of force", "friction, normal, transverse force [N]")
    for skin in given.skins:
        sensor = dataclasses.replace(PRESETS.changed({"preset": f"tactip-{skin}-3d"}), part="whole")
        start = time.process_time()
        mesh = SensorSolidSizes(contact_size=contact, bulk_size=bulk, rod_size=rods).build(sensor)
        meshing = time.process_time() - start
        with limited_threads(1):
            *slid, of_half, of_whole = slid_beside_half(
                sensor, mesh, fs.Coulomb(0.85), depth=depth, travel=travel, part=part
            )
        for name, own in zip(("along x", "at 45 degrees"), slid, strict=True):
            line(skin, name, own.markers, own.forces, ", ".join(f"{value:.4f}" for value in own.force))
        nodes = half_of(mesh).p.shape[1], mesh.p.shape[1]
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        sys.stdout.write(f"nodes {nodes[0]} of {nodes[1]}; CPU s: mesh {meshing:.0f}, half {of_half:.0f}, ")
        sys.stdout.write(f"both slides of the whole {of_whole:.0f}; {memory:.1f} GB\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
