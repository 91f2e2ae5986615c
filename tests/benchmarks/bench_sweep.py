"""Time a sweep of 64 runs of the paper-size section, 16 frictions by 4 depths, from its start to its summary.

Run it as it is: ``python tests/benchmarks/bench_sweep.py [--bases automatic full] [--workers 2]``. One run and the
sweep are each computed in a process of their own, from an empty folder, without figures. It tells how many times one
run of the same `basis` the sweep takes, by the clock and by the CPU of all processes, imports included. Beside each
number stands that of ``results/reference/benchmark_sweep.json``; ``--write FILE`` writes such a file. ``--hundred``
times instead a sweep of 100 runs, friction by depth by direction, beside some of its runs as studies of their own on
one worker, whose mean time is multiplied by 100.
"""

import itertools
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from rows import line, options_of, reference, seconds, table, write

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


def sweep(frictions=FRICTIONS, depths=DEPTHS, directions=""):
    text = f"sweep:\n  contact.friction_coefficient: {frictions}\n  programme.0.press.depth: [{', '.join(depths)}]\n"
    return text + (f"  programme.1.slide.direction: {directions}\n" if directions else "")


def times(basis, workers):
    """Return what one run takes, and what the sweep takes: seconds from the first import to the summary."""
    single = STUDY.format(basis=basis)
    apart(single, workers)  # the first time, code is compiled
    # On a busy machine CPU seconds grow with the load: one run is timed on both sides of the sweep.
    before, many, after = (apart(study, workers) for study in (single, STUDY.format(basis=basis) + sweep(), single))
    return {"one": {key: 0.5 * (before[key] + after[key]) for key in before}, "sweep": many}


_RUN = """
import sys
from fingerslip.study.running import compute, runner
assert runner.write_report and compute.drawings_of
compute.drawings_of, runner.write_report = lambda *_: {}, lambda *_: None
folder, workers = sys.argv[1:]
print(len(runner.run_study(f"{folder}/study.yaml", results_dir=f"{folder}/results", workers=int(workers)).runs))
"""


def apart(study, workers):
    """Run a study in a process of its own, without its figures."""
    figures = {}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "study.yaml").write_text(study, encoding="utf-8")
        with seconds(figures, "run"):
            words = [sys.executable, "-c", _RUN, folder, str(workers)]
            runs = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    return {"runs": int(runs.split()[-1]), "clock": figures["run, clock"], "cpu": figures["run"]}


def report(basis, timings, before):
    """Print seconds of the clock and the CPU, and those before, where they are known."""
    table(f"basis {basis}", "clock", "before", "CPU", "before")
    for kind, name in (("one", "one [s]"), ("sweep", "sweep [s]"), (None, "sweep / one")):
        cells = []
        for key, known in itertools.product(("clock", "cpu"), (timings, before)):
            values = known and (known[kind][key] if kind else known["sweep"][key] / known["one"][key])
            cells.append(values or "-")
        line(name, *cells, digits=3)


def hundred(base, count, workers):
    """Print what 100 runs take, as one sweep and as studies of their own."""
    frictions = [round(float(friction), 2) for friction in np.linspace(0.3, 0.9, 10)]
    depths = [f"{depth} mm" for depth in (1.1, 1.2, 1.3, 1.4, 1.5)]
    apart(base, 1)  # the first time, code is compiled
    single = [
        apart(base + sweep([friction], [depths[number % len(depths)]], "[[-1, 0]]"), 1)
        for number, friction in enumerate(frictions[:: len(frictions) // count][:count])
    ]
    together = apart(base + sweep(frictions, depths, "[[-1, 0], [1, 0]]"), workers)
    separate = [100 * float(np.mean([run[key] for run in single])) for key in ("clock", "cpu")]
    table("", "clock", "CPU")
    line("100 separate runs [s]", *separate)
    line(f"a sweep of {together['runs']} runs [s]", together["clock"], together["cpu"])
    line("gain", separate[0] / together["clock"], separate[1] / together["cpu"])


def main():
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
        timings[basis] = times(basis, options.workers)
        report(basis, timings[basis], before.get(basis))
    write(options.write, timings)


if __name__ == "__main__":
    main()
