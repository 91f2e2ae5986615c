"""What large strain costs: a run of a shipped study at small and at large strain, in turns in one process.

    python tests/benchmarks/bench_large_strain.py [--study finite_strain] [--end 0.5] [--repeat 2] [--threads 1]
        [--alone]

Prints the time of both and their ratio; of large strain the iterations, the factorisations, the split and the memory.
``--alone`` leaves out the run at small strain.
Beside each number stands that of ``results/reference/benchmark_large_strain.json``, where it has the same case;
``--write FILE`` writes the case into such a file.
"""

from __future__ import annotations

import dataclasses
import resource
import sys
import time
from pathlib import Path

from rows import options_of, reference, write

import fingerslip as fs
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.running.build import build_mesh, build_model

ROOT = Path(__file__).parents[2]
PARTS = ("assembly", "bulk", "tangent", "factorisation", "substitution", "contact", "recording", "stepping")
COUNTS = ("newton_iterations", "factorisations", "halved_steps")


def models(study: str, end: float | None) -> dict[str, fs.Model]:
    """Return the first run of a study at small and at large strain, perhaps cut short."""
    path = ROOT / "studies" / f"{study}.yaml"
    run = read_runs(path).runs[0]
    model = build_model(run, build_mesh(run))
    if end is not None:
        model = dataclasses.replace(model, time=dataclasses.replace(model.time, end=end))
    return {kind: dataclasses.replace(model, kinematics=kind) for kind in ("small", "finite")}


def measure(study: str, end: float | None, repeat: int, threads: int | None, *, alone: bool) -> dict[str, float]:
    """Return the least times of some repetitions, and what else is known of the run at large strain."""
    kinds = ("finite",) if alone else ("small", "finite")
    found: dict[str, float] = {}
    for _ in range(repeat):
        for kind in kinds:
            model = models(study, end)[kind]
            start, cpu = time.perf_counter(), time.process_time()
            history = fs.simulate(model, threads=threads)
            times = {f"{kind}, clock [s]": time.perf_counter() - start, f"{kind}, CPU [s]": time.process_time() - cpu}
            if kind == "finite":
                for clock, short in (("seconds", "clock"), ("cpu_seconds", "CPU")):
                    times |= {f"{part}, {short} [s]": history.attrs.get(f"{clock}_{part}", 0.0) for part in PARTS}
            found |= {name: min(value, found.get(name, value)) for name, value in times.items()}
    ratios = {}
    if not alone:
        ratios = {f"ratio, {own}": found[f"finite, {own} [s]"] / found[f"small, {own} [s]"] for own in ("clock", "CPU")}
    counts = {name: float(history.attrs[name]) for name in COUNTS}
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return found | ratios | counts | {"steps": float(history.sizes["time"] - 1), "largest memory [GB]": memory}


def line(name: str, now: float, before: float | None) -> str:
    """Return a number beside what it was before."""
    beside = f"{before:12.2f}{now / before:8.2f}" if before else f"{'-':>12}{'-':>8}"
    return f"{name:26}{now:12.2f}{beside}\n"


def main() -> None:
    """Print times, ratio, iterations and split."""
    parser = options_of(__doc__, writes=True)
    parser.add_argument("--study", default="finite_strain")
    parser.add_argument("--end", type=float)
    parser.add_argument("--repeat", type=int, default=2)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--alone", action="store_true", help="large strain without small strain beside it")
    given = parser.parse_args()
    case = given.study if given.end is None else f"{given.study} to {given.end:g} s"
    known = reference("benchmark_large_strain").get(case, {})
    found = measure(given.study, given.end, given.repeat, given.threads, alone=given.alone)
    sys.stdout.write(f"{case:26}{'now':>12}{'before':>12}{'ratio':>8}\n")
    sys.stdout.write("".join(line(name, value, known.get(name)) for name, value in found.items()))
    write(given.write, {case: {name: round(value, 3) for name, value in found.items()}})


if __name__ == "__main__":
    main()
