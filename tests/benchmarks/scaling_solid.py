"""How the cost of a press and slide in 3D grows with the mesh: table, fitted exponents and a log-log figure.

Run it as it is: ``python tests/benchmarks/scaling_solid.py [--nodes 2000 5000 ...] [--figure FILE]``. Seconds of
stepping are for as many steps as asked for, half of them pressing.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
from pathlib import Path

import numpy as np
from bench_solid import HEADER, Case, measure

NODES = (2_000, 5_000, 12_000, 34_000, 75_000, 150_000)
PARTS = ("assembly", "factorisation", "substitution", "contact", "recording")
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, nargs="+", default=list(NODES))
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--figure", type=Path, default=None)
    options = parser.parse_args()
    sys.stdout.write(HEADER + "\n")
    timings = []
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for timing in pool.imap(measure, [Case("one", nodes, options.steps) for nodes in options.nodes]):
            timings.append(timing)
            sys.stdout.write(timing.row + "\n")
            sys.stdout.flush()
    nodes = np.array([timing.nodes for timing in timings], dtype=float)
    costs = {name: np.array([timing.seconds[name] for timing in timings]) for name in PARTS}
    costs["peak memory [GB]"] = np.array([timing.peak for timing in timings])
    for name, values in costs.items():
        sys.stdout.write(f"{LABELS.get(name, name):<32} grows like nodes^{exponent(nodes, values):.2f}\n")
    if options.figure:
        draw(nodes, costs, options.steps, options.figure)


if __name__ == "__main__":
    main()
