"""Figures of speed in one table: ``make bench``, or ``python tests/benchmarks/bench.py --cases fine --write FILE``.

Each case runs in a process of its own, so that its memory is its own, after what it needs was compiled. Without
``--cases`` these are the cases that have goals; of long ones only the stored figures are shown. Figures are CPU seconds
of all threads and processes where nothing else is said. Beside each stand its goal and what
``results/reference/benchmark.json`` has of the version before; the machine's speed is measured by fixed work before
each case, and figures of another day are scaled by it.

======================= =========================================================================================
2D, frictions, solid    the mesh, a basis that is made, and one that is kept: the paper's section, eight frictions of
                        it, and the fingertip in 3D
control                 steps from outside, in milliseconds
table 2, sweep, hundred studies on the command line; 64 runs; 100 runs beside studies of their own
report                  ``fingerslip report`` of 100 runs
opened                  results of 1,000 runs, opened in Python
3D, eight               the shipped tetrahedra in one direction and eight; the mesh of ``directions_3d``
sensor                  the slide of 47 s of a TacTip in 2D
shipped, fine           a mesh with thousands of touching nodes beside that of the shipped tetrahedra
solvers, precision      MKL PARDISO and SuperLU; factors of double and of single precision in 3D
relaxing                three Prony terms in the soft layers beside none; ``relaxing 3D`` likewise
large strain            small and large strain, a run of that study; ``large strain 3D`` likewise
growth                  a stand-in of 2,000 to 150,000 nodes, 60 steps, and the power of the nodes that costs go with
======================= =========================================================================================

Of variants of a model the parts of the stepping follow, what their solver counted, and how much a variable differs from
the first variant, as root of the mean square over that of the variable.
"""

import json
import logging
import multiprocessing
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from setups import (
    ROOT,
    Figures,
    Memory,
    finger_mesh,
    line,
    model,
    model_of,
    options_of,
    pad_mesh,
    reference,
    seconds,
    table,
    write,
)
from threadpoolctl import threadpool_limits

import fingerslip as fs
from fingerslip.linear.solver import known_solvers
from fingerslip.linear.solvers.pardiso import Pardiso
from fingerslip.verification.meshes import box
from problems.matrices import ExactPardiso
from problems.pushed import section

PARTS = ("basis", "assembly", "bulk", "tangent", "factorisation", "substitution", "contact", "recording", "stepping")
COUNTS = ("newton_iterations", "factorisations", "halved_steps", "basis_error", "basis_acceleration_error")
COMPARED = ("contact_displacement", "contact_acceleration", "normal_traction", "tangential_traction", "displacement")
TERMS = (fs.PronyTerm(0.3, 0.02), fs.PronyTerm(0.2, 0.2), fs.PronyTerm(0.2, 2.0))


@dataclass(frozen=True)
class Case:
    """A measurement, and what its figures should be at most; long ones are measured only where they are named."""

    measure: Callable[[], Figures]
    goals: Figures = field(default_factory=dict)
    is_long: bool = False


@dataclass(frozen=True)
class Variant:
    """Models of one kind, run one after the other or together, and what they are simulated with."""

    models: list[fs.Model]
    options: dict[str, Any] = field(default_factory=dict)
    together: bool = False

    def run(self, steps=None):
        """Return the histories, perhaps of some steps only."""
        models = self.models
        if steps:
            models = [replace(each, time=replace(each.time, end=steps * each.time.step)) for each in models]
        if self.together:
            return fs.simulate_together(models, **self.options)
        return [fs.simulate(each, **self.options) for each in models]


def compared(make):
    """Return what variants take, beside each other, and how they differ."""
    figures, variants, histories = Figures(), make(), {}
    for variant in variants.values():
        stores = {"bases": Memory()} if "bases" in variant.options else {}
        replace(variant, options=variant.options | stores).run(steps=20)
    first, *others = variants
    for name, variant in variants.items():
        with seconds(figures, name):
            histories[name] = variant.run()
        attrs = [history.attrs for history in histories[name]]
        costs = {part: sum(each.get(f"cpu_seconds_{part}", 0.0) for each in attrs) for part in PARTS}
        figures |= {f"{name}: {part}": cost for part, cost in costs.items() if cost > 0.01 * figures[name]}
        figures |= {f"{name}: {key}": float(attrs[0][key]) for key in COUNTS if attrs[0].get(key)}
    for name in others:
        figures[f"{name} over {first}"] = figures[name] / figures[first]
        pairs = list(zip(histories[name], histories[first], strict=False))
        for variable in (each for each in COMPARED if pairs[0][1][each].size):
            errors = [np.linalg.norm((b - a)[variable]) / np.linalg.norm(a[variable]) for b, a in pairs]
            figures[f"{name}: difference of {variable}"] = float(max(errors))
    return figures | {"memory so far [GB]": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20}


