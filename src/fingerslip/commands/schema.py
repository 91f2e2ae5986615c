"""``fingerslip schema``: what study files may hold, for editors."""

from __future__ import annotations

import typer


def schema() -> None:
    """Print the JSON Schema of study files, by which editors complete and check them."""
    import json

    from fingerslip.study.definition.schema import study_schema

    typer.echo(json.dumps(study_schema(), indent=2))
