"""Rows of the Markdown tables that benchmarks print."""

from __future__ import annotations

import sys

__all__ = ["line"]


def line(*cells: object, digits: int = 4) -> None:
    """Print a row at once, numbers with so many digits."""
    texts = (f"{cell:.{digits}g}" if isinstance(cell, float) else str(cell) for cell in cells)
    sys.stdout.write("| " + " | ".join(texts) + " |\n")
    sys.stdout.flush()
