"""The studies that are compared with published values, run or read back, and the numbers of their runs."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.results import HISTORY, RunResult, StudyResult
from fingerslip.study.convergence import converge, level_folders
from fingerslip.study.definition.runs import plan_studies, plan_study
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import run_plans
from fingerslip.study.storage.store import read_run
from fingerslip.validation.measures import Measures, measure, measure_3d

TABLE2 = "wang2014_table2"
FORMULATION = "wang2014_formulation"
SECTION = "wang2014_section"
SOLID = "wang2014_3d"
LARGE_STRAIN = "finite_strain"

#: Names of the shipped studies that `validate` runs.
STUDIES = (TABLE2, "wang2014_friction", "wang2014_fingerprint", FORMULATION, SECTION, SOLID, LARGE_STRAIN)
# How their runs are measured: a section, or a fingertip in 3D.
_READERS: Mapping[str, Callable[..., Measures]] = dict.fromkeys(STUDIES, measure) | {SOLID: measure_3d}
# The value that runs at large strain have in their study.
_FINITE: Mapping[str, object] = {"kinematics": "finite"}
#: What it refines for the uncertainties: studies, and the value that their runs have.
REFINED: Mapping[str, Mapping[str, object]] = {
    TABLE2: {},
    FORMULATION: {"fingertip.formulation": "plane_strain"},
    SECTION: {"fingertip.section": "transverse"},
    SOLID: {},
    LARGE_STRAIN: _FINITE,
}
VARIANT = "fingertip.phalanx.variant"
FINGERPRINT = "fingertip.fingerprint.enabled"
FRICTION = "contact.friction_coefficient"
VARIANTS = ("original", "flattened", "scaled")


@dataclass(frozen=True)
class Evidence:
    """The numbers of the runs of the studies."""

    measured: Mapping[str, tuple[Measures, ...]]  # the runs by name of the study
    # the runs of Table 2 once more, with another mesh, step, contact stiffness or numerical damping in each tuple
    refined: tuple[tuple[Measures, ...], ...] = ()
    refined_solid: tuple[Measures, ...] = ()  # the same for the fingertip in 3D
    refined_large_strain: tuple[tuple[Measures, ...], ...] = ()  # the same for the section of Table 2 at large strain

    def select(self, study: str, conditions: Mapping[str, object]) -> tuple[Measures, ...]:
        """Return the runs of a study whose values, by dotted path, are these."""
        return tuple(run for run in self.measured[study] if _meets(run.run.all_values, conditions))

    def one(self, study: str, conditions: Mapping[str, object]) -> Measures:
        """Return the one run of a study whose values are these."""
        runs = self.select(study, conditions)
        if len(runs) != 1:
            wanted = ", ".join(f"{path} = {value}" for path, value in conditions.items())
            raise InputError(study, f"has {len(runs)} runs with {wanted}", "needs one of them", "use the shipped study")
        return runs[0]

    def phalanges(self, study: str, conditions: Mapping[str, object] | None = None) -> tuple[Measures, ...]:
        """Return the runs with the original, the flattened and the scaled phalanx, in this order."""
        return tuple(self.one(study, {VARIANT: variant, **(conditions or {})}) for variant in VARIANTS)

    def at_large_strain(self) -> Evidence:
        """Return the runs at large strain and their refinements in the place of those of Table 2."""
        return Evidence({TABLE2: self.select(LARGE_STRAIN, _FINITE)}, self.refined_large_strain)

    def spread_of(self, check: Callable[[Evidence], float | tuple[int, int] | None]) -> float | None:
        """Return largest less smallest of what `check` gives for Table 2 over all refinements; None without them.

        Counts before and after count as their difference.
        """
        everything = (self.measured[TABLE2], *self.refined) if self.refined else ()
        outcomes = [check(Evidence({TABLE2: runs})) for runs in everything]
        numbers = [float(entry[0] - entry[1]) if isinstance(entry, tuple) else entry for entry in outcomes]
        finite = [number for number in numbers if number is not None]
        return max(finite) - min(finite) if finite and len(finite) == len(numbers) else None


@dataclass(frozen=True)
class Work:
    """Where shipped studies are read and their results are kept, and how they are computed."""

    studies: Path = Path("studies")
    results: Path = Path("results")
    workers: int = 2
    progress: StudyProgress | None = None

    def file(self, name: str) -> Path:
        """Return the file of a study."""
        path = self.studies / f"{name}.yaml"
        if not path.is_file():
            repair = "name the folder of the shipped studies, or run in the folder of the project"
            raise InputError(str(path), "is not there", f"validate needs the study {name}", repair)
        return path

    def run(self, names: Iterable[str]) -> tuple[StudyResult, ...]:
        """Run studies, as far as they are not finished."""
        plans = plan_studies([self.file(name) for name in names], self.results)
        return run_plans(plans, workers=self.workers, progress=self.progress)


def gather(work: Work) -> Evidence:
    """Run and refine the shipped studies, as far as they are not finished, and measure all runs."""
    paths = {name: work.file(name) for name in STUDIES}
    for name, conditions in REFINED.items():
        chosen = [run.name for run in plan_study(paths[name], work.results).runs if _meets(run.swept, conditions)]
        converge(paths[name], results_dir=work.results, only=chosen, workers=work.workers, progress=work.progress)
    measured = {
        name: tuple(measure_folder(outcome.folder / run.name, run, _READERS[name]) for run in outcome.runs)
        for name, outcome in zip(STUDIES, work.run(STUDIES), strict=True)
    }
    section, solid, large_strain = (_measure_levels(name, work) for name in (TABLE2, SOLID, LARGE_STRAIN))
    return Evidence(measured, section, tuple(measures for (measures,) in solid), large_strain)


def _measure_levels(name: str, work: Work) -> tuple[tuple[Measures, ...], ...]:
    """Measure the refined runs of a study, level by level."""
    path, read = work.file(name), _READERS[name]
    chosen = [_meets(run.swept, REFINED[name]) for run in plan_study(path, work.results).runs]
    return tuple(
        tuple(measure_folder(folder, read_run(folder), read) for folder in itertools.compress(folders, chosen))
        for folders in level_folders(path, work.results).values()
    )


def measure_folder(folder: Path, run: RunResult, read: Callable[..., Measures]) -> Measures:
    """Measure a run from the history in its folder: a section by `measure`, a fingertip in 3D by `measure_3d`."""
    return read(run, read_history(folder / HISTORY))


def _meets(values: Mapping[str, object], conditions: Mapping[str, object]) -> bool:
    return all(values.get(path) == value for path, value in conditions.items())