def bases(whole, frictions=(), basis=None):
    (contact,) = whole.contacts
    laws = [fs.Coulomb(friction) for friction in frictions] or [contact.friction]
    models = [replace(whole, contacts=(replace(contact, friction=law),)) for law in laws]
    reduced, store = [replace(each, basis=basis or fs.ReducedBasis()) for each in models], {"bases": Memory()}
    return {"mesh": Variant(models), "basis made": Variant(reduced, store), "basis kept": Variant(reduced, store)}


def directions(whole):
    """Return a slide in one direction, and in eight together."""
    press, slide = whole.programme[0], whole.programme[-1]
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    turned = [replace(slide, direction=(float(np.cos(angle)), 0.0, float(np.sin(angle)))) for angle in angles]
    eight = [replace(whole, programme=(press, each)) for each in turned]
    return {"one direction": Variant([whole]), "eight directions": Variant(eight, together=True)}


def relaxing(whole):
    soft = {name: replace(law, prony=TERMS) for name, law in whole.materials.items() if name != "phalanx"}
    return {"elastic": Variant([whole]), "relaxing": Variant([replace(whole, materials=whole.materials | soft)])}


def strains(study):
    whole = model_of(study)
    return {f"{words} strain": Variant([replace(whole, kinematics=kinematics)])
            for words, kinematics in (("small", "small"), ("large", "finite"))}  # fmt: skip


def paper(step=5e-3):
    """Return the push and slide of the paper's section on elements of 0.15 mm."""
    sites = fs.Recording(sites=fs.receptor_sites(fs.preset("wang2014-2d")))
    return section(sizes=(0.15e-3, 0.28e-3), travel=6e-3, towards=1.0, time=fs.TimeStepping(step), record=sites)


def finger(size, *, steps=300, integration="selective"):
    return model(finger_mesh(size), steps=steps, integration=integration)


def solvers(whole, *pairs):
    return {name: Variant([whole], {"solver": solver}) for name, solver in pairs}


def control():
    """Step 1 ms at a time from outside and read the slip of each node: milliseconds a step."""
    clocks, reduced = [], replace(paper(1e-3), basis=fs.ReducedBasis(1e-2, 0.5))
    with fs.Simulation(reduced, threads=1, bases=Memory()) as simulation:
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
    figures = Figures()
    with tempfile.TemporaryDirectory() as folder:
        words = ["-m", "fingerslip", "run", "studies/wang2014_table2.yaml", "--quiet", "--force", "--results"]
        environment = os.environ if warm else {**os.environ, "NUMBA_CACHE_DIR": f"{folder}/compiled"}
        run = partial(subprocess.run, check=True, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL)
        if warm:
            run([sys.executable, *words, folder])
        with seconds(figures, "run"):
            run([sys.executable, *words, folder])
    return figures


STUDY = """
fingertip: {preset: wang2014-2d, phalanx: {variant: original}}
mesh: {contact_size: 0.15 mm}
contact: {friction_coefficient: 0.6}
programme:
  - press: {depth: 1.5 mm, speed: 1.5 mm/s}
  - slide: {distance: 6 mm, speed: 3 mm/s, direction: [-1, 0]}
time: {step: 5 ms}
record: {receptors: [FA-I, SA-I, FA-II, SA-II]}
"""
BLOCK = """
mesh: {file: block.msh}
formulation: plane_strain
depth: 10 mm
materials: {bulk: {youngs_modulus: 50 kPa, poisson_ratio: 0.45, density: 1000 kg/m^3}}
supports: {top: [x, y]}
contact: {boundary: bottom, friction_coefficient: 0.4}
programme:
  - press: {depth: 0.2 mm, speed: 4 mm/s}
  - slide: {distance: 1 mm, speed: 4 mm/s}
time: {step: 10 ms, scheme: quasi_static}
sample: {count: 1000, ranges: {contact.friction_coefficient: [0.3, 0.9]}}
"""
RUN = """
import sys
from fingerslip.study.running import compute, runner
assert runner.write_report and compute.drawings_of
compute.drawings_of, runner.write_report = lambda *_: {}, lambda *_: None
runner.run_study("study.yaml", workers=int(sys.argv[1]))
"""


def swept(frictions=(), depths=(), moves=""):
    """Return the study, with a sweep of friction, depth and direction where there are any."""
    if not len(frictions):
        return STUDY
    text = f"sweep:\n  contact.friction_coefficient: {[round(float(each), 2) for each in frictions]}\n"
    text += f"  programme.0.press.depth: [{', '.join(f'{depth} mm' for depth in depths)}]\n"
    return STUDY + text + (f"  programme.1.slide.direction: {moves}\n" if moves else "")


