"""Runs that are ready to be computed, which of them are computed together, and what became of them.

Nothing here loads what builds, computes or draws runs: a study that is finished needs none of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from fingerslip.dynamics.step.sharing import groups_to_share
from fingerslip.errors import FingerslipError
from fingerslip.model.model import Model
from fingerslip.results import RefusedRun
from fingerslip.study.definition.sweep import Run
from fingerslip.study.running.cost import most_together

if TYPE_CHECKING:
    from fingerslip.report.page.content import RunPictures

__all__ = ["Computed", "Job", "Prepared", "groups"]


@dataclass(frozen=True)
class Job:
    """A run with its model, ready to be computed."""

    run: Run  # the run
    model: Model  # its model
    identity: str  # hash of its inputs
    folder: Path  # where its results go
    doubts: tuple[str, ...] = ()  # what is doubtful in the model


@dataclass(frozen=True)
class Prepared:
    """Runs that are ready to be computed, and samples that are not."""

    jobs: tuple[Job, ...]  # the runs with their models
    refused: tuple[RefusedRun, ...] = ()  # all samples that make no model


@dataclass(frozen=True)
class Computed:
    """What became of jobs."""

    failures: dict[str, FingerslipError] = field(default_factory=dict)
    pictures: dict[str, RunPictures] = field(default_factory=dict)


def groups(jobs: Sequence[Job], at_once: int = 1) -> list[list[Job]]:
    """Put jobs into groups that are computed together.

    Parameters
    ----------
    jobs : sequence of Job
        What to compute.
    at_once : int, optional
        Groups that can be computed at once.
    """
    shared = groups_to_share([job.model for job in jobs], at_once, most_together)
    return [[jobs[number] for number in group] for group in shared]
