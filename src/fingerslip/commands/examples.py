"""``fingerslip examples``: the studies that ship."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, echo

from fingerslip.commands.shared import AsJson, print_tables, shipped_studies


def examples(
    name: Annotated[
        str,
        Argument(metavar="NAME", help="Study to copy; without it all are listed.", autocompletion=shipped_studies),
    ] = "",
    as_json: AsJson = False,
) -> None:
    """List the studies that ship, or copy one of them into this folder."""
    from fingerslip.study.shipped import copy_example, examples_table

    if name:
        echo(str(copy_example(name, Path())))
    else:
        print_tables([examples_table()], as_json)
