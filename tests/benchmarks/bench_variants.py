"""What variants of a model cost beside each other, and what they change: bases, solvers, precision, relaxation, strain.

    python tests/benchmarks/bench_variants.py [--cases section relaxing ...] [--repeat 1] [--end 0.5] [--threads 1]

======================= =========================================================================================
section, frictions      the mesh, a basis that is made, and one that is kept: the paper's run in 2D, and eight frictions
solid                   the same in 3D
solvers                 MKL PARDISO and SuperLU, push and slide of the paper's section
precision               factors of double and of single precision in 3D; ``precision-coarse`` on the mesh of
                        ``directions_3d``
relaxing                three Prony terms in the soft layers beside none; ``relaxing-3d``, and ``relaxing-shipped`` on
                        the pulp of ``viscoelastic_3d`` at 5 mm/s
finite_strain           small and large strain, a run of that study; ``finite_strain_3d``
======================= =========================================================================================

The variants of a case run in turns in one process, after a short run for the compiled code, and the least seconds of
all repeats count. A step is all of the stepping over the number of steps. Differences from the first variant are the
root of the mean square over that of the variable. ``--alone VARIANT`` runs one variant. Of large strain
``results/reference/benchmark_large_strain.json`` says what it took before; ``--write FILE`` writes such a file.
"""

import dataclasses
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from bench_solid import SIZES
from models import Memory, finger_mesh, model, model_of, section
from rows import line, options_of, reference, table, write

import fingerslip as fs
from fingerslip.linear.solver import known_solvers
from fingerslip.linear.solvers.pardiso import Pardiso

PARTS = ("basis", "assembly", "bulk", "tangent", "factorisation", "substitution", "contact", "recording", "stepping")
COUNTS = ("newton_iterations", "factorisations", "halved_steps", "basis_error", "basis_acceleration_error")
COMPARED = (
    *("contact_displacement", "contact_velocity", "contact_acceleration", "normal_traction", "tangential_traction"),
    *("displacement", "acceleration", "strain_energy_density"),
)
TERMS = (fs.PronyTerm(0.3, 0.02), fs.PronyTerm(0.2, 0.2), fs.PronyTerm(0.2, 2.0))


@dataclass(frozen=True)
class Variant:
    models: list[fs.Model]
    options: dict[str, Any] = field(default_factory=dict)
    makes_basis: bool = False

    def run(self, end, threads):
        """Return the histories, perhaps cut short."""
        if self.makes_basis:
            self.options["bases"].stored.clear()
        cut = [one if end is None else dataclasses.replace(one, time=dataclasses.replace(one.time, end=end))
               for one in self.models]  # fmt: skip
        return [fs.simulate(one, threads=threads, **self.options) for one in cut]


class Exact(Pardiso):
    """MKL PARDISO, all of whose factors are of double precision."""

    def rough(self):
        return self.series()


def bases(study, frictions=()):
    whole, store = model_of(study), {"bases": Memory()}
    (contact,) = whole.contacts
    laws = [fs.Coulomb(friction) for friction in frictions] or [contact.friction]
    models = [dataclasses.replace(whole, contacts=(dataclasses.replace(contact, friction=law),)) for law in laws]
    reduced = [dataclasses.replace(one, basis=fs.ReducedBasis()) for one in models]
    return {"mesh": Variant(models), "made": Variant(reduced, store, True), "kept": Variant(reduced, store)}


def solvers():
    return {solver.name: Variant([section()], {"solver": solver}) for solver in known_solvers()}


def precision(size, integration):
    finger = model(finger_mesh(*SIZES[size]), steps=300, integration=integration)
    solvers = {"double": Exact(), "single": Pardiso()}
    return {name: Variant([finger], {"solver": solver}) for name, solver in solvers.items()}


def relaxing(elastic):
    whole = elastic()
    soft = {name: layer for name, layer in whole.materials.items() if name != "phalanx"}
    materials = {**whole.materials, **{name: dataclasses.replace(layer, prony=TERMS) for name, layer in soft.items()}}
    return {"elastic": Variant([whole]), "relaxing": Variant([dataclasses.replace(whole, materials=materials)])}


def shipped():
    names = {"elastic": "pulp-relaxing-prony-none", "relaxing": "pulp-relaxing"}
    run = "tissue-preset-{}_speed-5mm-per-s_step-5ms"
    return {words: Variant([model_of("viscoelastic_3d", run.format(name))]) for words, name in names.items()}


def strains(study):
    whole = model_of(study)
    return {kind: Variant([dataclasses.replace(whole, kinematics=kind)]) for kind in ("small", "finite")}


