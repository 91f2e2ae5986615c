"""``fingerslip run``: the runs of studies, computed and written up."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from fingerslip.commands.shared import (
    AsJson,
    Markdown,
    Quiet,
    Results,
    Studies,
    Workers,
    print_results,
    screen_progress,
)


def run(
    studies: Studies,
    *,
    results: Results = Path("results"),
    workers: Workers = 2,
    force: Annotated[bool, Option("--force", help="Compute finished runs again.")] = False,
    scheduler: Annotated[
        str | None, Option(metavar="ADDRESS", help="Compute on a Dask cluster: tcp://host:8786.")
    ] = None,
    as_json: AsJson = False,
    markdown: Markdown = False,
    quiet: Quiet = False,
) -> None:
    """Run studies, and show their slip events beside the published ones.

    Runs that are finished with the same inputs are not computed again; an interrupted study continues where it stopped.
    """
    from fingerslip.study.definition.runs import plan_studies
    from fingerslip.study.running.runner import StudyFailedError, run_plans

    plans, progress = plan_studies(studies, results), screen_progress(quiet)
    try:
        results_of_all = run_plans(plans, workers=workers, force=force, progress=progress, scheduler=scheduler)
        print_results(results_of_all, as_json, markdown)
    except StudyFailedError as error:
        print_results(error.results, as_json, markdown)
        raise
