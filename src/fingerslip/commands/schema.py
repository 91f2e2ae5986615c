"""``fingerslip schema``: what study files may hold, for editors."""

from __future__ import annotations

from typer import echo


def schema() -> None:
    """Print the JSON Schema of study files, by which editors complete and check them."""
    from fingerslip.study.definition.schema import schema_text

    echo(schema_text(), nl=False)
