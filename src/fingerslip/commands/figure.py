"""``fingerslip figure``: one figure or film of stored results, for a paper or for slides."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from typer import Argument, Option, echo

from fingerslip.commands.shared import cameras, fields, figure_kinds
from fingerslip.report.scene.names import CAMERAS, FIELDS, alternatives


def figure(  # noqa: PLR0917  the options of a command line have no order
    target: Annotated[Path, Argument(metavar="RESULT", help="Folder of a study, run, tracks, evaluation or clip.")],
    kind: Annotated[str, Option(help="What is shown; 'list' prints all kinds.", autocompletion=figure_kinds)] = "list",
    form: Annotated[Literal["pdf", "svg", "png"], Option("--format", help="Of the file.")] = "pdf",
    style: Annotated[str, Option(help="paper, column, slides or page.")] = "paper",
    run: Annotated[str, Option(metavar="NAME", help="The run, of a study with several.")] = "",
    over: Annotated[str, Option(metavar="PATH", help="The swept value on the axis.")] = "",
    times: Annotated[
        list[str] | None, Option("--time", metavar="TIME", help="Time of a panel, such as '1.2 s'; repeatable.")
    ] = None,
    field: Annotated[str, Option(help=f"{alternatives(FIELDS)}.", autocompletion=fields)] = "",
    cut: Annotated[str, Option(help="Cut a solid open across x, y or z.")] = "",
    camera: Annotated[str, Option(help=f"{alternatives(CAMERAS)}.", autocompletion=cameras)] = "",
    contact: Annotated[bool, Option("--contact", help="Show stick and slip on a solid.")] = False,
    size: Annotated[str, Option(metavar="WxH", help="Of a film, in pixels; else 1280x720.")] = "",
    dpi: Annotated[
        int | None, Option(min=50, max=1200, help="Dots per inch of png, and of fields in pdf and svg.")
    ] = None,
    rate: Annotated[float | None, Option(help="Frames a second of a film; else 25.")] = None,
    seconds: Annotated[float | None, Option(help="Length of a film; else 8.")] = None,
    output: Annotated[Path | None, Option("-o", "--output", metavar="FILE", help="The file to write.")] = None,
) -> None:
    """Write one figure of results for a paper or for slides, or a film (--kind film) as MP4."""
    from fingerslip.study.inspection.views import FigureChoice, film_options, kinds_text, with_run, write_figure

    if kind == "list":
        echo(kinds_text(target))
        return
    options: dict[str, Any] = {"scalar": field, "cut": cut, "camera": camera, "contact": contact}
    choice = FigureChoice(
        kind=kind,
        style=style,
        form=output.suffix.removeprefix(".") if output and kind != "film" else form,
        run=run,
        path=over,
        times=tuple(times or ()),
        options={name: value for name, value in options.items() if value},
        film=film_options(size, rate, seconds),
        dpi=dpi,
    )
    if not run and (chosen := with_run(target, choice).run):
        echo(f"{chosen}: one of several runs; --run names another.", err=True)
    echo(str(write_figure(target, choice, output)))
