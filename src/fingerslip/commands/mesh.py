"""``fingerslip mesh``: the mesh of a study or a preset in a file, or a mesh file in a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from fingerslip.commands.shared import AsJson, print_tables, specimens
from fingerslip.errors import InputError


def mesh(
    targets: Annotated[
        list[str],
        typer.Argument(
            metavar="STUDY|PRESET|FILE...",
            help="Studies (their first runs) or presets to mesh, or mesh files or decks to look at.",
            autocompletion=specimens,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="File to write: a mesh (.msh, .vtu, .xdmf), or a picture of its regions and boundaries (.png, .svg, "
            ".pdf); else in meshes/, of a FILE its picture.",
        ),
    ] = None,
    unit: Annotated[
        Any, typer.Option("--unit", parser=str, metavar="UNIT", help="Unit of length of a FILE: m, cm, mm or um.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Build or read a mesh, write or draw it, and show the quality of its cells and what is left out of a deck."""
    from fingerslip.study.inspection.check import save_mesh

    if output is not None and len(targets) > 1:
        fault = f"got {output} for {len(targets)} meshes"
        raise InputError("mesh --output", fault, "needs a single mesh", "leave it out: files go to meshes/")
    others: dict[str, str] = {}
    for target in targets:
        path = Path(target)
        other = others.setdefault(path.stem if path.suffix in (".yaml", ".yml") else path.name, target)
        if other != target:
            fault = f"would be written over {other}, which has the same name"
            raise InputError(f"mesh {target}", fault, "needs a name of its own", "mesh it alone, with --output")
    print_tables([table for target in targets for table in save_mesh(target, output, unit)], as_json)
