"""``fingerslip fit``: what a measurement says of the sampled values of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, echo

from fingerslip.commands.shared import AsJson, Quiet, Results, Workers, print_tables, screen_progress


def fit(
    study: Annotated[Path, Argument(metavar="STUDY", help="Study file with the blocks sample and fit.")],
    data: Annotated[Path, Argument(metavar="CSV", help="Measured curves; columns such as 'depth \\[mm]'.")],
    *,
    results: Results = Path("results"),
    workers: Workers = 2,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Fit the sampled values of a study to a measurement, and predict slip with what is left open.

    Computes the runs that are not finished. The folder fit of the results has the posterior, tables and figures.
    """
    from fingerslip.study.fit import fit as fit_study

    posterior = fit_study(study, data, results_dir=results, workers=workers, progress=screen_progress(quiet))
    print_tables(posterior.tables, as_json)
    if not as_json:
        echo(f"figures and samples: {posterior.folder}")
