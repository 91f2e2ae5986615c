"""Running studies: every run is checked before the first is computed, none is computed twice or left half done."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import shutil
from collections.abc import Collection, Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fingerslip.errors import DamagedError, FingerslipError, InputError, ResultError
from fingerslip.parameters.dotted import flatten
from fingerslip.parameters.schema import require_kind
from fingerslip.results import SUMMARY, RefusedRun, StudyResult, failure_folder, result_mapping, stored_result
from fingerslip.storage.files import check_folder, clean_stale, digest, remove_empty, write_bytes, writing
from fingerslip.study.definition.expressions import derive
from fingerslip.study.definition.runs import Plan, plan_studies
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.storage import reporting
from fingerslip.study.storage.reporting import REPORT, film_keys
from fingerslip.study.storage.store import read_convergences, read_manifest, refused_in, with_convergence, write_results

if TYPE_CHECKING:
    from fingerslip.report.content import RunPictures
    from fingerslip.study.running.build import Job
    from fingerslip.study.running.compute import Drawing, Outcome


class StudyFailedError(FingerslipError):
    """Some runs failed; the others are finished.

    Parameters
    ----------
    errors : mapping of str to FingerslipError
        The error of each run that failed, by study and run.
    results : tuple of StudyResult
        The results of the other runs.
    """

    def __init__(self, errors: Mapping[str, FingerslipError], results: tuple[StudyResult, ...]) -> None:
        self.errors, self.results = dict(errors), results
        super().__init__(self.errors, results)

    def __str__(self) -> str:
        total = len(self.errors) + sum(len(result.computed) + len(result.unchanged) for result in self.results)
        names: dict[str, list[str]] = {}
        for name, error in self.errors.items():
            names.setdefault(str(error), []).append(name)
        lines = [f"{', '.join(same)}: {text}" for text, same in names.items()]
        if len(self.errors) < total:
            lines.append(f"{len(self.errors)} of {total} runs failed, the others are finished")
        return "\n".join(lines)


def run_study(
    path: str | Path,
    *,
    results_dir: str | Path = "results",
    workers: int = 2,
    force: bool = False,
    progress: StudyProgress | None = None,
    scheduler: str | None = None,
) -> StudyResult:
    """Run a study.

    Runs that are finished with the same inputs are not computed again, so an interrupted study continues where
    it stopped. Nothing is written before all inputs are checked. Warnings say what is doubtful in a model, or too
    coarse for the times of slip.

    Parameters
    ----------
    path : path
        The study file.
    results_dir : path, optional
        Folder that holds a folder for each study, named like its file.
    workers : int, optional
        Number of cores: so many runs are computed at once, each in its own process, or one large run on all.
    force : bool, optional
        Compute finished runs again too.
    progress : StudyProgress, optional
        Receives the progress of the study; without it nothing is shown.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://host:8786``, whose workers compute instead of local processes.

    Returns
    -------
    StudyResult
        Where the results are, and the events of all runs.

    Raises
    ------
    InputError
        For all mistakes in the study, before anything is written.
    StudyFailedError
        Where runs failed, after the others are finished.
    ResultError
        Where results cannot be written.
    """
    require_kind(path, (str, os.PathLike), "the path of a study file", "study")
    plans = plan_studies([path], results_dir)
    (result,) = run_plans(plans, workers=workers, force=force, progress=progress, scheduler=scheduler)
    reporting.warn_of_doubts(result)
    return result


def run_plans(
    plans: Sequence[Plan],
    *,
    workers: int = 2,
    force: bool = False,
    progress: StudyProgress | None = None,
    scheduler: str | None = None,
) -> tuple[StudyResult, ...]:
    """Run studies that are planned, one after the other, after all of them are checked; see :func:`run_study`."""
    if not isinstance(workers, int) or workers < 1:
        raise InputError("workers", f"got {workers!r}", "needs a number >= 1")
    for plan in plans:
        check_folder(plan.folder.parent)
        check_folder(plan.folder)
    to_compute = []
    for plan in plans:
        finished = {} if force else plan.finished_runs()
        to_compute.append([run for run in plan.runs if run.name not in finished])
    if scheduler is None and workers > 1 and max(map(len, to_compute), default=0) > 1:
        # Workers load what they need while meshes are made.
        from fingerslip.study.running.compute import prepare_workers

        prepare_workers()
    prepared: list[tuple[tuple[Job, ...], tuple[RefusedRun, ...]]] = [((), plan.refused) for plan in plans]
    for number, runs in enumerate(to_compute):
        if runs:  # where there are none, nothing that builds them is loaded
            from fingerslip.study.running.build import prepare_samples

            prepared[number] = prepare_samples(plans[number], runs)
    with progress or StudyProgress() as reporter:
        engine = Engine(reporter, workers, scheduler, force=force)
        outcomes = [_execute(plan, *todo, engine) for plan, todo in zip(plans, prepared, strict=True)]
    results = tuple(result for result, _ in outcomes)
    errors = {name: error for _, failures in outcomes for name, error in failures.items()}
    if errors:
        raise StudyFailedError(errors, results)
    return results


@dataclass(frozen=True)
class Engine:
    """What computes jobs: local processes, or the workers of a Dask scheduler."""

    progress: StudyProgress  # receives the progress
    workers: int  # number of cores
    scheduler: str | None = None  # address of the scheduler
    force: bool = False  # whether runs are computed again, whatever their folders hold

    def compute(self, jobs: Sequence[Job], drawings: Mapping[str, Drawing]) -> Generator[Outcome, None, None]:
        """Compute jobs, and yield what became of each group of them."""
        if self.scheduler is not None:
            from fingerslip.study.running.cluster import compute_on_cluster

            return compute_on_cluster(jobs, self.scheduler, self.progress)
        from fingerslip.study.running.compute import compute_all
        from fingerslip.study.running.cost import compile_ahead

        compile_ahead([job.model for job in jobs], self.progress)
        return compute_all(jobs, self.workers, self.progress, drawings)


def _execute(
    plan: Plan, jobs: Sequence[Job], refused: tuple[RefusedRun, ...], engine: Engine
) -> tuple[StudyResult, dict[str, FingerslipError]]:
    """Compute what is to be computed of one study, and write it up."""
    progress, stem = engine.progress, plan.source.stem
    to_compute = tuple(job.run.name for job in jobs)
    left_out = {*to_compute, *(sample.name for sample in refused)}
    unchanged = tuple(run.name for run in plan.runs if run.name not in left_out)
    for sample in refused:
        progress.say(f"{stem}/{sample.name}: refused: {sample.reason}")
    for name in unchanged:
        progress.say(f"{stem}/{name}: unchanged")
    drawings: Mapping[str, Drawing] = {}
    if jobs:  # what draws and films is slow to import
        from fingerslip.study.running.compute import drawings_of

        drawings = drawings_of(plan, jobs)
    try:
        failures, pictures = compute_jobs(plan, jobs, engine, drawings)
    except KeyboardInterrupt:
        stopped = _study_result(plan, refused)
        count = f"{len(stopped.runs)} of {len(plan.runs)} runs are finished and kept"
        progress.say(f"{stem}: {count}; those that share a matrix finish together")
        if stopped.runs:
            write_results(plan.source, stopped, "", plan.given)
        raise
    computed = tuple(name for name in to_compute if name not in failures)
    if plan.study.cameras:
        from fingerslip.study.running.films import film_runs

        failures |= film_runs(plan, progress)
    result = write_up(plan, refused, pictures, whole=(*computed, *unchanged))
    result = dataclasses.replace(result, computed=computed, unchanged=unchanged)
    return result, {f"{stem}/{name}": error for name, error in failures.items()}


def compute_jobs(
    plan: Plan, jobs: Sequence[Job], engine: Engine, drawings: Mapping[str, Drawing] | None = None
) -> tuple[dict[str, FingerslipError], dict[str, RunPictures]]:
    """Compute jobs of a study, and return what went wrong and what was drawn; what is unfinished is removed."""
    created = [folder for folder in (plan.folder, *plan.folder.parents) if not folder.exists()]
    clean_stale(plan.folder)
    for run in (*plan.runs, *(job.run for job in jobs)):  # where a run is computed, the file may not be there
        _ = run.written_values
    mesh_files = {name: file for run in plan.runs for name, file in run.mesh_files.items()}
    # What they hold while it is what the runs have, by the names of copies to come.
    copies = {name: file.read_bytes() for name, file in mesh_files.items() if not (plan.folder / name).exists()}
    failures: dict[str, FingerslipError] = {}
    pictures: dict[str, RunPictures] = {}
    for job in jobs:
        shutil.rmtree(failure_folder(job.folder), ignore_errors=True)
    for job in () if engine.force else jobs:
        try:
            stored_result(job.folder)
        except DamagedError as error:
            engine.progress.say(
                f"{plan.source.stem}/{job.run.name}: {error.file} {error.found}; the run is computed again"
            )
        except ResultError:  # there is nothing yet
            pass
    try:
        if jobs:
            with contextlib.closing(engine.compute(jobs, drawings or {})) as outcomes:
                engine.progress.begin([job.run.name for job in jobs])
                for outcome in outcomes:
                    failures |= _report(outcome, engine.progress)
                    pictures |= outcome.pictures
    finally:
        clean_stale(plan.folder)
        for run in plan.runs:
            for name in run.mesh_files.keys() & copies.keys() if (plan.folder / run.name).is_dir() else ():
                with writing(plan.folder):
                    (plan.folder / name).parent.mkdir(parents=True, exist_ok=True)
                write_bytes(plan.folder / name, copies.pop(name))
        remove_empty(*created)
    return failures, pictures


def _report(outcome: Outcome, progress: StudyProgress) -> dict[str, FingerslipError]:
    """Report jobs as done or failed, and return their errors."""
    failures = {}
    for job in outcome.jobs:
        error = outcome.errors.get(job.run.name)
        if isinstance(error, MemoryError):
            error = ResultError(f"{job.run.where}: not enough memory; use larger elements or --workers 1")
        if isinstance(error, FingerslipError):
            failures[job.run.name] = error
        if (failure := failure_folder(job.folder)).is_dir():
            progress.say(f"{job.run.name}: what was computed until it failed is in {failure}")
        progress.finish(job.run.name, "failed" if error else "done")
    return failures


def write_up(
    plan: Plan,
    refused: tuple[RefusedRun, ...] | None = None,
    pictures: Mapping[str, RunPictures] | None = None,
    whole: Collection[str] = (),
) -> StudyResult:
    """Write summary, report and manifest of the runs that are finished; `whole` names those that need no check."""
    manifest = read_manifest(plan.folder)
    study = _study_result(plan, refused_in(manifest) if refused is None else refused, whole)
    if not study.runs:
        return study
    uncertainties = {run.name: dict(run.uncertainty) for run in study.runs if run.convergence}
    about, films = f"{study.title}\n{study.description}", film_keys(study.folder, [run.name for run in study.runs])
    # All that a report shows: an unchanged one is not made again.
    results = [result_mapping(run) for run in study.runs]
    of_fit = [path.read_text(encoding="utf-8") for path in [study.folder / SUMMARY] if path.is_file()]
    key = digest([about, list(study.compare), results, uncertainties, list(plan.given), films, *of_fit])
    current = manifest.get("report") == key and (plan.folder / REPORT).is_file()
    write_results(plan.source, study, key if current else "", plan.given)
    if not current:
        write_report(study, pictures)
        write_results(plan.source, study, key, plan.given)
    return study


def write_report(study: StudyResult, pictures: Mapping[str, RunPictures] | None = None) -> None:
    """Make figures and page of a study; where workers drew its runs, so does one that has loaded what draws."""
    if any(drawn.process != os.getpid() for drawn in (pictures or {}).values()):
        from fingerslip.study.running.compute import in_worker

        in_worker(reporting.write_report, study, pictures)
    else:
        reporting.write_report(study, pictures)


def _study_result(plan: Plan, refused: tuple[RefusedRun, ...], whole: Collection[str] = ()) -> StudyResult:
    """Return the runs of a study that are finished, with their uncertainties and derived quantities."""
    finished, sample = plan.finished_runs(whole), plan.study.sample
    convergences = read_convergences(plan.folder, plan.identities)
    runs = []
    for run in (run for run in plan.runs if run.name in finished):
        result = with_convergence(finished[run.name], convergences.get(run.name))
        result = dataclasses.replace(result, values=flatten(run.written_values))
        derived = {name: derive(name, text, result) for name, text in plan.study.derived.items()}
        runs.append(dataclasses.replace(result, derived=derived))
    return StudyResult(
        plan.folder,
        plan.study.compare,
        tuple(runs),
        title=plan.study.title,
        description=plan.study.description,
        ranges=sample.ranges if sample else {},
        refused=refused,
        design=sample.design if sample else {},
    )
