"""Error bars: refining the runs of a study, and what their numbers approach."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingerslip.contact.states import OPEN
from fingerslip.errors import InputError, errors_at
from fingerslip.history import read_history
from fingerslip.model.model import Model
from fingerslip.model.programme import Slide
from fingerslip.parameters.dotted import is_below
from fingerslip.report.tables.compare import convergence_table, series_table
from fingerslip.results import HISTORY, RunResult, quantities, stored_result
from fingerslip.slip.front import facet_size
from fingerslip.storage.files import new_folder, write_text
from fingerslip.study.definition.runs import Plan, Run, plan_study
from fingerslip.study.definition.spec import Study
from fingerslip.study.running.cost import require_mesh_memory
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import Engine, StudyFailedError, compute_jobs, run_plans, write_up
from fingerslip.study.storage.store import CONVERGENCE, RunConvergence, read_convergences, write_convergences
from fingerslip.tables.table import Table, to_csv
from fingerslip.uncertainty import Convergence, Series
from fingerslip.units import millimetres


@dataclass(frozen=True)
class Level:
    """One change of one setting."""

    setting: str  # what is changed
    value: float  # factor on element sizes, time step or contact stiffness

    @property
    def label(self) -> str:
        """Its name in folders and tables."""
        return f"{self.setting}-{self.value:g}"


def levels_of(study: Study) -> tuple[Level, ...]:
    """Return the levels that a study asks for and can have; :func:`refinement_warnings` says what it cannot have."""
    applies: Mapping[str, Callable[[float], bool]] = {
        "mesh": lambda factor: study.mesh.refined(factor) is not None,
        "step": lambda _: True,
        "penalty": lambda _: bool(study.all_contacts),
        "alpha": lambda value: study.time.scheme == "hht_alpha" and value != study.time.alpha,
    }
    asked = (Level(name, value) for name in applies for value in getattr(study.converge, name))
    return tuple(level for level in asked if applies[level.setting](level.value))


_LEFT_OUT: Mapping[str, str] = {
    "mesh": "the mesh is read or made of a scan, so there are no element sizes to change; read a finer one in a second"
    " study, and compare both with fingerslip report",
    "penalty": "nothing is in contact",
    "alpha": "without inertia there is no damping, and what is in use is no other value",
}


def refinement_warnings(plan: Plan) -> tuple[str, ...]:
    """Say which settings a study file asks to refine that its runs do not have."""
    refined = {level.setting for run in plan.runs for level in levels_of(run.study)}
    asked = [name for name in _LEFT_OUT if any(is_below(path, f"converge.{name}") for path in plan.given)]
    warnings = [
        f"converge.{name} is left out: {_LEFT_OUT[name]}"
        for name in asked
        if getattr(plan.study.converge, name) and name not in refined
    ]
    if "mesh" in asked:
        try:
            warnings += check_meshes(plan.runs)
        except InputError as error:
            warnings.append(f"converge.mesh: {error.found}, {error.allowed}; {error.repair}")
    return tuple(warnings)


# How much of a factor, in logarithms, edges at the contact follow at least; those of ridges follow 0.53 or nothing.
_FOLLOWED = 0.5


def contact_warning(edges: Mapping[float, float | None]) -> str:
    """Say which factor on element sizes leaves the edges of the contact [m] as they are; nothing where none does."""
    lengths = sorted((factor, edge) for factor, edge in edges.items() if edge)
    for (fine, finer), (coarse, coarser) in itertools.pairwise(lengths):
        if math.log(coarser / finer) < _FOLLOWED * math.log(coarse / fine):
            sizes = f"edges of {millimetres(finer, 2)} at the contact, and {coarse:g} has {millimetres(coarser, 2)}"
            repair = "write other factors" + ("" if 0.3333 in edges else ", such as [0.5, 0.3333]")
            return f"converge.mesh: factor {fine:g} has {sizes}: ± says nothing of the contact's; {repair}"
    return ""


def check_meshes(runs: Sequence[Run]) -> list[str]:
    """Refuse factors on element sizes that ridges or the memory do not allow; say which leave the contact as it is."""
    warnings = {}
    for run in {run.mesh_key: run for run in reversed(runs)}.values():
        with errors_at(run.where):
            edges = {1.0: run.study.mesh.contact_spacing(run.specimen)}
        for factor in run.study.converge.mesh:
            source = run.study.mesh.refined(factor) or run.study.mesh
            try:
                require_mesh_memory(source, run.specimen)
            except InputError as error:
                fault = f"with {factor:g}, {error.where} {error.found}"
                raise InputError(f"{run.where}: converge.mesh", fault, error.allowed, "write other factors") from None
            edges[factor] = source.contact_spacing(run.specimen)
        warnings[contact_warning(edges)] = run
    return [*filter(None, warnings)]


def run_at(run: Run, level: Level, model: Model) -> Run:
    """Return a run with one setting changed, without snapshots and without reactions but the search for the latency."""
    study = run.study
    changes: dict[str, Any] = {
        "record": dataclasses.replace(study.record, snapshots_every=0.0),
        "reaction": study.reaction and study.reaction.without_trials(),
    }
    match level.setting:
        case "mesh":
            changes["mesh"] = study.mesh.refined(level.value)
        case "step":
            changes["time"] = study.time.refined(level.value)
        case "alpha":
            changes["time"] = dataclasses.replace(study.time, alpha=level.value)
        case _:
            from fingerslip.dynamics.system.checks import contact_penalties

            stiffer = []
            for settings, contact in zip(study.all_contacts, model.contacts, strict=True):
                normal, tangential = (level.value * penalty for penalty in contact_penalties(model, contact))
                stiffer.append(dataclasses.replace(settings, normal_penalty=normal, tangential_penalty=tangential))
            changes |= {"contacts": tuple(stiffer)} if study.contact is None else {"contact": stiffer[0]}
    name, where = f"{run.name}_{level.label}", f"{run.where} at {level.label}"
    return dataclasses.replace(run, name=name, where=where, study=dataclasses.replace(study, **changes))


@dataclass(frozen=True)
class StudyConvergence:
    """The convergence of a study."""

    folder: Path  # folder of the results of the study
    runs: tuple[RunConvergence, ...]  # the runs that were refined
    warnings: tuple[str, ...] = ()  # what the study asks to refine and does not have

    @property
    def tables(self) -> tuple[Table, ...]:
        """A table for each run."""
        said = "\n".join(f"WARNING: {warning}." for warning in self.warnings)
        tables = (convergence_table(convergence.quantities, convergence.run) for convergence in self.runs)
        return tuple(dataclasses.replace(table, note=f"{table.note}\n{said}".rstrip()) for table in tables)

    @property
    def figures(self) -> Path:
        """Folder of the figures."""
        return self.folder / CONVERGENCE / "figures"


def converge(
    path: str | Path,
    *,
    results_dir: str | Path = "results",
    only: Sequence[str] = (),
    workers: int = 2,
    progress: StudyProgress | None = None,
) -> StudyConvergence:
    """Run a study, repeat its runs with one setting changed at a time, and find the uncertainty of every result."""
    reporter = progress or StudyProgress()
    plan = plan_study(path, results_dir)
    names = [run.name for run in plan.runs]
    for name in only:
        if name not in names:
            raise InputError(str(plan.source), f"has no run '{name}'", f"has {', '.join(names)}")
    runs = [run for run in plan.runs if not only or run.name in only]
    warnings = dict.fromkeys((*check_meshes(runs), *refinement_warnings(plan)))
    for warning in warnings:
        reporter.say(f"WARNING: {warning}.")
    run_plans([plan], workers=workers, progress=reporter)
    from fingerslip.study.running.build import prepare

    jobs = prepare(plan, runs)
    levels = [{level: run_at(job.run, level, job.model) for level in levels_of(job.run.study)} for job in jobs]
    _compute(plan, [run for of_run in levels for run in of_run.values()], workers, reporter)
    new = {}
    for job, of_run in zip(jobs, levels, strict=True):
        warning = contact_warning(_contact_edges(plan, job.run, of_run))
        new[job.run.name] = _run_convergence(plan, job.run, of_run, "bulk" if warning else "mesh")
        if warning and warning not in warnings:
            reporter.say(f"WARNING: {warning}.")
            warnings[warning] = None
    convergences = {**read_convergences(plan.folder, plan.identities), **new}
    write_convergences(plan.folder, convergences)
    result = StudyConvergence(plan.folder, tuple(new.values()), tuple(warnings))
    from fingerslip.report.figures.study import convergence_figure
    from fingerslip.report.figures.style import save_figure

    table = series_table({name: convergence.quantities for name, convergence in convergences.items()})
    write_text(plan.folder / CONVERGENCE / "convergence.csv", to_csv(table))
    with new_folder(result.figures) as figures:
        for name, convergence in convergences.items():
            save_figure(convergence_figure(convergence.quantities, name), figures / f"{name}.png")
    write_up(plan)
    return result


def level_folders(path: str | Path, results_dir: str | Path) -> dict[Level, tuple[Path, ...]]:
    """Return where :func:`converge` keeps the repetitions of a study's runs: a folder for each run at each level."""
    plan = plan_study(path, results_dir)
    folder = plan.folder / CONVERGENCE
    return {level: tuple(folder / f"{run.name}_{level.label}" for run in plan.runs) for level in levels_of(plan.study)}


