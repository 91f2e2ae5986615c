"""Seconds of a block, rows of the Markdown tables that benchmarks print, and the numbers they are compared with."""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import json
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

__all__ = ["Figures", "line", "options_of", "reference", "seconds", "table", "write"]

REFERENCES = Path(__file__).parents[2] / "results" / "reference"
_SET_CHILD_SUBREAPER = 36
# CPU seconds, but where the name says something else.
Figures = dict[str, float]


@contextlib.contextmanager
def seconds(figures: Figures, name: str) -> Iterator[None]:
    """Write the CPU seconds of a block, those of its children and of theirs too, and those of the clock."""
    # What a child leaves behind, such as the process that workers are forked from, becomes a child of this process.
    if hasattr(ctypes.CDLL(None), "prctl"):
        ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    cpu, clock = sum(os.times()[:4]), time.perf_counter()
    yield
    figures[f"{name}, clock"] = time.perf_counter() - clock
    with contextlib.suppress(ChildProcessError):
        while True:
            os.waitpid(-1, 0)
    figures[name] = sum(os.times()[:4]) - cpu


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
