"""Time motions on the mesh and in a reduced basis: runs of the paper in 2D and in 3D, and eight frictions.

Run it as it is: ``python tests/benchmarks/bench_basis.py [--cases plane sweep solid] [--tolerance 1e-4]``. Each case is
computed in one process: on the mesh, in a basis that is made, and in one that is kept. A step is all of the stepping
over the number of steps, with records, snapshots and checks of the basis. A sweep is eight runs one after the other, as
small runs of a study are. Seconds are those of the clock and of the CPU; ratios are those of CPU seconds.
"""

from __future__ import annotations

import contextlib
import dataclasses
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rows import options_of

import fingerslip as fs
from fingerslip.study.definition.runs import plan_study
from fingerslip.study.running.build import prepare

STUDIES = Path(__file__).parents[2] / "studies"
CASES = {"plane": "wang2014_friction", "sweep": "wang2014_friction", "solid": "wang2014_3d"}
FRICTIONS = np.linspace(0.4, 0.75, 8)
COMPARED = ("contact_displacement", "displacement", "contact_acceleration", "acceleration", "strain_energy_density")
PARTS = ("basis", "factorisation", "substitution", "contact", "recording", "stepping")


class Memory:
    """A store of bases in memory, which costs nothing."""

    def __init__(self):
        self.kept = {}

    def load(self, key):
        return self.kept.get(key)

    def save(self, key, arrays):
        self.kept[key] = dict(arrays)

    def alone(self, _key):
        return contextlib.nullcontext()


def models(case: str):
    plan = plan_study(STUDIES / f"{CASES[case]}.yaml", "results")
    # Studies may take a basis for a run alone.
    model = dataclasses.replace(prepare(plan, plan.runs[:1])[0].model, basis=None)
    if case != "sweep":
        return [model]
    (contact,) = model.contacts
    laws = [fs.Coulomb(float(friction)) for friction in FRICTIONS]
    return [dataclasses.replace(model, contacts=(dataclasses.replace(contact, friction=law),)) for law in laws]


def timed(compute: Callable[[], list]):
    clock, cpu = time.perf_counter(), time.process_time()
    found = compute()
    return found, time.perf_counter() - clock, time.process_time() - cpu


def line(name: str, histories: list, clock: float, cpu: float) -> str:
    parts = [
        f"{part} {sum(history.attrs.get(f'cpu_seconds_{part}', 0.0) for history in histories):.2f}" for part in PARTS
    ]
    steps = sum(history.sizes["time"] - 1 for history in histories)
    step = 1e3 * sum(history.attrs["cpu_seconds_stepping"] for history in histories) / steps
    parts = [f"a step {step:.2f} ms", *parts]
    return f"  {name:<10}{clock:9.2f} s clock {cpu:9.2f} s CPU   (CPU: {', '.join(parts)})\n"


def errors(found: list, expected: list) -> str:
    """Return the differences of variables, as root of the mean square over that of the variable, the largest run's."""
    texts = []
    for name in (name for name in COMPARED if expected[0][name].size):
        sizes = [
            np.linalg.norm((one[name] - other[name]).values) / np.linalg.norm(other[name].values)
            for one, other in zip(found, expected, strict=True)
        ]
        texts.append(f"{name} {max(sizes):.1e}")
    times = [fs.find_events(history).displacement.overall for history in (*found, *expected)]
    pairs = zip(times[: len(found)], times[len(found) :], strict=True)
    moved = [abs(one - other) for one, other in pairs if one is not None and other is not None]
    return ", ".join([*texts, f"overall slip {1e3 * max(moved, default=float('nan')):.1e} ms"])


def run(case: str, basis: fs.ReducedBasis) -> None:
    wanted, store = models(case), Memory()
    fs.simulate(dataclasses.replace(wanted[0], time=dataclasses.replace(wanted[0].time, end=20 * wanted[0].time.step)))
    full, *full_times = timed(lambda: [fs.simulate(model) for model in wanted])
    reduced = [dataclasses.replace(model, basis=basis) for model in wanted]
    made, *made_times = timed(lambda: [fs.simulate(model, bases=store) for model in reduced])
    kept, *kept_times = timed(lambda: [fs.simulate(model, bases=store) for model in reduced])
    attrs = made[-1].attrs
    sizes = f"{attrs['n_degrees_of_freedom']} unknowns, {full[0].sizes['time'] - 1} steps, {len(wanted)} runs"
    sys.stdout.write(f"{case}: {sizes}\n")
    sys.stdout.write(
        line("mesh", full, *full_times) + line("made", made, *made_times) + line("kept", kept, *kept_times)
    )
    sys.stdout.write(f"  CPU over that on the mesh: made {made_times[1] / full_times[1]:.2f}")
    sys.stdout.write(f", kept {kept_times[1] / full_times[1]:.2f}\n")
    told = {key: value for key, value in attrs.items() if key.startswith("basis")}
    sys.stdout.write(f"  {told}\n  {errors(made, full)}\n")
    sys.stdout.flush()


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--tolerance", type=float, default=fs.ReducedBasis().tolerance)
    parser.add_argument("--acceleration-tolerance", type=float, default=fs.ReducedBasis().acceleration_tolerance)
    options = parser.parse_args()
    for case in options.cases:
        run(case, fs.ReducedBasis(options.tolerance, options.acceleration_tolerance))


if __name__ == "__main__":
    main()
