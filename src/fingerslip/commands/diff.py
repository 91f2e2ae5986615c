"""``fingerslip diff``: two runs side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument

from fingerslip.commands.shared import AsJson, Markdown, print_tables


def diff(
    first: Annotated[Path, Argument(metavar="RUN_A", help="Folder of a finished run.")],
    second: Annotated[Path, Argument(metavar="RUN_B", help="Folder of another.")],
    as_json: AsJson = False,
    markdown: Markdown = False,
) -> None:
    """Show two runs side by side: the values in which they differ, and events and measures with their differences."""
    from fingerslip.study.inspection.show import diff_runs

    print_tables(diff_runs(first, second), as_json, markdown)
