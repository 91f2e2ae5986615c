"""``fingerslip report``: figures and page of a study, made again from its stored histories."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerslip.commands.shared import AsJson, print_tables

__all__ = ["report"]


def report(
    folder: Annotated[Path, typer.Argument(metavar="RESULT_DIR", help="Results of a study.", show_default=False)],
    as_json: AsJson = False,
) -> None:
    """Make the figures and report.html of a study again from its stored histories; nothing is computed."""
    from fingerslip.study.storage.reporting import report_again

    print_tables(report_again(folder), as_json)
