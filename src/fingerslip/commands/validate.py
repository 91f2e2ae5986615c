"""``fingerslip validate``: the shipped studies beside every published number."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option, echo

from fingerslip.commands.shared import Markdown, Quiet, Results, Workers, print_tables, screen_progress


def validate(
    studies: Annotated[
        Path | None, Option(metavar="DIR", help="Folder of the shipped studies: studies, or that of the package.")
    ] = None,
    results: Results = Path("results"),
    workers: Workers = 2,
    *,
    only: Annotated[
        str | None, Option(metavar="PAPER", help="Rows of one paper: wang2014 (fingers) or bulens2023.")
    ] = None,
    geometry: Annotated[
        bool, Option("--geometry", help="Run the samples of the unknown geometry too, about an hour.")
    ] = False,
    pouring: Annotated[
        bool, Option("--pouring", help="Compute the pouring task of the tactile sensor too, hours.")
    ] = False,
    detection: Annotated[
        bool, Option("--detection", help="Make the 320 slides of the tactile sensor too, and train on them.")
    ] = False,
    as_json: Annotated[bool, Option("--json", help="Print the rows as JSON.")] = False,
    markdown: Markdown = False,
    quiet: Quiet = False,
) -> None:
    """Compare with every published number: runs the shipped studies where needed and prints one table.

    Misses stay in the table and are no error. The first time computes and refines all of them; --only bulens2023 leaves
    out the fingers, which take most of that. A second table says which times the unknown geometry allows: stored ones,
    unless --geometry computes them; JSON and Markdown have it only then. Rows of the pouring task and of detectors are
    stored ones too, unless --pouring or --detection computes them.
    """
    import json

    from fingerslip.validation import comparison

    computed = [
        part for part, wanted in (("geometry", geometry), ("pouring", pouring), ("detection", detection)) if wanted
    ]
    compared = comparison.compare(studies, results, workers, screen_progress(quiet), only=only, computed=computed)
    if as_json:
        mapping = compared.mapping()
        echo(json.dumps(mapping, indent=2, ensure_ascii=False, allow_nan=False))
    elif markdown:
        echo(compared.markdown(), nl=False)
    else:
        print_tables(compared.tables)