def apart(figures, name, study, folder, workers=2):
    """Run a study in a process of its own, from an empty folder and without figures."""
    (folder / "study.yaml").write_text(study, encoding="utf-8")
    with seconds(figures, name):
        subprocess.run([sys.executable, "-c", RUN, str(workers)], check=True, cwd=folder, capture_output=True)


def studies(rows):
    """Run studies after a single run that compiles; rows are name, study and workers."""
    figures = Figures()
    for name, study, workers in (("single", STUDY, 2), *rows):
        with tempfile.TemporaryDirectory() as folder:
            apart(figures, name, study, Path(folder), workers)
    return figures


def hundred():
    """Run a sweep of 100 runs, and five of its runs as studies of their own on one worker, a twentieth of all."""
    frictions, depths = np.linspace(0.3, 0.9, 10), (1.1, 1.2, 1.3, 1.4, 1.5)
    single = [
        (f"apart {number}", swept([frictions[2 * number]], [depths[number]], "[[-1, 0]]"), 1) for number in range(5)
    ]
    figures = studies([*single, ("100 runs", swept(frictions, depths, "[[-1, 0], [1, 0]]"), 2)])
    for kind in ("", ", clock"):
        figures[f"100 runs apart{kind}"] = 20.0 * sum(figures.pop(f"{name}{kind}") for name, _, _ in single)
    return figures


def reported():
    """Write the report of 100 runs."""
    figures, frictions = Figures(), np.linspace(0.3, 0.9, 20)
    with tempfile.TemporaryDirectory() as folder:
        apart(figures, "100 runs", swept(frictions, (1.1, 1.2, 1.3, 1.4, 1.5)), Path(folder))
        with seconds(figures, "report"):
            words = [sys.executable, "-m", "fingerslip", "report", "results/study"]
            subprocess.run(words, check=True, cwd=folder, stdout=subprocess.DEVNULL)
    return figures


OPEN = """
import json, sys, time
marks = [(time.perf_counter(), time.process_time())]
def mark():
    marks.append((time.perf_counter(), time.process_time()))
import fingerslip as fs
fs.open_study; mark()
study = fs.open_study("results/study"); mark()
assert len(study.to_dataframe()) == 1000; mark()
print(json.dumps([[b[0] - a[0], b[1] - a[1]] for a, b in zip(marks, marks[1:])]))
"""


def opened():
    """Open the results of 1,000 runs of a block in Python, and take their data frame: the least of three."""
    figures = Figures()
    with tempfile.TemporaryDirectory() as folder:
        fs.write_mesh(box("Q4", np.linspace(0.0, 8e-3, 9), np.linspace(0.0, 4e-3, 5)), f"{folder}/block.msh")
        apart(figures, "1000 runs", BLOCK, Path(folder))
        command = partial(subprocess.run, [sys.executable, "-c", OPEN], check=True, cwd=folder, capture_output=True)
        least = np.min([json.loads(command().stdout) for _ in range(3)], axis=0)
    for name, (clock, cpu) in zip(("imports", "open_study", "to_dataframe"), least, strict=True):
        figures |= {f"{name}, clock": clock, name: cpu}
    return figures


def growth():
    """Press stand-ins of growing numbers of nodes, and fit the power of the nodes with which each cost grows."""
    nodes, costs = [], {part: [] for part in ("assembly", "factorisation", "substitution", "contact", "recording")}
    for count in (2_000, 5_000, 12_000, 34_000, 75_000, 150_000):
        attrs = fs.simulate(model(pad_mesh(count), steps=60)).attrs
        nodes.append(attrs["n_nodes"])
        for part, values in costs.items():
            values.append(attrs[f"cpu_seconds_{part}"])
    figures = {f"{part}, {count} nodes": cost for part, values in costs.items()
               for count, cost in zip(nodes, values, strict=True)}  # fmt: skip
    powers = {part: np.polyfit(np.log(nodes), np.log(values), 1)[0] for part, values in costs.items()}
    return figures | {f"{part}: power over nodes": float(power) for part, power in powers.items()}


def draw_growth(figures, path):
    """Draw the costs of the case growth over the nodes, with the power of each."""
    axes = Figure(figsize=(6.3, 4.2), layout="constrained").add_subplot(xlabel="nodes", ylabel="CPU seconds (60 steps)")
    powers = {name.partition(":")[0]: value for name, value in figures.items() if name.endswith("power over nodes")}
    for (part, power), marker in zip(powers.items(), "osD^v", strict=True):
        costs = {int(name.split()[-2]): value for name, value in figures.items() if name.startswith(f"{part}, ")}
        axes.loglog(*zip(*costs.items(), strict=True), marker=marker, markersize=4, label=f"{part}: {power:.2f}")
    axes.grid(which="both", linewidth=0.3)
    axes.legend(title="part: power of the nodes", fontsize=8)
    axes.figure.savefig(path, dpi=150)


