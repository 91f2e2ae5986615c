"""``fingerslip track``: follow the markers of a sensor's video."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option, echo

from fingerslip.commands.shared import Quiet, screen_progress, tracking_options, with_options


@with_options("tracking", tracking_options)
def track(
    video: Annotated[Path, Argument(metavar="VIDEO", help="A video file, or a folder of images.")],
    *,
    output: Annotated[
        Path | None,
        Option("-o", "--output", metavar="FOLDER", help="Folder; else VIDEO with the ending _tracks."),
    ] = None,
    tracking: Any,
    fields: Annotated[
        bool, Option("--fields", help="Write displacement, velocity, strain and more, with a video of each.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Follow the markers of an optical tactile sensor: tracks as netCDF and CSV, an overlay video, a quality page.

    The sensor rests in the first frames. What is wrong with a video is said, and marked in the tracks.
    """
    from fingerslip.report.page.tracking import track_video

    with screen_progress(quiet) as progress:
        lines = list(track_video(video, output, tracking, progress.say, fields=fields))
    echo("\n".join(lines))
