"""Time press and slide in 3D: the shipped fingertip, a fine contact, eight directions, eight friction coefficients.

Run it as it is: ``python tests/benchmarks/bench_solid.py [--nodes 34000] [--steps 300] [--cases shipped ...]``. The
cases `shipped`, `fine`, `coarse` and `eight` run on the fingertip of the preset: on the linear tetrahedra of
studies/wang2014_3d_tetrahedra.yaml, on a mesh with thousands of touching nodes, and in one and in eight directions on
that of studies/directions_3d.yaml. The others run on a stand-in of any number of nodes. Every case runs in a process of
its own, after a short run for the compiled code, so that its peak memory is its own. Below the seconds by the clock
stand those of the processor, of all threads, which say more where other programs run beside; then both as they were
before, where ``results/reference/benchmark_solid.json`` has the case. ``--write FILE`` writes such a file.
``--scale [NODES ...] --figure FILE`` tells instead how the cost of each part grows with the nodes of the stand-in.
"""

from __future__ import annotations

import multiprocessing
import resource
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rows import options_of, reference, write

# Size along the skin that can touch, size of the bulk and height up to which the skin is fine [m].
SIZES = {
    "shipped": (0.45e-3, 0.55e-3, 1.5e-3),
    "fine": (0.27e-3, 1.3e-3, 3e-3),
    "coarse": (0.6e-3, 1.3e-3, 1.5e-3),
    "eight": (0.6e-3, 1.3e-3, 1.5e-3),
}
CASES = (*SIZES, "one", "directions", "frictions", "fallback")
TOGETHER = 8
NODES = (2_000, 5_000, 12_000, 34_000, 75_000, 150_000)


@dataclass(frozen=True)
class Case:
    name: str
    nodes: int
    steps: int

    @property
    def is_finger(self) -> bool:
        return self.name in SIZES or not self.nodes


@dataclass(frozen=True)
class Timing:
    """What a case took: seconds of each part and of all by the clock and by the processor, and its peak memory [GB]."""

    name: str
    solver: str
    nodes: int
    degrees: int
    candidates: int
    touching: int
    mesh: float
    seconds: dict[str, float]
    processor: dict[str, float]
    peak: float

    @property
    def total(self) -> float:
        return self.seconds["all"]

    @property
    def row(self) -> str:
        """The case and its seconds by the clock, then those of the processor."""
        case = (
            f"{self.name:<10} {self.solver:<11} {self.nodes:>7} {self.degrees:>7} {self.candidates:>5} "
            f"{self.touching:>5} {self.mesh:>6.1f}"
        )
        return f"{case} {split(self.seconds)} {self.peak:>6.2f}\n{'processor':>{len(case)}} {split(self.processor)}"


def split(seconds: dict[str, float]) -> str:
    return " ".join(f"{seconds[name]:>7.2f}" for name in (*PARTS, "all"))


def rows_before(case: dict[str, Any] | None) -> str:
    """Return the rows of a case in the reference, empty without."""
    if case is None:
        return ""
    width = len(HEADER.partition(" assem.")[0])
    seconds, processor = (split(case[kind]) for kind in ("seconds", "processor"))
    return f"{'before':>{width}} {seconds} {case['peak']:>6.2f}\n{'processor':>{width}} {processor}\n"


PARTS = ("assembly", "factorisation", "stepping", "substitution", "contact", "recording")
HEADER = (
    f"{'case':<10} {'solver':<11} {'nodes':>7} {'dof':>7} {'cand.':>5} {'touch':>5} {'mesh':>6} {'assem.':>7} "
    f"{'factor':>7} {'steps':>7} {'subst.':>7} {'contact':>7} {'record':>7} {'all':>7} {'GB':>6}"
)


def models(case: Case, mesh, steps: int):
    from models import model

    integration = "nodal" if case.name in {"coarse", "eight"} else "selective"
    if case.name in {"directions", "eight"}:
        angles = 2 * np.pi * np.arange(TOGETHER) / TOGETHER
        return [model(mesh, steps=steps, direction=angle, integration=integration) for angle in angles]
    if case.name == "frictions":
        return [model(mesh, steps=steps, friction=0.2 + 0.1 * k) for k in range(TOGETHER)]
    return [model(mesh, steps=steps, integration=integration)]


