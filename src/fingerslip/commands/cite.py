"""``fingerslip cite``: what to write and whom to cite in a paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option, echo


def cite(
    target: Annotated[Path, Argument(metavar="RESULT", help="Folder of a run or of a study.")],
    bibtex: Annotated[bool, Option("--bibtex", help="Print the BibTeX entries alone.")] = False,
) -> None:
    """Print a paragraph of methods on what was really run, and the papers behind it as BibTeX."""
    from fingerslip.study.inspection.cite import methods_and_papers

    echo(methods_and_papers(target, only_bibtex=bibtex))
