"""Time a press and slide in space of paper size: one motion, eight directions, eight friction coefficients.

Run it as it is: ``python tests/benchmarks/bench_solid.py [--nodes 34000] [--steps 300] [--cases one ...]``.
Every case runs in a process of its own, after a short run for the compiled code, so that its peak memory is its
own. `cpu s` is processor time of all threads: where other programs run beside, it says more than the clock.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import sys
import time
from dataclasses import dataclass

import numpy as np

CASES = ("one", "directions", "frictions", "fallback")
TOGETHER = 8


@dataclass(frozen=True)
class Case:
    name: str
    nodes: int
    steps: int


@dataclass(frozen=True)
class Timing:
    case: Case
    solver: str
    nodes: int
    degrees: int
    candidates: int
    touching: int
    mesh: float
    seconds: dict[str, float]
    total: float
    processor: float
    peak: float

    @property
    def row(self) -> str:
        parts = [self.seconds[name] for name in PARTS]
        return (
            f"{self.case.name:<10} {self.solver:<11} {self.nodes:>7} {self.degrees:>7} {self.candidates:>5} "
            f"{self.touching:>5} {self.mesh:>6.1f} " + " ".join(f"{value:>7.2f}" for value in parts) + " "
            f"{self.total:>7.1f} {self.processor:>7.1f} {self.peak:>6.2f}"
        )


PARTS = ("assembly", "factorisation", "stepping", "substitution", "contact", "recording")
HEADER = (
    f"{'case':<10} {'solver':<11} {'nodes':>7} {'dof':>7} {'cand.':>5} {'touch':>5} {'mesh':>6} {'assem.':>7} "
    f"{'factor':>7} {'steps':>7} {'subst.':>7} {'contact':>7} {'record':>7} {'total':>7} {'cpu s':>7} {'GB':>6}"
)


def models(case: Case, mesh, steps: int):
    from solids import model

    if case.name == "directions":
        return [model(mesh, steps=steps, direction=2 * np.pi * k / TOGETHER) for k in range(TOGETHER)]
    if case.name == "frictions":
        return [model(mesh, steps=steps, friction=0.2 + 0.1 * k) for k in range(TOGETHER)]
    return [model(mesh, steps=steps)]


def measure(case: Case) -> Timing:
    """Simulate a small pad for the compiled code, then the one that is asked for."""
    from solids import finger_mesh, pad_mesh

    import fingerslip as fs
    from fingerslip.linear.solvers.superlu import SuperLU

    solver = SuperLU() if case.name == "fallback" else None
    fs.simulate_together(models(case, pad_mesh(4000), 5), solver=solver)
    start = time.perf_counter()
    mesh = pad_mesh(case.nodes) if case.nodes else finger_mesh()
    meshed = time.perf_counter() - start
    given = models(case, mesh, case.steps)
    start, processor = time.perf_counter(), time.process_time()
    history = fs.simulate_together(given, solver=solver)[0]
    total, processor = time.perf_counter() - start, time.process_time() - processor
    known = history.attrs
    return Timing(
        case=case,
        solver=known["linear_solver"],
        nodes=known["n_nodes"],
        degrees=known["n_degrees_of_freedom"],
        candidates=known["n_contact_candidates"],
        touching=int((history.contact_state.values > 0).sum(axis=1).max()),
        mesh=meshed,
        seconds={name: known[f"seconds_{name}"] for name in PARTS},
        total=total,
        processor=processor,
        peak=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, default=34_000, help="of the stand-in; 0 for the fingertip of the preset")
    parser.add_argument("--steps", type=int, default=300, help="steps of 5 ms; the first 100 press")
    parser.add_argument("--cases", choices=CASES, nargs="+", default=list(CASES))
    options = parser.parse_args()
    sys.stdout.write(HEADER + "\n")
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for timing in pool.imap(measure, [Case(name, options.nodes, options.steps) for name in options.cases]):
            sys.stdout.write(timing.row + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
