"""Pictures of runs, drawn as soon as these are computed, beside the runs that others still compute.

The worker that has computed a run draws it, so that a study never uses more processes than it was given. What is drawn
stays in memory until the report is written; a picture that cannot be drawn is left to the report, which then says why.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fingerslip.history import read_history
from fingerslip.results import HISTORY
from fingerslip.study.definition.runs import Plan
from fingerslip.study.storage.store import read_run

if TYPE_CHECKING:
    from fingerslip.report.content import RunPictures
    from fingerslip.study.running.build import Job


@dataclass(frozen=True)
class Drawing:
    """What a report will show of a run alone."""

    title: str  # title of the study
    contact: bool  # whether the run is shown in detail
    model: bool  # whether its model is shown at the start


def drawings_of(plan: Plan, jobs: Sequence[Job]) -> dict[str, Drawing]:
    """Return what to draw of runs that are to be computed, by their names; nothing of samples.

    A report shows its first runs in detail, of many the first one, and the model of the first run with each mesh.
    """
    from fingerslip.report.content import detailed_of

    if plan.study.sample or plan.study.reaction:
        return {}
    title, first = plan.study.title or plan.folder.name, {run.name for run in plan.runs[: detailed_of(len(plan.runs))]}
    models = {id(job.model.mesh): job.run.name for job in reversed(jobs)}.values()
    named = {job.run.name: Drawing(title, job.run.name in first, job.run.name in models) for job in jobs}
    return {name: drawing for name, drawing in named.items() if drawing.contact or drawing.model}


def draw_runs(
    jobs: Sequence[Job], drawings: Mapping[str, Drawing], stopped: Callable[[], bool]
) -> dict[str, RunPictures]:
    """Draw finished runs from their folders, as the report would."""
    pictures = {}
    for job in jobs:
        drawing = drawings.get(job.run.name)
        if drawing is not None and not stopped():
            # Whatever goes wrong here goes wrong in the report too, which tells the user.
            with contextlib.suppress(Exception):
                # What draws is slow to import, and a worker of a sweep mostly draws nothing.
                from fingerslip.report.content import RunSubject
                from fingerslip.report.labels import run_title
                from fingerslip.report.page.pictures import draw_ahead

                result, history = read_run(job.folder), read_history(job.folder / HISTORY)
                title = run_title(result, drawing.title)
                run = RunSubject(history, result.events, name=result.name, title=title)
                mesh = job.model.mesh if drawing.model else None
                pictures[job.run.name] = draw_ahead(run, mesh, contact=drawing.contact)
    return pictures