def _compute(plan: Plan, runs: Sequence[Run], workers: int, progress: StudyProgress) -> None:
    """Compute the repetitions of runs that are not finished."""
    from fingerslip.study.running.build import prepare

    plan = dataclasses.replace(plan, folder=plan.folder / CONVERGENCE, runs=tuple(runs))
    finished = plan.finished_runs()
    jobs = prepare(plan, [run for run in plan.runs if run.name not in finished])
    with progress:
        failures, _ = compute_jobs(plan, jobs, Engine(progress, workers))
    if failures:
        raise StudyFailedError({f"{plan.source.stem}/{name}": error for name, error in failures.items()}, ())


def _contact_edges(plan: Plan, run: Run, levels: Mapping[Level, Run]) -> dict[float, float]:
    """Return the edge [m] between nodes that touch, 0 where none does, by the factor on element sizes."""
    folders = {level.value: other.name for level, other in levels.items() if level.setting == "mesh"}
    edges = {}
    for factor, folder in ({1.0: f"../{run.name}"} | folders).items() if folders and run.study.all_contacts else ():
        history = read_history(plan.folder / CONVERGENCE / folder / HISTORY)
        touched = (history["contact_state"].values != OPEN).any(axis=0)
        edges[factor] = facet_size(history, touched.nonzero()[0])
    return edges