def measure(case: Case) -> Timing:
    """Simulate a small pad for the compiled code, then the one that is asked for."""
    from models import finger_mesh, pad_mesh

    import fingerslip as fs
    from fingerslip.linear.solvers.superlu import SuperLU

    solver = SuperLU() if case.name == "fallback" else None
    fs.simulate_together(models(case, pad_mesh(12_000), 5), solver=solver)
    start = time.perf_counter()
    mesh = finger_mesh(*SIZES.get(case.name, SIZES["shipped"])) if case.is_finger else pad_mesh(case.nodes)
    meshed = time.perf_counter() - start
    given = models(case, mesh, case.steps)
    start, processor = time.perf_counter(), time.process_time()
    history = fs.simulate_together(given, solver=solver)[0]
    total, processor = time.perf_counter() - start, time.process_time() - processor
    known = history.attrs
    return Timing(
        name=case.name,
        solver=known["linear_solver"],
        nodes=known["n_nodes"],
        degrees=known["n_degrees_of_freedom"],
        candidates=known["n_contact_candidates"],
        touching=int((history.contact_state.values > 0).sum(axis=1).max()),
        mesh=meshed,
        seconds={name: known[f"seconds_{name}"] for name in PARTS} | {"all": total},
        processor={name: known[f"cpu_seconds_{name}"] for name in PARTS} | {"all": processor},
        peak=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2,
    )


LABELS = {
    "assembly": "assembly",
    "factorisation": "factorisation and condensation",
    "substitution": "substitutions",
    "contact": "contact",
    "recording": "energies and recording",
}


def exponent(nodes: np.ndarray, seconds: np.ndarray) -> float:
    """Return the slope in the log-log plot."""
    return float(np.polyfit(np.log(nodes), np.log(seconds), 1)[0])


def draw(nodes: np.ndarray, costs: dict[str, np.ndarray], steps: int, file: Path) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(6.3, 4.2), layout="constrained")
    for (name, values), marker in zip(costs.items(), "osD^vP", strict=False):
        label = f"{LABELS.get(name, name)}: {exponent(nodes, values):.2f}"
        axes.loglog(nodes, values, marker=marker, markersize=4, linewidth=1.2, label=label)
    axes.set(xlabel="nodes", ylabel=f"seconds ({steps} steps) or GB")
    axes.grid(which="both", linewidth=0.3)
    axes.legend(title="part: exponent", fontsize=8)
    figure.savefig(file, dpi=150)


def grow(timings: list[Timing], steps: int, figure: Path | None) -> None:
    """Print how the cost of each part grows with the nodes, and draw it where a file is given."""
    nodes = np.array([timing.nodes for timing in timings], dtype=float)
    costs = {name: np.array([timing.seconds[name] for timing in timings]) for name in PARTS if name != "stepping"}
    costs["peak memory [GB]"] = np.array([timing.peak for timing in timings])
    for name, values in costs.items():
        sys.stdout.write(f"{LABELS.get(name, name):<32} grows like nodes^{exponent(nodes, values):.2f}\n")
    if figure:
        draw(nodes, costs, steps, figure)


def main() -> None:
    parser = options_of(__doc__, writes=True)
    parser.add_argument("--nodes", type=int, default=34_000, help="of the stand-in; 0 for the shipped mesh")
    parser.add_argument("--steps", type=int, default=300, help="steps of 5 ms; the first 100 press")
    parser.add_argument("--cases", choices=CASES, nargs="+", default=list(SIZES))
    parser.add_argument("--scale", type=int, nargs="*", metavar="NODES", help="how costs grow with nodes instead")
    parser.add_argument("--figure", type=Path, help="of the costs over the nodes")
    options = parser.parse_args()
    names = [("one", nodes) for nodes in options.scale or NODES] if options.scale is not None else None
    cases = [Case(*case, options.steps) for case in names or [(name, options.nodes) for name in options.cases]]
    before, timings = reference("benchmark_solid"), []
    sys.stdout.write(HEADER + "\n")
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for timing in pool.imap(measure, cases):
            timings.append(timing)
            sys.stdout.write(timing.row + "\n" + ("" if names else rows_before(before.get(timing.name))))
            sys.stdout.flush()
    if names:
        grow(timings, options.steps, options.figure)
    else:
        write(options.write, {timing.name: asdict(timing) for timing in timings})


if __name__ == "__main__":
    main()
