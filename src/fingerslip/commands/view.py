"""``fingerslip view``: a stored run in a window, a picture or a film."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["view"]


def view(  # noqa: PLR0917  the options of a command line have no order
    target: Annotated[
        Path, typer.Argument(metavar="RESULT", help="Folder of a run, or its history.nc.", show_default=False)
    ],
    screenshot: Annotated[
        Path | None, typer.Option("--screenshot", metavar="FILE", help="Write a picture instead (.png, .jpg, .webp).")
    ] = None,
    movie: Annotated[
        Path | None, typer.Option("--movie", metavar="FILE", help="Write a film of all snapshots (.gif, .webp).")
    ] = None,
    time: Annotated[str, typer.Option("--time", metavar="TIME", help="Time, such as '1.2 s'; else the last.")] = "",
    scalar: Annotated[
        str, typer.Option("--scalar", help="von_mises, strain_energy_density, displacement, velocity or region.")
    ] = "von_mises",
    hide: Annotated[
        list[str] | None, typer.Option("--hide", metavar="REGION", help="Hide a region; repeatable.")
    ] = None,
    cut: Annotated[str, typer.Option("--cut", help="Cut the body open across x, y or z.")] = "none",
    camera: Annotated[str, typer.Option("--camera", help="oblique, side, front or below.")] = "oblique",
) -> None:
    """Look at a result: layers, a field on them, plate and receptors, in a window or as picture or film.

    Pictures and films need no display. The run needs snapshots: record: {snapshots_every: 50 ms}.
    """
    from fingerslip.study.inspection.view import view_result

    options = {"scalar": scalar, "hidden": list(hide or ()), "cut": cut, "camera": camera}
    for written in view_result(target, options, time=time, screenshot=screenshot, movie=movie):
        typer.echo(str(written))
