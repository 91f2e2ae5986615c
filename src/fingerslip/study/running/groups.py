"""Runs of a study that share a mesh are computed together, where that saves factorising a large matrix."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence

from fingerslip.dynamics.sharing import can_share
from fingerslip.errors import FingerslipError
from fingerslip.study.running.compute import Job, compute, compute_together

__all__ = ["compute_group", "groups"]

# Unknowns from which a factorisation is worth sharing, and runs whose histories are kept at once.
_LARGE = 15_000
_MOST = 8

Tell = Callable[[str, float], None]


def groups(jobs: Sequence[Job]) -> list[list[Job]]:
    """Put jobs into groups that are computed together; one alone uses all cores.

    Parameters
    ----------
    jobs : sequence of Job
        What to compute.
    """
    alike: list[list[Job]] = []
    for job in jobs:
        known = next((group for group in alike if _is_large(job) and can_share(group[0].model, job.model)), None)
        if known is None:
            alike.append([job])
        else:
            known.append(job)
    return [part for group in alike for part in _even_parts(group)]


def _even_parts(group: list[Job]) -> list[list[Job]]:
    size = math.ceil(len(group) / math.ceil(len(group) / _MOST))
    return [group[start : start + size] for start in range(0, len(group), size)]


def _is_large(job: Job) -> bool:
    return bool(job.model.mesh.p.size >= _LARGE)


def compute_group(jobs: Sequence[Job], tell: Tell) -> dict[str, FingerslipError | MemoryError]:
    """Compute jobs together, or one by one where that fails, so that only those fail that would fail alone.

    Parameters
    ----------
    jobs : sequence of Job
        What to compute.
    tell : callable
        Gets the name of a run and the fraction of it that is done; what it raises ends all.

    Returns
    -------
    dict
        The error of each job that failed, by the name of the run.
    """

    def tell_all(fraction: float) -> None:
        for job in jobs:
            tell(job.run.name, fraction)

    if len(jobs) > 1:
        with contextlib.suppress(FingerslipError, MemoryError):
            compute_together(jobs, tell_all)
            return {}
    failures: dict[str, FingerslipError | MemoryError] = {}
    for job in jobs:
        name = job.run.name
        try:
            compute(job, lambda fraction, name=name: tell(name, fraction))  # type: ignore[misc]
        except (FingerslipError, MemoryError) as error:
            failures[name] = error
    return failures
