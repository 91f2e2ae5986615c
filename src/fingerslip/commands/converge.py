"""``fingerslip converge``: the numerical uncertainty of every result of studies."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option, echo

from fingerslip.commands.shared import AsJson, Markdown, Quiet, Results, Studies, Workers, print_tables, screen_progress

if TYPE_CHECKING:
    from fingerslip.tables.table import Table


def converge(
    studies: Studies,
    runs: Annotated[list[str] | None, Option("--run", metavar="NAME", help="Only this run; repeatable.")] = None,
    results: Results = Path("results"),
    workers: Workers = 2,
    *,
    markdown: Markdown = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Refine studies in mesh, time step, contact stiffness and numerical damping, and give every result its error bar.

    Orders, limits and uncertainties are shown and written; tables and reports of the studies then carry them.
    """
    from fingerslip.study import convergence as refinement

    tables: list[Table] = []
    for study in studies:
        convergence = refinement.converge(
            study, results_dir=results, only=runs or (), workers=workers, progress=screen_progress(quiet)
        )
        tables += convergence.tables
        if markdown or not as_json:
            print_tables(convergence.tables, markdown=markdown)
        if not markdown and not as_json:
            echo(f"figures: {convergence.figures}")
    if as_json and not markdown:
        print_tables(tables, as_json)
