"""``fingerslip mesh``: the mesh of a study or a preset in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerslip.commands.shared import AsJson, print_tables, specimens


def mesh(
    target: Annotated[
        str,
        typer.Argument(
            metavar="STUDY|PRESET", help="Study (its first run) or preset to mesh.", autocompletion=specimens
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="File to write (.msh, .vtu, .xdmf); else in meshes/."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Build a mesh, write it, and show the quality of its cells."""
    from fingerslip.study.inspection.check import save_mesh

    print_tables(save_mesh(target, output), as_json)
