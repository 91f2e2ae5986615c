"""``fingerslip export``: results for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option, echo


def export(
    target: Annotated[
        Path, Argument(metavar="RESULT", help="Folder of a run, of a study for a table of its runs, or tracks.")
    ],
    kind: Annotated[str, Option("--format", metavar="FORMAT", help="csv, json, mat, nwb, parquet or vtu.")] = "csv",
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="DIR", help="Folder to write; else beside the result.")
    ] = None,
    only: Annotated[
        list[str] | None,
        Option("--only", metavar="TABLE", help="Write this table of a run, such as spikes; repeatable."),
    ] = None,
) -> None:
    """Write a result for pandas, R, MATLAB, ParaView or as spikes for NWB: tables, one MATLAB file, or snapshots."""
    from fingerslip.study.inspection.show import export_result

    echo(str(export_result(target, kind, output, lambda text: echo(text, err=True), only or ())))
