"""Time the start of every verb of the command line, apart from its own work.

Run it as it is: ``python tests/benchmarks/bench_start.py [--repeat 3] [--only check]``. A small study is run first, in
a folder that is removed again. Each verb then gets arguments that give it something to do, in a process of its own,
after one start that compiles. The columns are CPU seconds, the least of all repeats:

start
    Until the verb opens the first file that it was given: the interpreter, the command line and what is imported by
    then. Of verbs that are given none, until they end.
imports
    All of the interpreter's start and everything that is imported up to the end, wherever that is.
work
    The rest: what the verb itself does.

Behind them the seconds of the clock, start to end, and how many modules are loaded at the end.

``--opened 1000`` times instead what follows a study of so many runs: opening its results in Python, and its data frame.
``--report results/STUDY`` times the report of a study that was run before. Both give seconds of the clock and of the
CPU, the least of all repeats.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from rows import line, options_of, seconds, table

# Counted in the process itself: threads that libraries start are part of it, what it starts is not.
START = """
import sys, time, importlib._bootstrap as bootstrap
cpu, find, began = time.process_time, bootstrap._find_and_load, time.perf_counter()
seen = {"start": None, "imports": cpu(), "depth": 0}

def timed(*arguments):
    if seen["depth"]:
        return find(*arguments)
    seen["depth"], before = 1, cpu()
    try:
        return find(*arguments)
    finally:
        seen["depth"] = 0
        seen["imports"] += cpu() - before

def opened(event, arguments):
    if event == "open" and seen["start"] is None and GIVEN and str(arguments[0]).startswith(GIVEN):
        seen["start"] = cpu()

GIVEN = sys.argv.pop(1)
bootstrap._find_and_load = timed
sys.addaudithook(opened)
from fingerslip.commands.app import app
try:
    app(sys.argv[1:], prog_name="fingerslip")
except SystemExit:
    pass
start = cpu() if seen["start"] is None else seen["start"]
found = start, seen["imports"], cpu() - seen["imports"], time.perf_counter() - began, len(sys.modules)
sys.stderr.write(f"\\nmeasured {found}")
"""

STUDY = """
title: Two slides
fingertip: {preset: wang2014-2d}
mesh: {contact_size: 0.15 mm, bulk_size: 1 mm}
contact: {friction_coefficient: 0.5}
programme:
  - press: {depth: 0.5 mm, speed: 10 mm/s}
  - slide: {distance: 1 mm, speed: 10 mm/s}
time: {step: 5 ms}
record: {receptors: [SA-I, FA-I], snapshots_every: 50 ms}
sweep: {contact.friction_coefficient: [0.3, 0.4, 0.5, 0.6]}
"""

#: Arguments by the verb; the study, its results and one of its runs are written as S, R and R/RUN.
VERBS = """
--version | --help | run --help | examples | schema | new made.yaml | show | show wang2014-2d | show S | show R/RUN
check S | run S | report R | diff R/RUN R/OTHER | sensitivity R | predict R --at contact.friction_coefficient=0.45
figure R --kind latency | figure R/RUN --kind slip-map | figure R | view R/RUN --screenshot p.png | mesh S
export R/RUN | export R | export R/RUN --format vtu | verify --only missing | converge missing.yaml
validate --studies missing | track missing.mp4 | detect train missing | detect run missing.csv
detect evaluate missing | detect simulate missing.yaml | detect score missing missing.csv
"""


def least(call, repeat):
    """Return the least of each of the numbers that a call gives."""
    return np.min([call() for _ in range(repeat)], axis=0).tolist()


def measured(arguments, given):
    """Start a command in a process of its own; return CPU seconds, seconds of the clock and loaded modules."""
    words = [sys.executable, "-c", START, given, *arguments]
    done = subprocess.run(words, capture_output=True, text=True, check=False, encoding="utf-8")
    return [float(text) for text in done.stderr.rpartition("measured (")[2].rstrip(")").split(", ")]


def placed(arguments):
    """Put the small study, its results and its runs in the place of S, R, RUN and OTHER."""
    first, second, *_ = sorted(path.parent for path in Path("results/small").glob("*/events.json"))
    names = {"S": "small.yaml", "R": "results/small", "R/RUN": str(first), "R/OTHER": str(second)}
    return [names.get(argument, argument) for argument in arguments]


def verbs(repeat, only):
    """Print what each verb takes."""
    table("command", "start", "imports", "work", "clock", "modules")
    for verb in (words.split() for words in VERBS.strip().replace("\n", "|").split("|")):
        if only in {None, verb[0]}:
            words = placed(verb)
            given = next((one for one in words[1:] if one.startswith(("small", "results", "missing"))), "")
            measured(words, given)
            *times, modules = least(lambda words=words, given=given: measured(words, given), repeat)
            line(" ".join(verb), *times, int(modules), digits=3)


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
BLOCK = """
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
OPENED = ("imports", "open_study", "to_dataframe")


def computed(runs):
    """Run the study of the block in this folder, without figures."""
    import fingerslip as fs
    from fingerslip.study.running import runner
    from fingerslip.verification.meshes import box

    runner.write_report = lambda *_: None
    fs.write_mesh(box("Q4", np.linspace(0.0, 8e-3, 9), np.linspace(0.0, 4e-3, 5)), "block.msh")
    Path("many.yaml").write_text(BLOCK.format(runs=runs), encoding="utf-8")
    fs.run_study("many.yaml", workers=2)
    return Path("results/many")


def opened(folder, runs, repeat):
    """Print what opening the results takes."""
    command = [sys.executable, "-c", OPEN, str(folder), str(runs)]
    call = lambda: json.loads(subprocess.run(command, check=True, capture_output=True).stdout)  # noqa: E731
    for name, (clock, cpu) in zip(OPENED, least(call, repeat), strict=True):
        line(f"{name} [s]", clock, cpu, digits=3)


def reported(folder, repeat):
    """Print what the report of a study takes."""

    def call():
        figures = {}
        with seconds(figures, "report"):
            subprocess.run([sys.executable, "-m", "fingerslip", "report", folder], check=True, capture_output=True)
        return figures["report, clock"], figures["report"]

    line("report [s]", *least(call, repeat), digits=3)


def main():
    """Print what is asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", metavar="VERB")
    parser.add_argument("--opened", type=int, metavar="RUNS")
    parser.add_argument("--report", type=Path, metavar="RESULTS")
    options = parser.parse_args()
    if options.report:
        reported(options.report, options.repeat)
        return
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        if options.opened:
            opened(computed(options.opened), options.opened, options.repeat)
        else:
            Path("small.yaml").write_text(STUDY, encoding="utf-8")
            subprocess.run([sys.executable, "-m", "fingerslip", "run", "small.yaml"], check=True, capture_output=True)
            verbs(options.repeat, options.only)
        os.chdir(before)


if __name__ == "__main__":
    main()
