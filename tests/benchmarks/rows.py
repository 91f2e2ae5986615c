"""Rows of the Markdown tables that benchmarks print, their options, and the numbers they are compared with."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

__all__ = ["line", "options_of", "reference", "table", "write"]

REFERENCES = Path(__file__).parents[2] / "results" / "reference"


def line(*cells: object, digits: int = 4) -> None:
    """Print a row at once, numbers with so many digits."""
    texts = (f"{cell:.{digits}g}" if isinstance(cell, float) else str(cell) for cell in cells)
    sys.stdout.write("| " + " | ".join(texts) + " |\n")
    sys.stdout.flush()


def table(*heads: object) -> None:
    """Print the head of a table."""
    line(*heads)
    line(*["---"] * len(heads))


def options_of(doc: str | None, *, writes: bool = False) -> argparse.ArgumentParser:
    """Return the parser of a benchmark, whose help is what its file says of itself."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    if writes:
        parser.add_argument("--write", type=Path, metavar="FILE", help="write the numbers, to compare with later")
    return parser


def reference(name: str) -> dict[str, Any]:
    """Return the cases of results/reference/NAME.json, and print what they were measured with."""
    file = REFERENCES / f"{name}.json"
    known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {"cases": {}}
    if known["cases"] and "state" in known:
        sys.stdout.write(f"before: {known['state']}; {known['machine']}\n")
    cases: dict[str, Any] = known["cases"]
    return cases


def write(file: Path | None, cases: dict[str, Any]) -> None:
    """Write cases, beside those that a file has, where one is given."""
    if file is not None:
        known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {"cases": {}}
        content = {"state": "which version", "machine": "which machine"} | known | {"cases": known["cases"] | cases}
        file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
