"""``fingerslip predict``: what a run between those of a study would come to."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from fingerslip.commands.shared import AsJson, print_tables


def predict(
    folder: Annotated[Path, Argument(metavar="RESULT_DIR", help="Results of a study.")],
    at: Annotated[list[str], Option(metavar="PATH=VALUE", help="A value; one for each that differs.")],
    of: Annotated[list[str], Option(metavar="NAME", help="Event, measure or derived quantity.")] = [  # noqa: B006
        "incipient_slip",
        "overall_slip",
        "latency",
    ],
    as_json: AsJson = False,
) -> None:
    """Predict what a run between those of a study would come to, with its error; nothing is simulated."""
    from fingerslip.study.inspection.show import predict_table

    print_tables([predict_table(folder, at, of)], as_json)
