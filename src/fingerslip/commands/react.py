"""``fingerslip react``: how long there is to react before a held object is lost."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from fingerslip.commands.shared import AsJson, Quiet, Workers, print_tables


def react(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Settings of a map (YAML), see studies/reactions.")],
    results: Annotated[
        Path, typer.Option("--results", metavar="DIR", help="Folder that holds a folder for each map.")
    ] = Path("results"),
    workers: Workers = 2,
    as_json: AsJson = False,
    *,
    quiet: Quiet = False,
) -> None:
    """Compute how long a reflex may take to save a held object, over friction and rate of its load.

    A page with the answer, tables, figures and a film is written into a folder with the name of the file.
    """
    from fingerslip.react.answer import answer, trial_table
    from fingerslip.react.page import map_file

    with typer.progressbar(length=1000, label="reactions", hidden=quiet or as_json, file=sys.stderr) as bar:
        result, folder = map_file(file, results, workers, lambda share: bar.update(int(1000 * share) - bar.pos))
    print_tables([trial_table(result)], as_json)
    if not as_json:
        typer.echo("\n".join((*answer(result), f"page: {folder / 'report.html'}")))
