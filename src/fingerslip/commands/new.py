"""``fingerslip new``: a study file to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def new(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="Study file to write.", show_default=False)],
    template: Annotated[
        str, typer.Option(help="press-and-slide, sweep, large-strain, own-mesh, fit or reaction.")
    ] = "press-and-slide",
) -> None:
    """Write a study file to start from, with comments, and the schema by which editors complete and check it."""
    from fingerslip.study.shipped import new_study

    written = new_study(path, template)
    typer.echo(f"{written}: look at it with fingerslip check {written}, compute it with fingerslip run {written}")
