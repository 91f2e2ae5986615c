"""Time a sweep of 64 runs of the paper-size section, 16 frictions by 4 depths, from its start to its summary.

Run it as it is: ``python tests/benchmarks/bench_sweep.py [--bases automatic full] [--workers 2]``. One run and the
sweep are each computed in a process of their own, from an empty folder, without figures. It tells how many times one
run of the same `basis` the sweep takes, by the clock and by the CPU of all processes, imports included. Beside each
number stands that of ``results/reference/benchmark_sweep.json``; ``--write FILE`` writes such a file.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

BASES = ("automatic", "full")
FRICTIONS = [round(float(friction), 2) for friction in np.linspace(0.2, 0.95, 16)]
DEPTHS = [f"{depth} mm" for depth in (1.2, 1.3, 1.4, 1.5)]
REFERENCE = Path(__file__).parents[2] / "results" / "reference" / "benchmark_sweep.json"
STUDY = """
fingertip: {{preset: wang2014-2d, phalanx: {{variant: original}}}}
mesh: {{contact_size: 0.15 mm}}
contact: {{friction_coefficient: 0.6}}
programme:
  - press: {{depth: 1.5 mm, speed: 1.5 mm/s}}
  - slide: {{distance: 6 mm, speed: 3 mm/s, direction: [-1, 0]}}
time: {{step: 5 ms}}
record: {{receptors: [FA-I, SA-I, FA-II, SA-II]}}
dynamics: {{basis: {basis}}}
"""


@dataclass(frozen=True)
class Timing:
    """Seconds from the first import to the summary, by the clock and by the CPU of all processes."""

    runs: int
    clock: float
    cpu: float


def sweep() -> str:
    return f"sweep:\n  contact.friction_coefficient: {FRICTIONS}\n  programme.0.press.depth: [{', '.join(DEPTHS)}]\n"


def measure(study: str, workers: int) -> Timing:
    """Run a study without its figures."""
    start = time.perf_counter()
    from fingerslip.study.running import runner

    runner._drawings, runner.write_report = lambda *_: {}, lambda *_: None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.yaml"
        path.write_text(study, encoding="utf-8")
        result = runner.run_study(path, results_dir=Path(folder) / "results", workers=workers)
        clock = time.perf_counter() - start
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return Timing(len(result.runs), clock, sum(one.ru_utime + one.ru_stime for one in used))


def times(basis: str, workers: int) -> dict[str, Timing]:
    """Return what one run takes, and what the sweep takes."""
    single = STUDY.format(basis=basis)
    apart(single, workers)  # the first time, code is compiled
    # On a busy machine CPU seconds grow with the load: one run is timed on both sides of the sweep.
    before, many, after = (apart(study, workers) for study in (single, STUDY.format(basis=basis) + sweep(), single))
    one = Timing(1, 0.5 * (before.clock + after.clock), 0.5 * (before.cpu + after.cpu))
    return {"one": one, "sweep": many}


def apart(study: str, workers: int) -> Timing:
    """Run a study in a process of its own."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(measure, study, workers).result()


def report(basis: str, found: dict[str, Timing], before: dict | None) -> str:
    lines = [f"basis {basis}", f"  {'':<14}{'clock':>9}{'before':>9}{'CPU':>9}{'before':>9}"]
    rows = {name: (one.clock, one.cpu) for name, one in found.items()}
    known = {name: (one["clock"], one["cpu"]) for name, one in before.items()} if before else {}
    for name, numbers in rows.items():
        lines.append(line(f"{name} [s]", numbers, known.get(name)))
    lines.append(line("sweep / one", ratio(rows), ratio(known) if known else None))
    return "\n".join(lines) + "\n"


def ratio(rows: dict[str, tuple[float, float]]) -> tuple[float, float]:
    one, many = rows["one"], rows["sweep"]
    return many[0] / one[0], many[1] / one[1]


def line(name: str, numbers: tuple[float, float], before: tuple[float, float] | None) -> str:
    texts = [f"{value:9.1f}" for value in before] if before else [f"{'-':>9}"] * 2
    return f"  {name:<14}{numbers[0]:9.1f}{texts[0]}{numbers[1]:9.1f}{texts[1]}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bases", nargs="+", choices=BASES, default=list(BASES))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--write", type=Path, metavar="FILE", help="write the numbers, to compare with later")
    options = parser.parse_args()
    reference = json.loads(REFERENCE.read_text(encoding="utf-8")) if REFERENCE.exists() else {"cases": {}}
    if reference["cases"]:
        sys.stdout.write(f"before: {reference['state']}; {reference['machine']}\n")
    kept = {}
    for basis in options.bases:
        found = times(basis, options.workers)
        kept[basis] = {name: asdict(one) for name, one in found.items()}
        sys.stdout.write(report(basis, found, reference["cases"].get(basis)))
        sys.stdout.flush()
    if options.write:
        content = {"state": "which version", "machine": "which machine", "cases": kept}
        options.write.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
