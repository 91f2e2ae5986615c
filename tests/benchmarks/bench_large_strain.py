"""What large strain costs: a run of a shipped study at small and at large strain, in turns in one process.

    python tests/benchmarks/bench_large_strain.py [--study finite_strain] [--end 0.5] [--repeat 2] [--threads 1]

Prints the time of both and their ratio; of large strain the iterations, the factorisations, the split and the memory.
"""

from __future__ import annotations

import argparse
import dataclasses
import resource
import sys
import time
from pathlib import Path

import fingerslip as fs
from fingerslip.study.definition.spec import read_study
from fingerslip.study.definition.sweep import expand
from fingerslip.study.running.build import build_mesh, build_model

PARTS = ("assembly", "bulk", "tangent", "factorisation", "substitution", "contact", "recording", "stepping")


def models(study: str, end: float | None) -> dict[str, fs.Model]:
    """Return the first run of a study at small and at large strain, perhaps cut short."""
    path = Path(__file__).parents[2] / "studies" / f"{study}.yaml"
    run = expand(read_study(path), path)[0]
    model = build_model(run, build_mesh(run))
    if end is not None:
        model = dataclasses.replace(model, time=dataclasses.replace(model.time, end=end))
    return {kind: dataclasses.replace(model, kinematics=kind) for kind in ("small", "finite")}


def main() -> None:
    """Print times, ratio, iterations and split."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--study", default="finite_strain")
    parser.add_argument("--end", type=float)
    parser.add_argument("--repeat", type=int, default=2)
    parser.add_argument("--threads", type=int)
    given = parser.parse_args()
    cores: dict[str, float] = {}
    clock: dict[str, float] = {}
    for _ in range(given.repeat):
        for kind, model in models(given.study, given.end).items():
            start, cpu = time.perf_counter(), time.process_time()
            history = fs.simulate(model, threads=given.threads)
            clock[kind] = min(clock.get(kind, float("inf")), time.perf_counter() - start)
            cores[kind] = min(cores.get(kind, float("inf")), time.process_time() - cpu)
    lines = [f"{kind:8}{clock[kind]:10.2f} s by the clock{cores[kind]:10.2f} s of all cores" for kind in cores]
    ratios = clock["finite"] / clock["small"], cores["finite"] / cores["small"]
    lines.append(f"ratio   {ratios[0]:10.2f}{ratios[1]:24.2f}")
    attributes = history.attrs
    steps = history.sizes["time"] - 1
    counts = (f"{attributes[name]} {name}" for name in ("newton_iterations", "factorisations", "halved_steps"))
    lines.append(f"{steps} steps, " + ", ".join(counts))
    lines += [f"  {part:14}{attributes.get(f'cpu_seconds_{part}', 0.0):8.2f} s of all cores" for part in PARTS]
    lines.append(f"largest memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GB")
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
