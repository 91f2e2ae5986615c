"""Time a sweep of 64 runs of the paper-size section, 16 frictions by 4 depths, from its start to its summary.

Run it as it is: ``python tests/benchmarks/bench_sweep.py [--bases automatic full] [--workers 2]``. One run and the
sweep are each computed in a process of their own, from an empty folder, without figures. It tells how many times one
run of the same `basis` the sweep takes, by the clock and by the CPU of all processes, imports included. Beside each
number stands that of ``results/reference/benchmark_sweep.json``; ``--write FILE`` writes such a file. ``--hundred``
times instead a sweep of 100 runs, friction by depth by direction, beside some of its runs as studies of their own on
one worker, whose mean time is multiplied by 100.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rows import Figures, options_of, reference, seconds, write

BASES = ("automatic", "full")
FRICTIONS = [round(float(friction), 2) for friction in np.linspace(0.2, 0.95, 16)]
DEPTHS = [f"{depth} mm" for depth in (1.2, 1.3, 1.4, 1.5)]
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


def sweep(frictions: list[float] = FRICTIONS, depths: list[str] = DEPTHS, directions: str = "") -> str:
    text = f"sweep:\n  contact.friction_coefficient: {frictions}\n  programme.0.press.depth: [{', '.join(depths)}]\n"
    return text + (f"  programme.1.slide.direction: {directions}\n" if directions else "")


def times(basis: str, workers: int) -> dict[str, Timing]:
    """Return what one run takes, and what the sweep takes."""
    single = STUDY.format(basis=basis)
    apart(single, workers)  # the first time, code is compiled
    # On a busy machine CPU seconds grow with the load: one run is timed on both sides of the sweep.
    before, many, after = (apart(study, workers) for study in (single, STUDY.format(basis=basis) + sweep(), single))
    one = Timing(1, 0.5 * (before.clock + after.clock), 0.5 * (before.cpu + after.cpu))
    return {"one": one, "sweep": many}


_RUN = """
import sys
from fingerslip.study.running import compute, runner
assert runner.write_report and compute.drawings_of
compute.drawings_of, runner.write_report = lambda *_: {}, lambda *_: None
folder, workers = sys.argv[1:]
print(len(runner.run_study(f"{folder}/study.yaml", results_dir=f"{folder}/results", workers=int(workers)).runs))
"""


def apart(study: str, workers: int) -> Timing:
    """Run a study in a process of its own, without its figures."""
    figures: Figures = {}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "study.yaml").write_text(study, encoding="utf-8")
        with seconds(figures, "run"):
            words = [sys.executable, "-c", _RUN, folder, str(workers)]
            runs = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    return Timing(int(runs.split()[-1]), figures["run, clock"], figures["run"])


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


def hundred(base: str, count: int, workers: int) -> None:
    """Print what 100 runs take, as one sweep and as studies of their own."""
    frictions = [round(float(friction), 2) for friction in np.linspace(0.3, 0.9, 10)]
    depths = [f"{depth} mm" for depth in (1.1, 1.2, 1.3, 1.4, 1.5)]
    apart(base, 1)  # the first time, code is compiled
    single = [
        apart(base + sweep([friction], [depths[number % len(depths)]], "[[-1, 0]]"), 1)
        for number, friction in enumerate(frictions[:: len(frictions) // count][:count])
    ]
    together = apart(base + sweep(frictions, depths, "[[-1, 0], [1, 0]]"), workers)
    clock, cpu = (100 * float(np.mean([getattr(run, name) for run in single])) for name in ("clock", "cpu"))
    sys.stdout.write(
        f"{'':<28}{'clock':>9}{'CPU':>9}\n"
        f"{'100 separate runs [s]':<28}{clock:9.1f}{cpu:9.1f}\n"
        f"{f'a sweep of {together.runs} runs [s]':<28}{together.clock:9.1f}{together.cpu:9.1f}\n"
        f"{'gain':<28}{clock / together.clock:9.1f}{cpu / together.cpu:9.1f}\n"
    )


def main() -> None:
    parser = options_of(__doc__, writes=True)
    parser.add_argument("--bases", nargs="+", choices=BASES, default=list(BASES))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--hundred", type=int, metavar="APART", help="100 runs beside so many separate ones instead")
    options = parser.parse_args()
    if options.hundred:
        for basis in options.bases:
            hundred(STUDY.format(basis=basis), options.hundred, options.workers)
        return
    before, timings = reference("benchmark_sweep"), {}
    for basis in options.bases:
        found = times(basis, options.workers)
        timings[basis] = {name: asdict(one) for name, one in found.items()}
        sys.stdout.write(report(basis, found, before.get(basis)))
        sys.stdout.flush()
    write(options.write, timings)


if __name__ == "__main__":
    main()