CASES: dict[str, Callable[[], dict[str, Variant]]] = {
    "section": partial(bases, "wang2014_friction"),
    "frictions": partial(bases, "wang2014_friction", tuple(np.linspace(0.4, 0.75, 8).tolist())),
    "solid": partial(bases, "wang2014_3d"),
    "solvers": solvers,
    "precision": partial(precision, "shipped", "selective"),
    "precision-coarse": partial(precision, "coarse", "nodal"),
    "relaxing": partial(relaxing, section),
    "relaxing-3d": partial(relaxing, lambda: model(finger_mesh(*SIZES["shipped"]), steps=200, integration="nodal")),
    "relaxing-shipped": shipped,
    "finite_strain": partial(strains, "finite_strain"),
    "finite_strain_3d": partial(strains, "finite_strain_3d"),
}


def measured(variant, end, threads):
    """Return histories, and seconds of everything and of the parts."""
    clock, cpu = time.perf_counter(), time.process_time()
    histories = variant.run(end, threads)
    seconds = {"clock [s]": time.perf_counter() - clock, "CPU [s]": time.process_time() - cpu}
    for part in PARTS:
        seconds[f"{part}, CPU [s]"] = sum(history.attrs.get(f"cpu_seconds_{part}", 0.0) for history in histories)
    return histories, seconds


def differences(histories, expected):
    """Return how much variables and the time of overall slip differ, the largest of all runs."""
    pairs, texts = list(zip(histories, expected, strict=True)), []
    for name in (name for name in COMPARED if name in expected[0] and expected[0][name].size):
        sizes = [
            np.linalg.norm(np.nan_to_num((one[name] - other[name]).values))
            / np.linalg.norm(np.nan_to_num(other[name].values))
            for one, other in pairs
        ]
        texts.append(f"{name} {max(sizes):.1e}")
    times = [[fs.find_events(history).displacement.overall for history in pair] for pair in pairs]
    moved = [abs(one - other) for one, other in times if one is not None and other is not None]
    return ", ".join([*texts, f"overall slip {1e3 * max(moved, default=float('nan')):.1e} ms"])


def compare(case, options):
    """Print what each variant of a case takes, and return it."""
    variants = CASES[case]()
    chosen = {name: variants[name] for name in options.alone or variants}
    for variant in chosen.values():
        if not variant.options.get("bases"):
            variant.run(5 * variant.models[0].time.step, options.threads)
    least: dict[str, dict[str, float]] = {name: {} for name in chosen}
    histories = {}
    for _ in range(options.repeat):
        for name, variant in chosen.items():
            histories[name], seconds = measured(variant, options.end, options.threads)
            least[name] = {key: min(value, least[name].get(key, value)) for key, value in seconds.items()}
    start, *others = chosen
    attrs = histories[start][0].attrs
    steps = sum(history.sizes["time"] - 1 for history in histories[start])
    sys.stdout.write(f"\n{case}: {attrs['n_degrees_of_freedom']} unknowns, {steps} steps\n\n")
    table("variant", "clock [s]", "CPU [s]", "a step [CPU ms]", *PARTS[:-1])
    for name, seconds in least.items():
        parts = [seconds[f"{part}, CPU [s]"] for part in PARTS]
        line(name, seconds["clock [s]"], seconds["CPU [s]"], 1e3 * parts[-1] / steps, *parts[:-1], digits=3)
    for name in others:
        ratio = least[name]["CPU [s]"] / least[start]["CPU [s]"]
        counts = ", ".join(f"{key} {value:.3g}" for key in COUNTS if (value := histories[name][0].attrs.get(key)))
        sys.stdout.write(f"{name} over {start}: {ratio:.2f} of the CPU; {counts}\n")
        sys.stdout.write(f"  {differences(histories[name], histories[start])}\n")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    sys.stdout.write(f"largest memory so far {memory:.2f} GB\n")
    return {f"{name}, {key}": round(value, 3) for name, seconds in least.items() for key, value in seconds.items()}


def main():
    parser = options_of(__doc__, writes=True)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=["section", "frictions", "solid"])
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--end", type=float, help="end of the runs [s]")
    parser.add_argument("--threads", type=int)
    parser.add_argument("--alone", nargs=1, metavar="VARIANT")
    options = parser.parse_args()
    before = reference("benchmark_large_strain")
    for case in options.cases:
        numbers = compare(case, options)
        for name, value in before.get(case, {}).items():
            if name in numbers and options.end is None:
                sys.stdout.write(f"{name}: {numbers[name]:.2f}, before {value:.2f}\n")
        sys.stdout.flush()
        write(options.write, {case: numbers})


if __name__ == "__main__":
    main()