def _run_convergence(plan: Plan, run: Run, levels: Mapping[Level, Run], mesh: str) -> RunConvergence:
    """Read the numbers of a run and of its repetitions, and put them in series; `mesh` names that of element sizes."""
    base = stored_result(plan.folder / run.name)
    others = {level: stored_result(plan.folder / CONVERGENCE / other.name) for level, other in levels.items()}
    # Element sizes are fitted to ridges and outlines: two factors may give one mesh.
    hashes = {base.mesh_hash: "the study itself"}
    sizes = {}  # over that in use; of alpha its value
    for level, result in others.items():
        twin = hashes.setdefault(result.mesh_hash, level.label) if level.setting == "mesh" else level.label
        if twin != level.label:
            fault = f"factor {level.value:g} gives the same mesh as {twin}"
            raise InputError(f"{run.where}: converge.mesh", fault, "needs factors with meshes of their own")
        size = 1.0 / level.value if level.setting == "penalty" else level.value
        sizes[level] = result.mesh_size / base.mesh_size if level.setting == "mesh" else size
    numbers = {level: quantities(result) for level, result in others.items()}
    convergences = {}
    for key, quantity in quantities(base).items():
        series = {}
        for setting, group in itertools.groupby(others, lambda level: level.setting):
            of_setting, in_use = list(group), run.study.time.alpha if setting == "alpha" else 1.0
            values = quantity.value, *(numbers[level][key].value for level in of_setting)
            name = mesh if setting == "mesh" else setting
            series[name] = Series(name, (in_use, *(sizes[level] for level in of_setting)), values)
        resolution = _resolution(base, run.study, key, quantity.unit)
        convergences[key] = Convergence(quantity.label, quantity.unit, quantity.value, series, resolution)
    return RunConvergence(run.name, plan.identities[run.name], convergences)


def _resolution(run: RunResult, study: Study, key: str, unit: str) -> float:
    """Return half a step of the slide where a number is a time, what the plate travels in it where it is a travel."""
    half, latency = 0.5 * float(run.numbers.get("slide_step_s") or 0.0), run.events.latency
    if key.endswith("_travel_m"):
        if latency:
            return half * float(run.numbers.get("latency_travel_m") or 0.0) / latency
        programmes = (
            study.bodies[contact.rigid_body].programme if contact.rigid_body else contact.programme or study.programme
            for contact in study.all_contacts[:1]
        )
        return half * next((entry.speed for entry in itertools.chain(*programmes) if isinstance(entry, Slide)), 0.0)
    return half if unit == "s" else 0.0
