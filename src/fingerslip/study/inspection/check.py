"""``fingerslip check``: whether studies can be run, how large their runs are and about how long they take."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fingerslip.dynamics.simulation import step_times
from fingerslip.fe.space import build_space
from fingerslip.model import Model
from fingerslip.report.tables.table import Column, Table
from fingerslip.study.running.cost import estimated_seconds
from fingerslip.study.running.plan import Plan, plan_studies
from fingerslip.study.running.runner import prepare_samples

__all__ = ["check_studies"]

_COLUMNS = (
    Column("study"),
    Column("run"),
    Column("state"),
    Column("degrees of freedom"),
    Column("steps"),
    Column("estimated time", "s", 0),
)


def check_studies(paths: Sequence[str | Path], results_dir: str | Path = "results") -> Table:
    """Check studies, and estimate the size and time of every run.

    Parameters
    ----------
    paths : sequence of path
        Study files.
    results_dir : path, optional
        Folder of the results, in which finished runs are found.

    Returns
    -------
    Table
        A row for each run.

    Raises
    ------
    InputError
        For all mistakes in the files; where there are none, for the first model that cannot be built.
    """
    rows = [row for plan in plan_studies(paths, results_dir) for row in _rows(plan)]
    seconds = sum(float(row[-1]) for row in rows if row[2] == "to do")
    note = (
        f"{len(rows)} run{'s' * (len(rows) != 1)}, about {max(seconds / 60, 0.1):.1f} min of computing in one process."
    )
    return Table("Checked: no mistakes found", _COLUMNS, tuple(rows), note)


def _rows(plan: Plan) -> list[tuple[str, str, str, int, int, float]]:
    finished = plan.finished()
    prepared = prepare_samples(plan, plan.runs)
    return [
        *(
            (plan.source.name, job.run.name, "finished" if job.run.name in finished else "to do", *_size(job.model))
            for job in prepared.jobs
        ),
        *((plan.source.name, sample.name, f"refused: {sample.reason}", 0, 0, 0.0) for sample in prepared.refused),
    ]


def _size(model: Model) -> tuple[int, int, float]:
    unknowns, steps = build_space(model.mesh).n_dofs, step_times(model).size - 1
    return unknowns, steps, estimated_seconds(unknowns, steps, model.mesh.dim(), model.kinematics)
