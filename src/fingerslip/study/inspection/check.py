"""``fingerslip check``: whether studies can be run, how large their runs are and about how long they take."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from fingerslip.dynamics.recording.steps import record_bytes, step_times
from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.fe.space import build_space
from fingerslip.model.model import Model
from fingerslip.model.timing import Adaptive, Timing
from fingerslip.study.running.compiling import compiling_seconds
from fingerslip.study.running.cost import estimated_seconds, process_bytes
from fingerslip.study.running.plan import Job, Plan, groups, plan_studies
from fingerslip.study.running.prepare import prepare_samples
from fingerslip.tables.table import Column, Table

__all__ = ["check_plans", "check_studies"]

_Row: TypeAlias = tuple[str, str, str, int, int, int | str, float]

_COLUMNS = (
    Column("study"),
    Column("run"),
    Column("state"),
    Column("degrees of freedom"),
    Column("records"),
    Column("steps"),
    Column("estimated time", "s", 0),
)
_CONTROLLED = (
    " With step: auto the number of steps is known only afterwards. 'At least' means one for each record, two where"
    " quasi-static, and the time is that of so many."
)


def check_studies(paths: Sequence[str | Path], results_dir: str | Path = "results") -> Table:
    """Check studies, and estimate the size and time of every run."""
    return check_plans(plan_studies(paths, results_dir))


def check_plans(plans: Sequence[Plan]) -> Table:
    """Check studies that are planned already; see :func:`check_studies`."""
    checked_plans = [_check_plan(plan) for plan in plans]
    rows = [row for entry, _, _ in checked_plans for row in entry]
    jobs_together = [part for _, entry, _ in checked_plans for part in groups(entry)]
    warnings = list(dict.fromkeys(warning for _, _, entry in checked_plans for warning in entry))
    title = "Checked: no mistakes found" + f", {len(warnings)} warning{'s' * (len(warnings) != 1)}" * bool(warnings)
    note = "".join((_note(rows, jobs_together), *(f" WARNING: {warning}." for warning in warnings)))
    return Table(title, _COLUMNS, tuple(rows), note)


def _note(rows: Sequence[_Row], job_groups: Sequence[Sequence[Job]]) -> str:
    seconds = sum(row[-1] for row in rows if row[2] == "to do")
    controlled = any(isinstance(row[-2], str) for row in rows)
    about = "at least" if any(isinstance(row[-2], str) and row[2] == "to do" for row in rows) else "about"
    runs = f"{len(rows)} run{'s' * (len(rows) != 1)}"
    note = f"{runs}, {about} {max(seconds / 60, 0.1):.1f} min of computing in one process."
    compiling = compiling_seconds(job.model for jobs in job_groups for job in jobs)
    first = f" Compiling comes first, once on this machine: about {compiling:.0f} s." * bool(compiling)
    return note + first + _of_groups(job_groups) + _CONTROLLED * controlled


def _of_groups(job_groups: Sequence[Sequence[Job]]) -> str:
    """Say what the groups of runs that are computed together need; nothing where nothing is to do."""
    if not job_groups:
        return ""
    largest, shared = max(map(_bytes, job_groups)) / 1e9, [len(part) for part in job_groups if len(part) > 1]
    memory = f" Each process takes about {largest:.1f} GB."
    if not shared:
        return memory
    matrices = f"{len(shared)} group{'s' * (len(shared) != 1)}"
    return f" {sum(shared)} of those to do are computed in {matrices} with one matrix each.{memory}"


def _bytes(jobs: Sequence[Job]) -> float:
    """Estimate the memory of a process that computes jobs together [bytes]."""
    model = jobs[0].model
    checked_model = inspect_model(model)
    candidates = sum(len(candidate.nodes) for candidate in checked_model.candidates)
    records = sum(
        record_bytes(job.model, checked_model.space.n_dofs // checked_model.space.dim, candidates) for job in jobs
    )
    return process_bytes(checked_model.space.n_dofs, records, checked_model.space.dim)


def _check_plan(plan: Plan) -> tuple[list[_Row], list[Job], list[str]]:
    """Return a row for each run, the jobs that are to do, and what is doubtful in the models."""
    finished = plan.finished_runs()
    prepared = prepare_samples(plan, plan.runs)
    rows: list[_Row] = [
        *(
            (plan.source.name, job.run.name, "finished" if job.run.name in finished else "to do", *_size(job.model))
            for job in prepared.jobs
        ),
        *((plan.source.name, sample.name, f"refused: {sample.reason}", 0, 0, 0, 0.0) for sample in prepared.refused),
    ]
    warnings = [f"{plan.source.name}: {doubt}" for job in prepared.jobs for doubt in job.doubts]
    return rows, [job for job in prepared.jobs if job.run.name not in finished], warnings


def _size(model: Model) -> tuple[int, int, int | str, float]:
    """Return the unknowns, records behind the start, steps (in words where the error decides) and seconds of a run."""
    unknowns, records = build_space(model.mesh).n_dofs, step_times(model).size - 1
    steps = records * _steps_to_a_record(model.time)
    count = f"at least {steps:,}" if isinstance(model.time, Adaptive) else steps
    return unknowns, records, count, estimated_seconds(unknowns, steps, model.mesh.dim(), model.kinematics)


def _steps_to_a_record(time: Timing) -> int:
    """Return the fewest steps from record to record: steps that control their error are halved where quasi-static."""
    return 2 if isinstance(time, Adaptive) and time.scheme == "quasi_static" else 1
