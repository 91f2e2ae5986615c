"""``fingerslip report``: figures and page of a study, made again from its stored histories."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option, echo

from fingerslip.commands.shared import AsJson, print_tables
from fingerslip.errors import InputError


def report(
    folder: Annotated[Path, Argument(metavar="RESULT_DIR", help="Results of a study.")],
    other: Annotated[Path | None, Argument(metavar="OTHER_DIR", help="Results of another, to compare.")] = None,
    output: Annotated[Path | None, Option("-o", "--output", metavar="FILE", help="Page of a comparison.")] = None,
    as_json: AsJson = False,
) -> None:
    """Make the figures and report.html of a study again from its stored histories, or a page of two side by side.

    Nothing is computed. Notes in notes.md and figures in notes/ beside the results become part of the report.
    """
    if other is not None:
        from fingerslip.study.storage.reporting import compare_studies

        echo(str(compare_studies(folder, other, output)))
        return
    if output is not None:
        raise InputError(
            "report: --output", f"got {output} with one folder", "needs two: it is where a comparison goes"
        )
    from fingerslip.study.storage.reporting import read_results, study_tables, write_report

    stored = read_results(folder)
    write_report(stored)
    print_tables(study_tables(stored), as_json)
