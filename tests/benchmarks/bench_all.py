"""Every figure of speed that the documentation names, in one table: ``python tests/benchmarks/bench_all.py``.

Each case runs in a process of its own, after what it needs was compiled. Beside each figure stand its goal and what
``results/reference/benchmark_all.json`` has of the version before. The machine's speed is measured by fixed work before
each case, and figures of another day are scaled by it. ``--write FILE`` writes such a file.
"""

import logging
import multiprocessing
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import bench_sweep
import numpy as np
from models import Memory, model_of, section
from rows import Figures, line, options_of, reference, seconds, table, write
from threadpoolctl import threadpool_limits

import fingerslip as fs

ROOT = Path(__file__).parents[2]
BASIS = fs.ReducedBasis(1e-2, 0.5)


@dataclass(frozen=True)
class Case:
    """A measurement, and what its figures should be at most."""

    measure: Callable[[], Figures]
    goals: Figures


def speed():
    """Return the CPU seconds of fixed work: products in the cache, and passes over more than the cache holds."""
    small, large = np.ones((400, 400)), np.ones(8_000_000)
    with threadpool_limits(limits=1):
        start = time.process_time()
        for _ in range(20):
            small @ small
            large += 1.0
        return time.process_time() - start


def plane():
    """Run the push and slide of the section, 600 steps: in a basis that is made, in one that is kept, on the mesh."""
    figures: Figures = {}
    model = replace(section(), basis=BASIS)
    fs.simulate(replace(model, time=fs.TimeStepping(5e-3, end=0.1)), bases=Memory())
    store = Memory()
    for name in ("basis made", "basis kept"):
        with seconds(figures, name):
            fs.simulate(model, bases=store)
    with seconds(figures, "mesh"):
        fs.simulate(replace(model, basis=None))
    return figures


def control():
    """Step 1 ms at a time from outside and read the slip of each node: milliseconds a step."""
    model, store = replace(section(1e-3), basis=BASIS), Memory()
    clocks = []
    with fs.Simulation(model, threads=1, bases=store) as simulation:
        for _ in range(200):
            simulation.step()
        cpu = time.process_time()
        for _ in range(1500):
            start = time.perf_counter()
            simulation.step()["contact_state"]
            clocks.append(1e3 * (time.perf_counter() - start))
        cpu = 1e3 * (time.process_time() - cpu) / 1500
    middle, most = statistics.median(clocks), statistics.quantiles(clocks, n=20)[-1]
    named = {"median [ms], clock": middle, "95 % [ms], clock": most, "largest [ms], clock": max(clocks)}
    return {"a step [ms]": cpu, **named}


def table_2(*, warm):
    """Run Table 2 on the command line after a run that compiles, or with nothing compiled as on a fresh machine."""
    figures: Figures = {}
    with tempfile.TemporaryDirectory() as folder:
        words = ["-m", "fingerslip", "run", "studies/wang2014_table2.yaml", "--quiet", "--force", "--results"]
        environment = os.environ if warm else {**os.environ, "NUMBA_CACHE_DIR": f"{folder}/compiled"}
        run = partial(subprocess.run, check=True, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL)
        if warm:
            run([sys.executable, *words, folder])
        with seconds(figures, "run"):
            run([sys.executable, *words, folder])
    return figures


def sweep():
    """Run 16 frictions and 4 depths from start to summary, without figures, after a single run that compiles."""
    study, figures = bench_sweep.STUDY.format(basis="automatic"), {}
    for name, swept in (("single", ""), ("64 runs", bench_sweep.sweep())):
        run = bench_sweep.apart(study + swept, workers=2)
        figures |= {f"{name}, clock": run["clock"], name: run["cpu"]}
    return figures


def solid():
    """Run the shipped tetrahedra in one direction, and in eight together."""
    figures: Figures = {}
    model = model_of("wang2014_3d_tetrahedra")
    fs.simulate(replace(model, time=replace(model.time, end=20 * model.time.step)))
    with seconds(figures, "one direction"):
        fs.simulate(model)
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    press, slide = model.programme[0], model.programme[-1]
    turned = [replace(slide, direction=(float(np.cos(angle)), 0.0, float(np.sin(angle)))) for angle in angles]
    with seconds(figures, "eight directions"):
        fs.simulate_together([replace(model, programme=(press, direction)) for direction in turned])
    figures["eight over one"] = figures["eight directions"] / figures["one direction"]
    return figures


def large():
    """Run the study of large strain in 2D, and the same motion at small strain on the mesh."""
    figures: Figures = {}
    model = model_of("finite_strain")
    for name, kinematics in (("small strain", "small"), ("large strain", "finite")):
        each = replace(model, kinematics=kinematics)
        fs.simulate(replace(each, time=replace(each.time, end=20 * model.time.step)))
        with seconds(figures, name):
            fs.simulate(each)
    figures["large over small"] = figures["large strain"] / figures["small strain"]
    return figures


CASES = {
    "2D": Case(plane, {"basis made": 0.7, "basis kept": 0.3}),
    "control": Case(control, {"a step [ms]": 0.5, "95 % [ms], clock": 1.0}),
    "table 2": Case(partial(table_2, warm=True), {"run": 12.0}),
    "table 2, cold": Case(partial(table_2, warm=False), {"run, clock": 30.0}),
    "sweep": Case(sweep, {"64 runs": 15.0}),
    "3D": Case(solid, {"one direction": 15.0, "eight over one": 2.0}),
    "large strain": Case(large, {"large over small": 4.0}),
}


def measured(name):
    logging.disable(logging.WARNING)
    return min(speed() for _ in range(3)), CASES[name].measure()


def main():
    parser = options_of(__doc__, writes=True)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    options = parser.parse_args()
    stored, results = reference("benchmark_all"), {}
    table("case", "figure [s]", "now", "goal", "before", "before, at this speed")
    for name in options.cases:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            fixed, figures = pool.apply(measured, (name,))
        results[name] = {"fixed work": fixed, **figures}
        before = stored.get(name, {})
        scale = fixed / before["fixed work"] if before else 1.0
        for figure, value in results[name].items():
            goal, earlier = CASES[name].goals.get(figure, ""), before.get(figure, "")
            is_ratio = " over " in figure or figure not in before
            line(name, figure, value, goal, earlier, earlier if is_ratio else earlier * scale, digits=3)
    write(options.write, results)


if __name__ == "__main__":
    main()
