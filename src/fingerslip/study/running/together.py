"""Runs of a study are computed together, or in halves where that fails."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence

from fingerslip.errors import FingerslipError
from fingerslip.study.running.compute import compute, compute_together
from fingerslip.study.running.jobs import Job

__all__ = ["compute_group"]

Tell = Callable[[str, float], None]


def compute_group(jobs: Sequence[Job], tell: Tell, threads: int) -> dict[str, FingerslipError | MemoryError]:
    """Compute jobs together, or in halves where that fails, so that only those fail that would fail alone."""
    if len(jobs) == 1:
        return _compute_one(jobs[0], tell, threads)

    def tell_all(fraction: float) -> None:
        for job in jobs:
            tell(job.run.name, fraction)

    with contextlib.suppress(FingerslipError, MemoryError):
        compute_together(jobs, tell_all, threads)
        return {}
    half = len(jobs) // 2
    return compute_group(jobs[:half], tell, threads) | compute_group(jobs[half:], tell, threads)


def _compute_one(job: Job, tell: Tell, threads: int) -> dict[str, FingerslipError | MemoryError]:
    """Compute a job; return its error, if any, under the name of its run."""
    try:
        compute(job, lambda fraction: tell(job.run.name, fraction), threads)
    except (FingerslipError, MemoryError) as error:
        return {job.run.name: error}
    return {}