def of(make, *arguments, **options):
    """Return the case that compares the variants that a function makes."""
    return partial(compared, partial(make, *arguments, **options))


SWEPT = swept(np.linspace(0.2, 0.95, 16), (1.2, 1.3, 1.4, 1.5))
EIGHT = tuple(np.linspace(0.4, 0.75, 8).tolist())
CASES = {
    "2D": Case(of(lambda: bases(paper(), basis=fs.ReducedBasis(1e-2, 0.5))), {"basis made": 0.7, "basis kept": 0.3}),
    "control": Case(control, {"a step [ms]": 0.5, "95 % [ms], clock": 1.0}),
    "table 2": Case(partial(table_2, warm=True), {"run": 12.0}),
    "table 2, cold": Case(partial(table_2, warm=False), {"run, clock": 30.0}),
    "sweep": Case(partial(studies, [("64 runs", SWEPT, 2)]), {"64 runs": 15.0}),
    "3D": Case(
        of(lambda: directions(model_of("wang2014_3d_tetrahedra"))),
        {"one direction": 15.0, "eight directions over one direction": 2.0},
    ),
    "large strain": Case(of(strains, "finite_strain"), {"large strain over small strain": 4.0}),
    "report": Case(reported, {"report": 10.0}),
    "fine": Case(
        of(lambda: {"all": Variant([finger("fine")])}), {"all": 60.0, "memory so far [GB]": 2.0}, is_long=True
    ),
    "large strain 3D": Case(of(strains, "finite_strain_3d"), {"large strain, clock": 240.0}, is_long=True),
    "hundred": Case(hundred),
    "opened": Case(opened),
    "frictions": Case(of(lambda: bases(model_of("wang2014_friction"), EIGHT))),
    "solid": Case(of(lambda: bases(model_of("wang2014_3d")))),
    "eight": Case(of(lambda: directions(finger("coarse", integration="nodal")))),
    "shipped": Case(of(lambda: {"all": Variant([finger("shipped")])})),
    "sensor": Case(of(lambda: {"all": Variant([model_of("tactip_slide")])})),
    "solvers": Case(of(lambda: solvers(paper(), *((each.name, each) for each in known_solvers())))),
    "precision": Case(of(lambda: solvers(finger("shipped"), ("double", ExactPardiso()), ("single", Pardiso())))),
    "relaxing": Case(of(lambda: relaxing(paper()))),
    "relaxing 3D": Case(of(lambda: relaxing(finger("shipped", steps=200, integration="nodal")))),
    "growth": Case(growth),
}


def measured(name):
    """Return the CPU seconds of fixed work, in the cache and over more than it holds, and the figures of a case."""
    logging.disable(logging.WARNING)
    small, big, tries = np.ones((400, 400)), np.ones(8_000_000), []
    with threadpool_limits(limits=1):
        for _ in range(3):
            start = time.process_time()
            for _ in range(20):
                small @ small
                big += 1.0
            tries.append(time.process_time() - start)
    return min(tries), CASES[name].measure()


def main():
    parser = options_of(__doc__, writes=True)
    named = [name for name, case in CASES.items() if case.goals and not case.is_long]
    parser.add_argument("--cases", nargs="+", choices=CASES, default=named)
    parser.add_argument("--figure", metavar="FILE", help="draw the case growth, as in docs/figures/solid-scaling.png")
    options = parser.parse_args()
    stored, results = reference("benchmark"), {}
    table("case", "figure [s]", "now", "goal", "before", "before, at this speed")
    for name in options.cases:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            fixed, figures = pool.apply(measured, (name,))
        results[name] = {"fixed work": fixed, **figures}
        before = stored.get(name, {})
        scale = fixed / before["fixed work"] if "fixed work" in before else 1.0
        for figure, value in results[name].items():
            goal, earlier = CASES[name].goals.get(figure, ""), before.get(figure, "")
            is_ratio = " over " in figure or figure not in before
            line(name, figure, value, goal, earlier, earlier if is_ratio else earlier * scale, digits=3)
    for name in (name for name, case in CASES.items() if case.is_long and name not in results):
        for figure, goal in CASES[name].goals.items():
            line(name, figure, f"see --cases '{name}'", goal, stored.get(name, {}).get(figure, ""), "", digits=3)
    write(options.write, results)
    if options.figure and "growth" in results:
        draw_growth(results["growth"], options.figure)


if __name__ == "__main__":
    main()
