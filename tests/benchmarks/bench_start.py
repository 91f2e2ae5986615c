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
"""

import contextlib
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from setups import line, options_of, table

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


def main():
    """Print what each verb takes."""
    parser = options_of(__doc__)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", metavar="VERB")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("small.yaml").write_text(STUDY, encoding="utf-8")
        subprocess.run([sys.executable, "-m", "fingerslip", "run", "small.yaml"], check=True, capture_output=True)
        table("command", "start", "imports", "work", "clock", "modules")
        for verb in (words.split() for words in VERBS.strip().replace("\n", "|").split("|")):
            if options.only in {None, verb[0]}:
                words = placed(verb)
                given = next((each for each in words[1:] if each.startswith(("small", "results", "missing"))), "")
                measured(words, given)
                *times, modules = np.min([measured(words, given) for _ in range(options.repeat)], axis=0)
                line(" ".join(verb), *map(float, times), int(modules), digits=3)


if __name__ == "__main__":
    main()
