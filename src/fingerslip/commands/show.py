"""``fingerslip show``: the values of a preset or a study, or the events of a result."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from fingerslip.commands.shared import AsJson, Markdown, print_tables, specimens


def show(
    target: Annotated[
        str,
        Argument(
            metavar="PRESET|STUDY|RESULT",
            help="What to show; without it all presets are listed.",
            autocompletion=specimens,
        ),
    ] = "",
    figure: Annotated[
        Path | None,
        Option(metavar="FILE", help="Draw the fingertip or sensor of a preset or a study (.png, .svg, .pdf)."),
    ] = None,
    as_json: AsJson = False,
    markdown: Markdown = False,
) -> None:
    """Show the values of a preset or a study with unit and source, assumed ones first, or the events of a result."""
    from fingerslip.study.inspection.show import show as tables_of

    print_tables(tables_of(target, figure), as_json, markdown)
