"""What several verbs share: common arguments, tables on the screen, errors and exit codes."""

from __future__ import annotations

import functools
import inspect
import json
import signal
import threading
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.console import Console
from typer import Argument, Option, echo

from fingerslip.errors import FingerslipError, InputError, ResultError
from fingerslip.report.scene.names import CAMERAS, FIELDS

if TYPE_CHECKING:
    from fingerslip.results import StudyResult
    from fingerslip.study.running.progress import StudyProgress
    from fingerslip.tables.table import Table

Studies = Annotated[list[Path], Argument(metavar="STUDY...", help="Study files (YAML).")]
Results = Annotated[Path, Option(metavar="DIR", help="Folder that holds a folder for each study.")]
Workers = Annotated[int, Option(metavar="N", min=1, help="Cores to use: one for each run, or all for one large run.")]
Markdown = Annotated[bool, Option("--markdown", help="Print the tables in Markdown.")]
AsJson = Annotated[bool, Option("--json", help="Print the tables as JSON.")]
Quiet = Annotated[bool, Option("--quiet", "-q", help="Show no progress; the answer is printed all the same.")]

_FILE_WIDTH = 160


def _complete(names: Callable[[], Iterable[str]]) -> Callable[[str], list[str]]:
    """Return what completes names in a shell."""
    return lambda incomplete: [name for name in names() if name.startswith(incomplete)]


def _specimens() -> Iterable[str]:
    from fingerslip.materials.choice import material_names
    from fingerslip.specimens.choice import preset_names

    return (*preset_names(), *material_names())


def _shipped_studies() -> Iterable[str]:
    from fingerslip.study.shipped import examples

    return examples()


def _figure_kinds() -> Iterable[str]:
    from fingerslip.study.inspection.views import kinds_text

    return (line.partition(":")[0] for line in kinds_text().splitlines())


cameras, fields = _complete(lambda: CAMERAS), _complete(lambda: FIELDS)
specimens, shipped_studies, figure_kinds = map(_complete, (_specimens, _shipped_studies, _figure_kinds))


def with_options(name: str, read: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a verb the options of `read` in the place of its parameter `name`, which gets what `read` makes of them."""
    options = inspect.signature(read, eval_str=True).parameters

    def of_verb(verb: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(verb)
        def call(**values: Any) -> Any:
            read_value = read(**{option: values.pop(option) for option in options})
            return verb(**values, **{name: read_value})

        signature = inspect.signature(verb, eval_str=True)
        parameters: list[inspect.Parameter] = []
        for parameter in signature.parameters.values():
            parameters += options.values() if parameter.name == name else [parameter]
        call.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
        call.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return call

    return of_verb


def tracking_options(
    *,
    markers: Annotated[
        int | None, Option(metavar="N", min=1, help="How many markers there are; else it is found.")
    ] = None,
    layout: Annotated[Any, Option(parser=str, metavar="NAME", help="auto, rings, hex, grid or free.")] = "auto",
    rest: Annotated[
        int | None, Option(metavar="FRAMES", min=2, help="Frames at rest at the start; else it is found.")
    ] = None,
    mask: Annotated[Path | None, Option(metavar="IMAGE", help="Image that is white where markers may be.")] = None,
    calibration: Annotated[Path | None, Option(metavar="FILE", help="Camera calibration in OpenCV's form.")] = None,
    bright: Annotated[
        bool | None, Option("--bright/--dark", help="Whether markers are bright or dark; else it is found.")
    ] = None,
    frame_rate: Annotated[float | None, Option(metavar="HZ", help="Frames a second, whatever the video says.")] = None,
    channel: Annotated[str, Option(help="Of colour frames: grey, blue, green or red.")] = "grey",
) -> dict[str, Any]:
    """Return how markers are found as the tracker takes it, which itself refuses other names."""
    search = {"n_markers": markers, "layout": layout, "rest_frames": rest, "mask": mask, "bright": bright}
    return {**search, "calibration": calibration, "frame_rate": frame_rate, "channel": channel}


def print_tables(tables: Iterable[Table], as_json: bool = False, markdown: bool = False) -> None:
    """Print tables on the screen, or uncut into a pipe or a file; as one JSON list or in Markdown where asked for."""
    from fingerslip.tables.table import to_mapping, to_page, to_rich

    if as_json:
        echo(json.dumps([to_mapping(table) for table in tables], indent=2, ensure_ascii=False, allow_nan=False))
        return
    if markdown:
        echo(to_page(tables), nl=False)
        return
    screen = Console()
    if not screen.is_terminal:
        # A pipe or file has no width: nothing may be cut there.
        screen.width = max(screen.width, _FILE_WIDTH)
    for table in tables:
        screen.print(to_rich(table, screen.width))


def print_results(results: Iterable[StudyResult], as_json: bool = False, markdown: bool = False) -> None:
    """Print the slip events of studies and where their reports are."""
    from fingerslip.study.storage.reporting import study_tables

    finished = [result for result in results if result.runs]
    if as_json or markdown:
        print_tables([table for result in finished for table in study_tables(result)], as_json, markdown)
        return
    for result in finished:
        print_tables(study_tables(result))
        echo(f"report: {result.folder / 'report.html'}")


def screen_progress(quiet: bool = False) -> StudyProgress:
    """Return the progress display of a study: bars on a terminal, lines elsewhere, both on standard error; or none."""
    from fingerslip.study.running.progress import StudyProgress, progress_on_screen

    return StudyProgress() if quiet else progress_on_screen()


def stop_on_termination() -> None:
    """Handle a termination request and a closed terminal like Ctrl-C: what is finished is kept, the rest is removed."""
    if threading.current_thread() is not threading.main_thread():
        return
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)  # Windows has no SIGHUP, nohup ignores it, and Gmsh resets SIGINT
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)


def print_error(message: str) -> None:
    """Print a message on standard error, as it is and on one line."""
    Console(stderr=True).print(message, style="red", markup=False, highlight=False, soft_wrap=True)


def exit_code(error: FingerslipError) -> int:
    """Return the exit code of an error: 2 where the user can repair input or output, 1 where computing failed.

    Of a study of which several runs failed, one repairable error is enough.
    """
    errors = getattr(error, "errors", None) or {"": error}
    return 2 if any(isinstance(entry, InputError | ResultError) for entry in errors.values()) else 1
