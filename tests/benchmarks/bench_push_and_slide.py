"""Time the push-and-slide of the paper-size section, by MKL PARDISO and by SuperLU, one thread each.

Run it as it is: ``python tests/benchmarks/bench_push_and_slide.py [--contact-size MM] [--skip SuperLU]``.
Every case runs in a process of its own, so that its peak memory is its own. The last column is the share of
stepping that is neither substitution nor contact nor recording: what the time integration itself costs.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import sys
import time
from dataclasses import dataclass

SOLVERS = ("MKL PARDISO", "SuperLU")
# Press by 1.5 mm at 1.5 mm/s, slide by 6 mm at 3 mm/s: 3 s, so 600 steps of 5 ms and 3000 of 1 ms.
STEPS = (5e-3, 1e-3)


@dataclass(frozen=True)
class Case:
    solver: str
    step: float
    contact_size: float


@dataclass(frozen=True)
class Timing:
    case: Case
    nodes: int
    candidates: int
    steps: int
    total: float
    setup: float
    parts: dict[str, float]
    peak_memory: float
    overall_force_ratio: float

    @property
    def row(self) -> str:
        stepping = self.parts["stepping"]
        each = {name: 1e3 * self.parts[name] / self.steps for name in ("substitution", "contact", "recording")}
        rest = 1e3 * stepping / self.steps - sum(each.values())
        return (
            f"{self.case.solver:<12} {1e3 * self.case.step:>5.0f} {self.steps:>6} {self.nodes:>6} {self.candidates:>5} "
            f"{self.total:>8.2f} {self.setup:>7.2f} {1e3 * stepping / self.steps:>8.3f} {each['substitution']:>8.3f} "
            f"{each['contact']:>8.3f} {each['recording']:>8.3f} {100 * rest * self.steps / 1e3 / stepping:>6.1f} "
            f"{self.peak_memory:>7.0f} {self.overall_force_ratio:>8.5f}"
        )


HEADER = (
    f"{'solver':<12} {'ms':>5} {'steps':>6} {'nodes':>6} {'cand.':>5} {'total s':>8} {'setup s':>7} {'ms/step':>8} "
    f"{'subst.':>8} {'contact':>8} {'record':>8} {'rest %':>6} {'peak MB':>7} {'F/N':>8}"
)


def build_model(case: Case, end: float | None = None):
    import fingerslip as fs

    fingertip = fs.preset("wang2014-2d")
    return fs.Model(
        mesh=fs.build_section(fingertip, contact_size=case.contact_size),
        materials=fingertip.materials,
        formulation=fingertip.formulation,
        depth=fingertip.depth,
        supports={"phalanx": ("x", "y")},
        contacts=(fs.Contact(boundary="skin", friction=fs.Coulomb(0.6)),),
        programme=(fs.Press(1.5e-3, 1.5e-3), fs.Slide(6e-3, 3e-3)),
        time=fs.TimeStepping(case.step, end=end),
        record=fs.Recording(sites=fs.receptor_sites(fingertip)),
    )


def measure(case: Case) -> Timing:
    """Simulate once for the compiled code, then once for the clock."""
    import fingerslip as fs
    from fingerslip.linear.solver import known_solvers

    solver = next(solver for solver in known_solvers() if solver.name == case.solver)
    fs.simulate(build_model(case, end=20 * case.step), threads=1, solver=solver)
    model = build_model(case)
    start = time.perf_counter()
    history = fs.simulate(model, threads=1, solver=solver)
    total = time.perf_counter() - start
    parts = {name[8:]: value for name, value in history.attrs.items() if name.startswith("seconds_")}
    force = history.counterface_force.values[-1, 0]
    return Timing(
        case=case,
        nodes=history.attrs["n_nodes"],
        candidates=history.attrs["n_contact_candidates"],
        steps=history.sizes["time"] - 1,
        total=total,
        setup=parts["assembly"] + parts["factorisation"],
        parts=parts,
        peak_memory=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        overall_force_ratio=float(force[0] / force[1]),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--contact-size", type=float, default=0.15, help="element size on the skin [mm]")
    parser.add_argument("--skip", choices=SOLVERS, action="append", default=[], help="leave a solver out")
    options = parser.parse_args()
    cases = [
        Case(solver, step, 1e-3 * options.contact_size)
        for solver in SOLVERS
        if solver not in options.skip
        for step in STEPS
    ]
    sys.stdout.write(HEADER + "\n")
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for timing in pool.imap(measure, cases):
            sys.stdout.write(timing.row + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
