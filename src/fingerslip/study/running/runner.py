"""Running studies: every run is checked before the first is computed, none is computed twice or left half done."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from fingerslip.errors import DamagedError, FingerslipError, InputError, ResultError
from fingerslip.parameters.dotted import flatten
from fingerslip.parameters.schema import require_kind
from fingerslip.results import RefusedRun, RunResult, StudyResult, stored_result
from fingerslip.storage.files import check_folder, clean_stale, remove_empty
from fingerslip.study.convergence.storage import read_uncertainties
from fingerslip.study.definition.derived import derived_of
from fingerslip.study.definition.sweep import Run
from fingerslip.study.running.jobs import Computed, Job, Prepared
from fingerslip.study.running.plan import Plan, plan_studies
from fingerslip.study.running.progress import SilentProgress, StudyProgress
from fingerslip.study.storage.films import film_keys
from fingerslip.study.storage.reporting import REPORT, report_key, write_report
from fingerslip.study.storage.summary import read_manifest, refused_in, write_manifest, write_sensitivity, write_summary

if TYPE_CHECKING:
    from fingerslip.report.page.content import RunPictures
    from fingerslip.study.running.pictures import Drawing

__all__ = [
    "StudyFailedError",
    "StudyResult",
    "compute_jobs",
    "run_plans",
    "run_studies",
    "run_study",
    "write_up",
]


Engine: TypeAlias = "Callable[[Sequence[Job], StudyProgress, Mapping[str, Drawing] | None], Computed]"


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
    it stopped. Nothing is written before all inputs are checked.

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
    return run_studies(
        [path], results_dir=results_dir, workers=workers, force=force, progress=progress, scheduler=scheduler
    )[0]


def run_studies(
    paths: Sequence[str | Path],
    *,
    results_dir: str | Path = "results",
    workers: int = 2,
    force: bool = False,
    progress: StudyProgress | None = None,
    scheduler: str | None = None,
) -> tuple[StudyResult, ...]:
    """Run several studies, one after the other, after all of them are checked; see :func:`run_study`."""
    for path in paths:
        require_kind(path, (str, os.PathLike), "the path of a study file", "study")
    _require_workers(workers)
    plans = plan_studies(paths, results_dir)
    return run_plans(plans, workers=workers, force=force, progress=progress, scheduler=scheduler)


def _require_workers(workers: int) -> None:
    if not isinstance(workers, int) or workers < 1:
        raise InputError("workers", f"got {workers!r}", "needs a number >= 1")


def run_plans(
    plans: Sequence[Plan],
    *,
    workers: int = 2,
    force: bool = False,
    progress: StudyProgress | None = None,
    scheduler: str | None = None,
) -> tuple[StudyResult, ...]:
    """Run studies that are planned already; see :func:`run_study`."""
    _require_workers(workers)
    for plan in plans:
        check_folder(plan.folder.parent)
        check_folder(plan.folder)
    finished = [{} if force else plan.finished_runs() for plan in plans]
    prepared = [
        _prepare(plan, [run for run in plan.runs if run.name not in stored])
        for plan, stored in zip(plans, finished, strict=True)
    ]
    with progress or SilentProgress() as reporter:
        engine = _engine(workers, scheduler)
        outcomes = [_execute(plan, todo, engine, reporter) for plan, todo in zip(plans, prepared, strict=True)]
    results = tuple(result for result, _ in outcomes)
    errors = {name: error for _, failures in outcomes for name, error in failures.items()}
    if errors:
        raise StudyFailedError(errors, results)
    return results


def _prepare(plan: Plan, runs: Sequence[Run]) -> Prepared:
    """Build and check what is to be computed; where nothing is, nothing that does so is loaded."""
    if not runs:
        return Prepared((), plan.refused)
    from fingerslip.study.running.prepare import prepare_samples

    return prepare_samples(plan, runs)


def _engine(workers: int, scheduler: str | None) -> Engine:
    """Return what computes jobs: local processes, or the workers of a Dask scheduler."""
    if scheduler is None:
        return functools.partial(_compute_here, workers)
    return functools.partial(_compute_there, scheduler)


def _compute_here(
    workers: int, jobs: Sequence[Job], progress: StudyProgress, drawings: Mapping[str, Drawing] | None
) -> Computed:
    from fingerslip.study.running.compiling import compile_ahead
    from fingerslip.study.running.pool import compute_all

    compile_ahead([job.model for job in jobs], progress)
    return compute_all(jobs, workers, progress, drawings)


def _compute_there(
    scheduler: str, jobs: Sequence[Job], progress: StudyProgress, _: Mapping[str, Drawing] | None
) -> Computed:
    from fingerslip.study.running.cluster import compute_on_cluster

    return Computed(compute_on_cluster(jobs, scheduler, progress))


def _drawings(plan: Plan, jobs: Sequence[Job]) -> Mapping[str, Drawing]:
    """Return what to draw of runs that are to be computed."""
    if not jobs:
        return {}
    from fingerslip.study.running.pictures import drawings_of

    return drawings_of(plan, jobs)


def _film(plan: Plan, progress: StudyProgress) -> dict[str, FingerslipError]:
    """Film the finished runs; see :func:`~fingerslip.study.running.pictures.film_runs`."""
    if not plan.study.cameras:
        return {}
    # Cameras and tracker are slow to import, and few studies have any.
    from fingerslip.study.running.pictures import film_runs

    return film_runs(plan, progress)


def _execute(
    plan: Plan, prepared: Prepared, engine: Engine, progress: StudyProgress
) -> tuple[StudyResult, dict[str, FingerslipError]]:
    """Compute what is to be computed of one study, and write it up."""
    jobs, refused = prepared.jobs, prepared.refused
    to_compute = tuple(job.run.name for job in jobs)
    left_out = {*to_compute, *(sample.name for sample in refused)}
    unchanged = tuple(run.name for run in plan.runs if run.name not in left_out)
    for sample in refused:
        progress.say(f"{plan.source.stem}/{sample.name}: refused: {sample.reason}")
    for name in unchanged:
        progress.say(f"{plan.source.stem}/{name}: unchanged")
    try:
        done = compute_jobs(plan, jobs, engine, progress, _drawings(plan, jobs))
    except KeyboardInterrupt:
        _write_tables(plan, plan.finished_runs(), refused, report="")
        raise
    failures = {**done.failures, **_film(plan, progress)}
    computed = tuple(name for name in to_compute if name not in done.failures)
    result = write_up(plan, refused, done.pictures, whole=(*computed, *unchanged))
    result = dataclasses.replace(result, computed=computed, unchanged=unchanged)
    return result, {f"{plan.source.stem}/{name}": error for name, error in failures.items()}


def compute_jobs(
    plan: Plan,
    jobs: Sequence[Job],
    engine: Engine | int,
    progress: StudyProgress,
    drawings: Mapping[str, Drawing] | None = None,
) -> Computed:
    """Compute jobs of a study; what is unfinished at the end is removed, also after Ctrl-C."""
    created = [folder for folder in (plan.folder, *plan.folder.parents) if not folder.exists()]
    clean_stale(plan.folder)
    if not jobs:
        return Computed()
    for job in jobs:
        _say_damage(plan, job, progress)
    try:
        compute = _engine(engine, None) if isinstance(engine, int) else engine
        return compute(jobs, progress, drawings)
    finally:
        clean_stale(plan.folder)
        remove_empty(*created)


def _say_damage(plan: Plan, job: Job, progress: StudyProgress) -> None:
    """Say that a run is computed again because its results are damaged."""
    try:
        stored_result(job.folder)
    except DamagedError as error:
        progress.say(f"{plan.source.stem}/{job.run.name}: {error.file} {error.found}; the run is computed again")
    except ResultError:  # there is nothing yet
        pass


def write_up(
    plan: Plan,
    refused: tuple[RefusedRun, ...] | None = None,
    pictures: Mapping[str, RunPictures] | None = None,
    whole: Collection[str] = (),
) -> StudyResult:
    """Write summary, report and manifest of the runs that are finished."""
    finished, manifest = plan.finished_runs(whole), read_manifest(plan.folder)
    refused = refused_in(manifest) if refused is None else refused
    identities = {name: plan.identities[name] for name in finished}
    uncertainties = read_uncertainties(plan.folder, identities)
    about = f"{plan.study.title}\n{plan.study.description}"
    films = film_keys(plan.folder, list(finished))
    key = report_key(about, plan.study.compare, identities, uncertainties, plan.given, films)
    current = manifest.get("report") == key and (plan.folder / REPORT).is_file()
    result = _write_tables(plan, finished, refused, report=key if current else "")
    if result.runs and not current:
        write_report(result, pictures)
        _write_tables(plan, finished, refused, report=key)
    return result


def _write_tables(
    plan: Plan, finished: Mapping[str, RunResult], refused: tuple[RefusedRun, ...], report: str
) -> StudyResult:
    uncertainties = read_uncertainties(plan.folder, plan.identities)
    runs = tuple(
        _complete(plan, run, finished[run.name], uncertainties.get(run.name, {}))
        for run in plan.runs
        if run.name in finished
    )
    sample = plan.study.sample
    ranges, design = (sample.ranges, sample.design) if sample else ({}, {})
    study = StudyResult(
        plan.folder,
        plan.study.compare,
        runs,
        title=plan.study.title,
        description=plan.study.description,
        ranges=ranges,
        refused=refused,
        design=design,
    )
    if runs:
        write_summary(study)
        if ranges:
            write_sensitivity(study)
        write_manifest(plan.source, study, report, given=plan.given)
    return study


def _complete(plan: Plan, run: Run, result: RunResult, uncertainty: Mapping[str, float]) -> RunResult:
    """Return the result of a run with its values, uncertainties and derived quantities."""
    completed = dataclasses.replace(result, values=flatten(run.plain_values()), uncertainty=uncertainty)
    return (
        dataclasses.replace(completed, derived=derived_of(plan.study.derived, completed))
        if plan.study.derived
        else completed
    )
