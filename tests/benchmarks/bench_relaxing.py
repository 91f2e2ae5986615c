"""What Prony terms cost: pushes of a fingertip whose soft layers relax by three terms, and of the elastic one.

Both run in turns in one process, several times; the ratio of the shortest times counts. Run it with nothing beside it.

    python tests/benchmarks/bench_relaxing.py [--solid] [--plane-strain] [--repeat 5]
    python tests/benchmarks/bench_relaxing.py --shipped [--repeat 1] [--end 0.2]

The latter takes the fingertip of studies/viscoelastic_3d.yaml at 5 mm/s, with and without the terms of its pulp.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import time
from pathlib import Path

import fingerslip as fs
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.running.build import build_mesh, build_model

SHIPPED = Path(__file__).parents[2] / "studies" / "viscoelastic_3d.yaml"
TERMS = (fs.PronyTerm(0.3, 0.02), fs.PronyTerm(0.2, 0.2), fs.PronyTerm(0.2, 2.0))


def model(solid: bool, formulation: str | None, terms: tuple[fs.PronyTerm, ...]) -> fs.Model:
    """Return a push and slide of the fingertip of a preset."""
    finger = fs.preset("wang2014-3d" if solid else "wang2014-2d")
    mesh = fs.SolidSizes("T4", 0.45e-3, 0.55e-3).build(finger) if solid else fs.build_section(finger)
    materials = {
        name: own if name == "phalanx" else dataclasses.replace(own, prony=terms)
        for name, own in finger.materials.items()
    }
    normal = (0.0, 1.0, 0.0) if solid else (0.0, 1.0)
    return fs.Model(
        mesh=mesh,
        materials=materials,
        formulation="solid" if solid else formulation or finger.formulation,
        depth=1.0 if solid else finger.depth,
        supports={"phalanx": ("x", "y", "z") if solid else ("x", "y")},
        contacts=(fs.Contact("skin", fs.Plane(normal), fs.Coulomb(0.6)),),
        programme=(fs.Press(1.5e-3, 3e-3), fs.Slide(1.5e-3 if solid else 6e-3, 3e-3)),
        time=fs.TimeStepping(5e-3),
        integration="nodal" if solid else "selective",
    )


def shipped() -> dict[str, fs.Model]:
    """Return the runs of the shipped study at 5 mm/s: elastic with the modulus at once, and relaxing."""
    runs = {run.name: run for run in read_runs(SHIPPED).runs}
    names = {"elastic": "pulp-relaxing-prony-none", "relaxing": "pulp-relaxing"}
    mesh = build_mesh(next(iter(runs.values())))
    return {
        words: build_model(runs[f"tissue-preset-{name}_speed-5mm-per-s_step-5ms"], mesh)
        for words, name in names.items()
    }


def timed(one: fs.Model) -> tuple[float, float, float, float]:
    """Return seconds by the clock and of all cores: of everything, and of the time steps alone."""
    start, cpu = time.perf_counter(), time.process_time()
    history = fs.simulate(one)
    stepping = history.attrs["seconds_stepping"], history.attrs["cpu_seconds_stepping"]
    return time.perf_counter() - start, time.process_time() - cpu, *stepping


def main() -> None:
    """Print the times and their ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--solid", action="store_true")
    parser.add_argument("--plane-strain", action="store_true")
    parser.add_argument("--shipped", action="store_true")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--end", type=float, help="end of the runs [s]")
    given = parser.parse_args()
    formulation = "plane_strain" if given.plane_strain else None
    cases = (("elastic", ()), ("relaxing", TERMS))
    models = shipped() if given.shipped else {name: model(given.solid, formulation, terms) for name, terms in cases}
    if given.end:
        models = {
            name: dataclasses.replace(one, time=dataclasses.replace(one.time, end=given.end))
            for name, one in models.items()
        }
    times: dict[str, list[tuple[float, float, float, float]]] = {name: [] for name in models}
    for _ in range(given.repeat):
        for name, one in models.items():
            times[name].append(timed(one))
    shortest = {name: [min(column) for column in zip(*own, strict=True)] for name, own in times.items()}
    lines = [f"{'':10}{'all, clock':>14}{'all, cores':>14}{'steps, clock':>14}{'steps, cores':>14}"]
    lines += [f"{name:10}" + "".join(f"{value:12.2f} s" for value in own) for name, own in shortest.items()]
    lines.append("ratio     " + "".join(f"{b / a:14.3f}" for a, b in zip(*shortest.values(), strict=True)))
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
