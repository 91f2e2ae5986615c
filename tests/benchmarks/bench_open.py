"""Time what follows a study: opening its results in Python, its data frame, and making its report again.

Run it as it is: ``python tests/benchmarks/bench_open.py [--runs 1000] [--report results/STUDY]``. A block is pressed
and slid with so many friction coefficients, in a folder that is removed again, and the results are opened by processes
of their own. ``--report`` times the report of a study that was run before, instead. The rows are seconds of the clock
and of the CPU, the least of all repeats; imports have a row of their own, or are in that of the report.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rows import line, options_of

OPEN = """
import json, sys, time
marks = [(time.perf_counter(), time.process_time())]
def mark():
    marks.append((time.perf_counter(), time.process_time()))
import fingerslip as fs
fs.open_study; mark()
study = fs.open_study(sys.argv[1]); mark()
assert len(study.to_dataframe()) == int(sys.argv[2]); mark()
print(json.dumps([[b[0] - a[0], b[1] - a[1]] for a, b in zip(marks, marks[1:])]))
"""
STUDY = """
title: Many slides of a block
mesh: {{file: block.msh}}
formulation: plane_strain
depth: 10 mm
materials: {{bulk: {{youngs_modulus: 50 kPa, poisson_ratio: 0.45, density: 1000 kg/m^3}}}}
supports: {{top: [x, y]}}
contact: {{boundary: bottom, friction_coefficient: 0.4}}
programme:
  - press: {{depth: 0.2 mm, speed: 4 mm/s}}
  - slide: {{distance: 1 mm, speed: 4 mm/s}}
time: {{step: 10 ms, scheme: quasi_static}}
sample: {{count: {runs}, ranges: {{contact.friction_coefficient: [0.3, 0.9]}}}}
"""
PARTS = ("imports", "open_study", "to_dataframe")


def computed(runs: int) -> Path:
    """Run the study of the block in this folder, without figures."""
    import fingerslip as fs
    from fingerslip.study.running import runner
    from fingerslip.verification.meshes import box

    runner.write_report = lambda *_: None  # type: ignore[assignment]
    fs.write_mesh(box("Q4", np.linspace(0.0, 8e-3, 9), np.linspace(0.0, 4e-3, 5)), "block.msh")
    Path("many.yaml").write_text(STUDY.format(runs=runs), encoding="utf-8")
    fs.run_study("many.yaml", workers=2)
    return Path("results/many")


def opened(folder: Path, runs: int, repeat: int) -> None:
    """Print what opening the results takes."""
    command = [sys.executable, "-c", OPEN, str(folder), str(runs)]
    found = np.array(
        [json.loads(subprocess.run(command, check=True, capture_output=True).stdout) for _ in range(repeat)]
    )
    for name, (clock, cpu) in zip(PARTS, found.min(axis=0), strict=True):
        line(f"{name} [s]", float(clock), float(cpu), digits=3)


def reported(folder: Path, repeat: int) -> None:
    """Print what the report of a study takes."""
    found = []
    for _ in range(repeat):
        begun, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        command = [sys.executable, "-m", "fingerslip", "report", str(folder)]
        subprocess.run(command, check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        found.append((time.perf_counter() - begun, cpu))
    clock, cpu = np.array(found).min(axis=0)
    line("report [s]", float(clock), float(cpu), digits=3)


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--report", type=Path, metavar="RESULTS")
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    line("", "clock", "CPU")
    line("---", "---:", "---:")
    if options.report:
        reported(options.report, options.repeat)
        return
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        opened(computed(options.runs), options.runs, options.repeat)
        os.chdir(before)


if __name__ == "__main__":
    main()
