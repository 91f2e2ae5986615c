"""The command line: each verb is one call into the package."""

from __future__ import annotations

import signal
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from typer.core import TyperGroup

from fingerslip.errors import FingerslipError, InputError, ResultError

if TYPE_CHECKING:
    from fingerslip.report.tables.table import Table
    from fingerslip.study.running.runner import StudyResult

__all__ = ["app"]

_HELP = """When does a surface that a fingertip holds begin to slip, and how long is there to react?

Start with: fingerslip show wang2014-2d; then: fingerslip run studies/wang2014_table2.yaml."""

_EPILOG = (
    "Exit codes: 0 all well; 1 a run did not converge or lost its process; 2 wrong input, or results that cannot be "
    "read or written; 130 stopped with Ctrl-C (the same command goes on where it stopped)."
)


_FILE_WIDTH = 160


class _Verbs(TyperGroup):
    """The verbs, with errors as one line and an exit code."""

    def invoke(self, ctx: typer.Context) -> object:  # type: ignore[override]
        """Call a verb."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            _say_error("stopped: finished runs are kept, the same command goes on with the others")
            raise typer.Exit(130) from None
        except MemoryError:
            if ctx.params["debug"]:
                raise
            _say_error("error: memory: ran out, needs more of it; take larger elements or fewer --workers")
            raise typer.Exit(2) from None
        except FingerslipError as error:
            if ctx.params["debug"]:
                raise
            _say_error(f"error: {error}")
            raise typer.Exit(_exit_code(error)) from None


app = typer.Typer(
    cls=_Verbs,
    help=_HELP,
    epilog=_EPILOG,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Studies = Annotated[list[Path], typer.Argument(metavar="STUDY...", help="Study files (YAML).", show_default=False)]
Results = Annotated[Path, typer.Option("--results", metavar="DIR", help="Folder in which every study has its own.")]


def _say_version(wanted: bool) -> None:
    if wanted:
        from fingerslip import __version__

        typer.echo(f"fingerslip {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_say_version, is_eager=True, help="Show the version and end.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show where in the program an error comes from.")] = False,
) -> None:
    """Take the options that stand before the verb."""


@app.command()
def show(
    target: Annotated[
        str, typer.Argument(metavar="PRESET|STUDY|RESULT", help="What to show; without it the presets.")
    ] = "",
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of study files.")] = False,
    figure: Annotated[
        Path | None,
        typer.Option("--figure", metavar="FILE", help="Draw the fingertip of a preset or a study (.png, .svg, .pdf)."),
    ] = None,
) -> None:
    """Show the values of a preset or a study with unit and source, assumed ones first, or the events of a result."""
    if schema:
        import json

        from fingerslip.study.definition.spec import study_schema

        typer.echo(json.dumps(study_schema(), indent=2))
        return
    from fingerslip.study.views import views

    if figure is not None:
        from fingerslip.study.views.drawing import draw_fingertip

        draw_fingertip(target, figure)
    _print_tables(views.show(target) if target else (views.presets_table(),))


@app.command()
def check(studies: Studies, results: Results = Path("results")) -> None:
    """Check studies without computing them: the runs, their size and about how long they take."""
    from fingerslip.study.views.check import check_studies

    _print_tables([check_studies(studies, results)])


@app.command()
def mesh(
    target: Annotated[str, typer.Argument(metavar="STUDY|PRESET", help="Whose mesh; of a sweep the first run's.")],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="File to write (.msh, .vtu, .xdmf); else in meshes/."),
    ] = None,
) -> None:
    """Build a mesh, write it, and show the quality of its cells."""
    from fingerslip.study.views.meshes import save_mesh

    _print_tables(save_mesh(target, output))


@app.command()
def run(
    studies: Studies,
    results: Results = Path("results"),
    workers: Annotated[
        int,
        typer.Option("--workers", metavar="N", min=1, help="Cores to use: runs side by side, or one large run on all."),
    ] = 2,
    force: Annotated[bool, typer.Option("--force", help="Compute finished runs again too.")] = False,
) -> None:
    """Run studies, and show their slip events beside the published ones.

    Runs that are finished with the same inputs are not computed again; an interrupted study goes on where it stopped.
    """
    from fingerslip.study.running.progress import progress_for
    from fingerslip.study.running.runner import StudyFailedError, run_studies

    signal.signal(signal.SIGTERM, signal.default_int_handler)
    shown = progress_for(Console(stderr=True))
    try:
        _print_results(run_studies(studies, results_dir=results, workers=workers, force=force, progress=shown))
    except StudyFailedError as error:
        _print_results(error.results)
        raise


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="RESULT_DIR", help="A study's results.", show_default=False)],
) -> None:
    """Make the figures and report.html of a study again from its stored histories; nothing is computed."""
    from fingerslip.study.storage.reporting import event_tables, read_stored, write_report

    stored = read_stored(folder)
    write_report(stored)
    _print_tables(event_tables(stored.runs, stored.compare))


@app.command()
def converge(
    studies: Studies,
    runs: Annotated[
        list[str] | None, typer.Option("--run", metavar="NAME", help="Only this run; may be given again.")
    ] = None,
    results: Results = Path("results"),
    workers: Annotated[
        int,
        typer.Option("--workers", metavar="N", min=1, help="Cores to use: runs side by side, or one large run on all."),
    ] = 2,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the tables in Markdown.")] = False,
) -> None:
    """Refine studies in mesh, time step, contact stiffness and numerical damping, and give every result its error bar.

    Orders, limits and uncertainties are shown and written; tables and reports of the studies then carry them.
    """
    from fingerslip.report.tables.table import to_markdown
    from fingerslip.study.convergence import converge as refinement
    from fingerslip.study.running.progress import progress_for

    signal.signal(signal.SIGTERM, signal.default_int_handler)
    for study in studies:
        shown = progress_for(Console(stderr=True))
        found = refinement.converge(study, results_dir=results, only=runs or (), workers=workers, progress=shown)
        if markdown:
            typer.echo("\n".join(f"## {table.title}\n\n{to_markdown(table)}" for table in found.tables))
            continue
        _print_tables(found.tables)
        typer.echo(f"figures: {found.folder / 'convergence' / 'figures'}")


@app.command()
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
    time: Annotated[str, typer.Option("--time", metavar="TIME", help="Moment, such as '1.2 s'; else the last.")] = "",
    scalar: Annotated[
        str, typer.Option("--scalar", help="von_mises, strain_energy_density, displacement, velocity or region.")
    ] = "von_mises",
    hide: Annotated[
        list[str] | None, typer.Option("--hide", metavar="REGION", help="Leave a region out; may be given again.")
    ] = None,
    cut: Annotated[str, typer.Option("--cut", help="Cut the body open across x, y or z.")] = "none",
    camera: Annotated[str, typer.Option("--camera", help="oblique, side, front or below.")] = "oblique",
) -> None:
    """Look at a result: layers, a field on them, plate and receptors, in a window or as picture or film.

    Pictures and films need no display. The run needs snapshots: record: {snapshots_every: 50 ms}.
    """
    from fingerslip.study.views.viewing import view_result

    options = {"scalar": scalar, "hidden": list(hide or ()), "cut": cut, "camera": camera}
    for written in view_result(target, options, time=time, screenshot=screenshot, movie=movie):
        typer.echo(str(written))


@app.command()
def verify(
    only: Annotated[
        list[str] | None, typer.Option("--only", metavar="NAME", help="Only this problem; may be given again.")
    ] = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the table in Markdown.")] = False,
) -> None:
    """Compute problems with known answers, and show what came of them beside the closed forms.

    The exit code is 1 where anything is further off than allowed.
    """
    from fingerslip.report.tables.table import to_markdown
    from fingerslip.study.running.threads import prefer_single_thread

    prefer_single_thread()
    from fingerslip.verification.catalogue import choose
    from fingerslip.verification.problem import run as run_problem
    from fingerslip.verification.problem import table

    chosen, outcomes = choose(only or ()), []
    for number, problem in enumerate(chosen, start=1):
        typer.echo(f"{number} of {len(chosen)}: {problem.name}, {problem.title}", err=True)
        outcomes.append(run_problem(problem))
    shown = table(tuple(outcomes))
    if markdown:
        typer.echo(f"{to_markdown(shown)}\n{shown.note}")
    else:
        _print_tables([shown])
    if not all(outcome.passed for outcome in outcomes):
        raise typer.Exit(1)


@app.command()
def validate(
    studies: Annotated[Path, typer.Option("--studies", metavar="DIR", help="Folder of the shipped studies.")] = Path(
        "studies"
    ),
    results: Results = Path("results"),
    workers: Annotated[
        int,
        typer.Option("--workers", metavar="N", min=1, help="Cores to use: runs side by side, or one large run on all."),
    ] = 2,
    as_json: Annotated[bool, typer.Option("--json", help="Print the rows as JSON.")] = False,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the table as a page in Markdown.")] = False,
) -> None:
    """Compare with every published number: runs the shipped studies where needed and prints one table.

    Misses stay in the table and are no error. The first time takes some minutes.
    """
    import json

    from fingerslip import validation
    from fingerslip.study.running.progress import progress_for

    rows = validation.validate(studies, results, workers, progress_for(Console(stderr=True)))
    if as_json:
        typer.echo(json.dumps(validation.rows_mapping(rows), indent=2))
    elif markdown:
        typer.echo(validation.rows_markdown(rows), nl=False)
    else:
        _print_tables([validation.rows_table(rows)])


def _print_results(results: Iterable[StudyResult]) -> None:
    from fingerslip.study.storage.reporting import event_tables

    for result in results:
        if result.runs:
            _print_tables(event_tables(result.runs, result.compare))
            typer.echo(f"report: {result.folder / 'report.html'}")


def _print_tables(tables: Iterable[Table]) -> None:
    from fingerslip.report.tables.table import to_rich

    screen = Console()
    if not screen.is_terminal:
        # A pipe or file has no width: nothing may be cut there.
        screen.width = max(screen.width, _FILE_WIDTH)
    for table in tables:
        screen.print(to_rich(table))


def _say_error(message: str) -> None:
    Console(stderr=True).print(message, style="red", markup=False, highlight=False, soft_wrap=True)


def _exit_code(error: FingerslipError) -> int:
    """Return 1 where computing failed, 2 where the user can repair the input or the place of the results."""
    errors = getattr(error, "errors", None) or {"": error}
    return 2 if any(isinstance(one, InputError | ResultError) for one in errors.values()) else 1
