"""``fingerslip sensitivity``: what moves the results of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from typer import Argument, Option

from fingerslip.commands.shared import AsJson, print_tables


def sensitivity(
    folder: Annotated[Path, Argument(metavar="RESULT_DIR", help="Results of a study with samples.")],
    of: Annotated[str, Option(metavar="NAME", help="Event, measure or derived quantity.")] = "latency",
    method: Annotated[
        Literal["auto", "linear", "morris", "sobol", "surrogate"],
        Option(help="Which sensitivities; auto: those that the samples were drawn for."),
    ] = "auto",
    as_json: AsJson = False,
) -> None:
    """Say which of the sampled values moves a result most: Sobol indices, elementary effects or linear regression.

    The table and its figure are written into the folder, too.
    """
    from fingerslip.study.inspection.show import write_sensitivities

    print_tables(write_sensitivities(folder, of, method), as_json)
