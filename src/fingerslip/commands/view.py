"""``fingerslip view``: a stored run in a window, a picture or a film."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option, echo

from fingerslip.commands.shared import cameras, fields
from fingerslip.report.scene.names import CAMERAS, FIELDS, alternatives


def view(  # noqa: PLR0917  the options of a command line have no order
    target: Annotated[Path, Argument(metavar="RESULT", help="Folder of a run, or its history.nc.")],
    screenshot: Annotated[
        Path | None, Option(metavar="FILE", help="Write a picture instead (.png, .jpg, .webp).")
    ] = None,
    movie: Annotated[Path | None, Option(metavar="FILE", help="Write a film of all snapshots (.gif, .webp).")] = None,
    time: Annotated[str, Option(metavar="TIME", help="Time, such as '1.2 s'; else the last.")] = "",
    scalar: Annotated[
        str, Option("--field", "--scalar", help=f"{alternatives(FIELDS)}.", autocompletion=fields)
    ] = "von_mises",
    hide: Annotated[list[str] | None, Option(metavar="REGION", help="Hide a region; repeatable.")] = None,
    cut: Annotated[str, Option(help="Cut the body open across x, y or z.")] = "none",
    camera: Annotated[str, Option(help=f"{alternatives(CAMERAS)}.", autocompletion=cameras)] = "oblique",
    contact: Annotated[bool, Option("--contact", help="Show stick and slip on the skin.")] = False,
    web: Annotated[bool, Option("--web", help="Show it in a browser instead of a window.")] = False,
    host: Annotated[
        str, Option(help="Address for --web; others than this machine can look where it is 0.0.0.0.")
    ] = "127.0.0.1",
    port: Annotated[int, Option(help="Port for --web; 0 takes a free one.")] = 0,
    browser: Annotated[bool, Option("--browser/--no-browser", help="Open a browser with --web.")] = True,
) -> None:
    """Look at a result: layers, a field on them, plate and receptors, in a window, a browser, or as picture or film.

    Pictures and films need no display. The run needs snapshots: record: {snapshots_every: 50 ms}.
    """
    from fingerslip.report.scene.options import Served
    from fingerslip.study.inspection.views import view_result

    options = {"scalar": scalar, "hidden": list(hide or ()), "cut": cut, "camera": camera, "contact": contact}
    served = Served(host, port, browser, lambda address: echo(f"open {address}")) if web else None
    for written in view_result(target, options, time=time, screenshot=screenshot, movie=movie, served=served):
        echo(str(written))
