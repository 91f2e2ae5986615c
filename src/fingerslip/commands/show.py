"""``fingerslip show``: the values of a preset or a study, or the events of a result."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerslip.commands.shared import print_tables

__all__ = ["show"]


def _print_schema(wanted: bool) -> None:
    if wanted:
        import json

        from fingerslip.study.definition.spec import study_schema

        typer.echo(json.dumps(study_schema(), indent=2))
        raise typer.Exit


def show(
    target: Annotated[
        str, typer.Argument(metavar="PRESET|STUDY|RESULT", help="What to show; without it all presets are listed.")
    ] = "",
    schema: Annotated[  # noqa: ARG001  its callback prints and exits
        bool,
        typer.Option("--schema", callback=_print_schema, is_eager=True, help="Print the JSON Schema of study files."),
    ] = False,
    figure: Annotated[
        Path | None,
        typer.Option("--figure", metavar="FILE", help="Draw the fingertip of a preset or a study (.png, .svg, .pdf)."),
    ] = None,
) -> None:
    """Show the values of a preset or a study with unit and source, assumed ones first, or the events of a result."""
    from fingerslip.study.inspection.show import show as tables_of

    print_tables(tables_of(target, figure))
