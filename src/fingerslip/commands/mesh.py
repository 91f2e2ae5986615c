"""``fingerslip mesh``: the mesh of a study or a preset in a file, or a mesh file in a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from fingerslip.commands.shared import AsJson, print_tables, specimens


def mesh(
    targets: Annotated[
        list[str],
        Argument(
            metavar="STUDY|PRESET|FILE...",
            help="Studies (their first runs) or presets to mesh, or mesh files or decks to look at.",
            autocompletion=specimens,
        ),
    ],
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            metavar="FILE",
            help="File to write: a mesh (.msh, .vtu, .xdmf), or a picture of its regions and boundaries (.png, .svg, "
            ".pdf); else in meshes/, of a FILE its picture.",
        ),
    ] = None,
    unit: Annotated[
        Any, Option("--unit", parser=str, metavar="UNIT", help="Unit of length of a FILE: m, cm, mm or um.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Build or read a mesh, write or draw it, and show the quality of its cells and what is left out of a deck."""
    from fingerslip.study.inspection.check import save_meshes

    save_meshes(targets, output, unit, lambda tables: print_tables(tables, as_json))
