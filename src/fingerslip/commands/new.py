"""``fingerslip new``: a study file to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option, echo


def new(
    path: Annotated[Path, Argument(metavar="FILE", help="Study file to write.")],
    template: Annotated[
        str, Option(help="press-and-slide, sweep, large-strain, own-mesh, fit or reaction.")
    ] = "press-and-slide",
) -> None:
    """Write a study file to start from, with comments, and the schema by which editors complete and check it."""
    from fingerslip.study.shipped import new_study

    written = new_study(path, template)
    echo(f"{written}: look at it with fingerslip check {written}, compute it with fingerslip run {written}")
