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

import multiprocessing
import resource
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rows import line, options_of, reference, table, write

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
PARTS = ("assembly", "factorisation", "stepping", "substitution", "contact", "recording", "all")
SAID = ("solver", "nodes", "degrees", "candidates", "touching", "mesh")


@dataclass(frozen=True)
class Case:
    name: str
    nodes: int
    steps: int

    @property
    def is_finger(self):
        return self.name in SIZES or not self.nodes


def models(case, mesh, steps):
    from models import model

    integration = "nodal" if case.name in {"coarse", "eight"} else "selective"
    if case.name in {"directions", "eight"}:
        angles = 2 * np.pi * np.arange(TOGETHER) / TOGETHER
        return [model(mesh, steps=steps, direction=angle, integration=integration) for angle in angles]
    if case.name == "frictions":
        return [model(mesh, steps=steps, friction=0.2 + 0.1 * k) for k in range(TOGETHER)]
    return [model(mesh, steps=steps, integration=integration)]


def measure(case):
    """Simulate a small pad for the compiled code, then the one that is asked for; peak memory is in GB."""
    from models import finger_mesh, pad_mesh

    import fingerslip as fs
    from fingerslip.linear.solvers.superlu import SuperLU

    solver = SuperLU() if case.name == "fallback" else None
    fs.simulate_together(models(case, pad_mesh(12_000), 5), solver=solver)
    start = time.perf_counter()
    mesh = finger_mesh(*SIZES.get(case.name, SIZES["shipped"])) if case.is_finger else pad_mesh(case.nodes)
    meshing = time.perf_counter() - start
    together = models(case, mesh, case.steps)
    start, processor = time.perf_counter(), time.process_time()
    history = fs.simulate_together(together, solver=solver)[0]
    total, processor = time.perf_counter() - start, time.process_time() - processor
    attrs = history.attrs
    return {
        "name": case.name,
        "solver": attrs["linear_solver"],
        "nodes": attrs["n_nodes"],
        "degrees": attrs["n_degrees_of_freedom"],
        "candidates": attrs["n_contact_candidates"],
        "touching": int((history.contact_state.values > 0).sum(axis=1).max()),
        "mesh": meshing,
        "seconds": {name: attrs[f"seconds_{name}"] for name in PARTS[:-1]} | {"all": total},
        "processor": {name: attrs[f"cpu_seconds_{name}"] for name in PARTS[:-1]} | {"all": processor},
        "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2,
    }


def rows(timing, before):
    """Print a case, its seconds by the clock and those of the processor, and both as they were before."""
    line(timing["name"], *(timing[name] for name in SAID), *timing["seconds"].values(), timing["peak"], digits=3)
    line("processor", *[""] * len(SAID), *timing["processor"].values(), "", digits=3)
    for kind, label in (("seconds", "before"), ("processor", "processor")) if before else ():
        line(label, *[""] * len(SAID), *(before[kind][part] for part in PARTS), "", digits=3)


def grow(timings, steps, figure):
    """Print how the cost of each part grows with the nodes, and draw it where a file is given."""
    from matplotlib.figure import Figure

    nodes = [timing["nodes"] for timing in timings]
    costs = {name: [timing["seconds"][name] for timing in timings] for name in PARTS if name != "stepping"}
    costs["peak memory [GB]"] = [timing["peak"] for timing in timings]
    drawing = Figure(figsize=(6.3, 4.2), layout="constrained")
    axes = drawing.add_subplot(xlabel="nodes", ylabel=f"seconds ({steps} steps) or GB")
    for (name, values), marker in zip(costs.items(), "osD^vPX", strict=True):
        exponent = np.polyfit(np.log(nodes), np.log(values), 1)[0]
        sys.stdout.write(f"{name:<32} grows like nodes^{exponent:.2f}\n")
        axes.loglog(nodes, values, marker=marker, markersize=4, linewidth=1.2, label=f"{name}: {exponent:.2f}")
    axes.grid(which="both", linewidth=0.3)
    axes.legend(title="part: exponent", fontsize=8)
    if figure:
        drawing.savefig(figure, dpi=150)


def main():
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
    table("case", *SAID, *(f"{part} [s]" for part in PARTS), "GB")
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for timing in pool.imap(measure, cases):
            timings.append(timing)
            rows(timing, None if names else before.get(timing["name"]))
    if names:
        grow(timings, options.steps, options.figure)
    else:
        write(options.write, {timing["name"]: timing for timing in timings})


if __name__ == "__main__":
    main()
