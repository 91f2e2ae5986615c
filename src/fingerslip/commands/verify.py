"""``fingerslip verify``: problems with known answers beside their closed forms."""

from __future__ import annotations

from typing import Annotated

from typer import Exit, Option, echo

from fingerslip.commands.shared import AsJson, Markdown, Quiet, print_tables


def verify(
    only: Annotated[list[str] | None, Option(metavar="NAME", help="Only this problem; repeatable.")] = None,
    markdown: Markdown = False,
    as_json: AsJson = False,
    *,
    quiet: Quiet = False,
    names: Annotated[bool, Option("--list", help="Print the names of all problems, and compute none.")] = False,
) -> None:
    """Compute problems with known answers, and show the results beside the closed forms.

    The exit code is 1 where an error is larger than allowed.
    """
    from fingerslip.verification.catalogue import known_names
    from fingerslip.verification.catalogue import verify as verify_problems

    if names:
        echo("\n".join(known_names()))
        return
    verification = verify_problems(only or (), (lambda _: None) if quiet else (lambda line: echo(line, err=True)))
    if markdown:
        echo(verification.markdown)
    else:
        print_tables([verification.numbers if as_json else verification.table], as_json)
    raise Exit(0 if verification.holds else 1)
