"""``fingerslip track``: follow the markers of a sensor's video."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerslip.commands.shared import Quiet, screen_progress


def track(  # noqa: PLR0917  the options of a command line have no order
    video: Annotated[
        Path, typer.Argument(metavar="VIDEO", help="A video file, or a folder of images.", show_default=False)
    ],
    markers: Annotated[
        int | None, typer.Option("--markers", metavar="N", min=1, help="How many markers there are; else it is found.")
    ] = None,
    rest: Annotated[int, typer.Option("--rest", metavar="FRAMES", min=1, help="Frames at rest at the beginning.")] = 30,
    layout: Annotated[str, typer.Option("--layout", help="auto, rings, hex, grid or free.")] = "auto",
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FOLDER", help="Where to write; else VIDEO with the ending _tracks.")
    ] = None,
    mask: Annotated[
        Path | None, typer.Option("--mask", metavar="IMAGE", help="Image that is white where markers may be.")
    ] = None,
    calibration: Annotated[
        Path | None, typer.Option("--calibration", metavar="FILE", help="Camera calibration in OpenCV's form.")
    ] = None,
    bright: Annotated[
        bool | None, typer.Option("--bright/--dark", help="Whether markers are bright or dark; else it is found.")
    ] = None,
    frame_rate: Annotated[
        float | None, typer.Option("--frame-rate", metavar="HZ", help="Frames a second, where the video does not say.")
    ] = None,
    channel: Annotated[str, typer.Option("--channel", help="Of colour frames: grey, blue, green or red.")] = "grey",
    fields: Annotated[
        bool, typer.Option("--fields", help="Write displacement, velocity, strain and more, with a video of each.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Follow the markers of an optical tactile sensor: tracks as netCDF and CSV, an overlay video, a quality page.

    The sensor rests in the first frames. What is wrong with a video is said, and marked in the tracks.
    """
    from fingerslip.report.page.tracking import track_video

    options = {"mask": mask, "calibration": calibration, "bright": bright, "frame_rate": frame_rate, "channel": channel}
    chosen = {"n_markers": markers, "rest_frames": rest, "layout": layout, **options}
    with screen_progress(quiet) as progress:
        lines = list(track_video(video, out, chosen, progress.say, fields=fields))
    typer.echo("\n".join(lines))
