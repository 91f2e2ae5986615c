"""Time the push-and-slide of the paper-size section, by MKL PARDISO and by SuperLU, one thread each.

Run it as it is: ``python tests/benchmarks/bench_push_and_slide.py [--contact-size MM] [--skip SuperLU]``.
Every case runs in a process of its own, so that its peak memory is its own. Beside each number stands that of
``results/reference/benchmark.json``; ``--write FILE`` writes such a file. On a machine that others use, CPU seconds
tell more than those of the clock. What is neither substitution nor contact nor recording is the time integration.
"""

from __future__ import annotations

import multiprocessing
import resource
import sys
import time
from dataclasses import asdict, dataclass

from rows import options_of, reference, write

SOLVERS = ("MKL PARDISO", "SuperLU")
# Press by 1.5 mm at 1.5 mm/s, slide by 6 mm at 3 mm/s: 3 s, so 600 steps of 5 ms and 3000 of 1 ms.
STEPS = (5e-3, 1e-3)
PARTS = ("substitution", "contact", "recording")


@dataclass(frozen=True)
class Case:
    solver: str
    step: float
    contact_size: float

    @property
    def name(self) -> str:
        return f"{self.solver}, {1e3 * self.contact_size:g} mm, steps of {1e3 * self.step:g} ms"


@dataclass(frozen=True)
class Timing:
    """What a case took: seconds of set-up and all, milliseconds a step by the clock and by the CPU."""

    nodes: int
    candidates: int
    steps: int
    total: float
    setup: float
    wall: dict[str, float]
    cpu: dict[str, float]
    peak_memory: float
    overall_force_ratio: float


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
    force = history.counterface_force.values[-1, 0]
    return Timing(
        nodes=history.attrs["n_nodes"],
        candidates=history.attrs["n_contact_candidates"],
        steps=history.sizes["time"] - 1,
        total=total,
        setup=history.attrs["seconds_assembly"] + history.attrs["seconds_factorisation"],
        wall=split(history, "seconds"),
        cpu=split(history, "cpu_seconds"),
        peak_memory=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        overall_force_ratio=float(force[0] / force[1]),
    )


def split(history, kind: str) -> dict[str, float]:
    """Return the milliseconds of a step, all of it first, then by its parts."""
    steps = history.sizes["time"] - 1
    whole, *parts = (1e3 * history.attrs[f"{kind}_{name}"] / steps for name in ("stepping", *PARTS))
    return {"all": whole, **dict(zip(PARTS, parts, strict=True)), "other": whole - sum(parts)}


def report(case: Case, timing: Timing, before: dict | None) -> str:
    """Return what a case took, beside what it took before."""
    seconds = f"{timing.total:.2f} s, of which set-up {timing.setup:.2f} s"
    sizes = f"{timing.steps} steps, {timing.nodes} nodes, {timing.candidates} candidates"
    lines = [
        f"{case.name}: {sizes}; {seconds}; {timing.peak_memory:.0f} MB; F/N {timing.overall_force_ratio:.5f}",
        f"  {'ms a step':<14}{'clock':>8}{'before':>8}{'ratio':>7}{'CPU':>10}{'before':>8}{'ratio':>7}",
    ]
    for part in timing.wall:
        cells = [beside(getattr(timing, kind)[part], before and before[kind][part]) for kind in ("wall", "cpu")]
        lines.append(f"  {part:<14}{cells[0]}{cells[1]:>25}")
    return "\n".join(lines) + "\n"


def beside(now: float, before: float | None) -> str:
    return f"{now:8.3f}{before:8.3f}{now / before:7.2f}" if before else f"{now:8.3f}{'-':>8}{'-':>7}"


def main() -> None:
    parser = options_of(__doc__, writes=True)
    parser.add_argument("--contact-size", type=float, default=0.15, help="element size on the skin [mm]")
    parser.add_argument("--skip", choices=SOLVERS, action="append", default=[], help="leave a solver out")
    options = parser.parse_args()
    cases = [
        Case(solver, step, 1e-3 * options.contact_size)
        for solver in SOLVERS
        if solver not in options.skip
        for step in STEPS
    ]
    before, timings = reference("benchmark"), {}
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for case, timing in zip(cases, pool.imap(measure, cases), strict=True):
            timings[case.name] = asdict(timing)
            sys.stdout.write(report(case, timing, before.get(case.name)))
            sys.stdout.flush()
    write(options.write, timings)


if __name__ == "__main__":
    main()
