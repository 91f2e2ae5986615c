"""``fingerslip check``: whether studies can be run, how large their runs are and about how long they take."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fingerslip.dynamics.simulation import step_times
from fingerslip.fe.space import build_space
from fingerslip.model import Model
from fingerslip.report.tables.table import Column, Table
from fingerslip.study.running.plan import Plan, plan_studies
from fingerslip.study.running.runner import prepare

__all__ = ["check_studies", "estimated_seconds"]

# From the shipped studies alone, by the dimension of space. In the plane about 10,000 unknowns and 600 steps take 1.5
# to 3.4 s, two runs side by side; in space 19,000 unknowns and 300 steps 16 s, 73,000 unknowns 57 s, on two cores.
_SECONDS_AT_START = 1.0
_SECONDS_PER_UNKNOWN = {2: 0.0, 3: 2e-4}
_SECONDS_PER_UNKNOWN_AND_STEP = {2: 2.5e-7, 3: 2e-6}

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


def estimated_seconds(unknowns: int, steps: int, dim: int = 2) -> float:
    """Estimate how long the simulation of a run takes [s]; rough away from the size of the shipped studies.

    Parameters
    ----------
    unknowns : int
        Degrees of freedom.
    steps : int
        Time steps.
    dim : int, optional
        Dimension of space.
    """
    per_unknown = _SECONDS_PER_UNKNOWN[dim] + _SECONDS_PER_UNKNOWN_AND_STEP[dim] * steps
    return _SECONDS_AT_START + per_unknown * unknowns


def _rows(plan: Plan) -> list[tuple[str, str, str, int, int, float]]:
    finished = plan.finished()
    return [
        (plan.source.name, job.run.name, "finished" if job.run.name in finished else "to do", *_size(job.model))
        for job in prepare(plan, plan.runs)
    ]


def _size(model: Model) -> tuple[int, int, float]:
    unknowns, steps = build_space(model.mesh).n_dofs, step_times(model).size - 1
    return unknowns, steps, estimated_seconds(unknowns, steps, model.mesh.dim())
