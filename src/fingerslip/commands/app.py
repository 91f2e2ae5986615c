"""The command line: every file of this folder is a verb, found here and added under its name."""

from __future__ import annotations

import errno
import gc
import importlib
import os
import pkgutil
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from fingerslip import commands
from fingerslip.commands.shared import exit_code, print_error, stop_on_termination
from fingerslip.errors import FingerslipError

_HELP = """When does a surface that a fingertip holds begin to slip, and how long is there to react?

Start with: fingerslip new mine.yaml; then: fingerslip check mine.yaml; fingerslip run mine.yaml.
Studies that ship: fingerslip examples."""

_EPILOG = (
    "Exit codes: 0 success; 1 a run did not converge or lost its process; 2 wrong input, or results that cannot be "
    "read or written; 130 stopped with Ctrl-C (the same command continues where it stopped)."
)

_NOT_VERBS = ("app", "shared")


class _Verbs(TyperGroup):
    """The verbs; an error becomes a line on standard error and an exit code."""

    def main(self, *args: Any, **options: Any) -> Any:
        """Parse the command line and call a verb; where the answer cannot be printed, an error says so."""
        try:
            return super().main(*args, **options)
        except OSError as error:
            # Files of ours fail with errors of their own: this is where help and answers are printed.
            if error.errno != errno.ENOSPC:
                raise
            sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115, PTH123  what is left goes nowhere
            print_error("error: standard output: takes no more, needs room; write to another disk")
            sys.exit(2)

    def invoke(self, ctx: typer.Context) -> object:  # type: ignore[override]
        """Call a verb."""
        # Modules are no garbage: looking for some while they load takes a sixth of that time.
        gc.set_threshold(50_000, 20, 20)
        stop_on_termination()
        try:
            with warnings.catch_warnings():
                warnings.showwarning = lambda message, *_args, **_options: print_error(f"warning: {message}")
                return super().invoke(ctx)
        except KeyboardInterrupt:
            print_error("stopped: what is finished is kept, and nothing half; the same command does the rest")
            raise typer.Exit(130) from None
        except OSError as error:
            frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
            if ctx.params["debug"] or not any(
                frame.f_globals.get("__name__", "").startswith("numba.") for frame in frames
            ):
                raise
            fault = f"cannot be written ({error.strerror})"
            print_error(f"error: compiled code: {fault}, needs room; make some, or set NUMBA_CACHE_DIR to another disk")
            raise typer.Exit(2) from None
        except MemoryError:
            if ctx.params["debug"]:
                raise
            print_error("error: not enough memory; use larger elements or fewer --workers")
            raise typer.Exit(2) from None
        except FingerslipError as error:
            if ctx.params["debug"]:
                raise
            print_error("\n".join(f"error: {line}" for line in str(error).splitlines()))
            raise typer.Exit(exit_code(error)) from None


def _print_version(wanted: bool) -> None:
    if wanted:
        from fingerslip import __version__

        typer.echo(f"fingerslip {__version__}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Print the traceback of an error.")] = False,
) -> None:
    """Read the options that stand before the verb."""


def _verbs() -> Iterator[tuple[Callable[..., Any], Sequence[Callable[..., Any]]]]:
    """Yield the function of each verb, which has the name of its file, and the verbs below it."""
    for module in pkgutil.iter_modules(commands.__path__):
        if module.name not in _NOT_VERBS:
            file = importlib.import_module(f"{commands.__name__}.{module.name}")
            yield getattr(file, module.name), getattr(file, "ACTIONS", ())


def command_line() -> typer.Typer:
    """Return the command line, with a verb for each file of this folder."""
    verbs = typer.Typer(
        cls=_Verbs,
        help=_HELP,
        epilog=_EPILOG,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    verbs.callback()(_options)
    for verb, actions in _verbs():
        if actions:
            # The function of a verb that has verbs below it says what they have in common.
            group = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)
            group.callback()(verb)
            for action in actions:
                group.command()(action)
            verbs.add_typer(group, name=verb.__name__)
        else:
            verbs.command()(verb)
    return verbs


app = command_line()
