"""Study files on disk: reading and writing them as plain data, and finding the line of a mistake."""

from __future__ import annotations

import contextlib
import copy
import functools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fingerslip.errors import InputError, Mistakes, shortened
from fingerslip.parameters.dotted import known_part
from fingerslip.parameters.mistakes import in_order
from fingerslip.parameters.yaml_text import Document, parse_document, to_text

__all__ = ["line_numbers", "read_mapping", "write_mapping"]


def read_mapping(path: Path) -> dict[str, Any]:
    """Read a YAML file that holds one mapping."""
    content = copy.deepcopy(_document(_read_text(path), str(path)).content)
    if not isinstance(content, dict):
        found = "is empty" if content is None else f"holds a {type(content).__name__}"
        raise InputError(str(path), found, "needs 'key: value' lines")
    return content


def write_mapping(mapping: Mapping[str, Any], path: Path, *, comment: str = "") -> None:
    """Write plain data as YAML, keys in their order, below a comment line."""
    text = to_text(mapping)
    path.write_text(f"# {comment}\n{text}" if comment else text, encoding="utf-8")


@contextlib.contextmanager
def line_numbers(path: Path) -> Iterator[None]:
    """Give the mistakes that are raised in the block their lines in a file, and the order in which they stand there."""
    try:
        yield
    except InputError as error:
        raise _with_lines(error, path) from None


def _with_lines(error: InputError, path: Path) -> InputError:
    front = f"{path}: "
    try:
        lines = _document(_read_text(path), str(path)).lines
    except InputError:  # what cannot be read has no lines
        return error
    ordered = in_order(error.all, lines, front)
    return Mistakes(
        one.moved(lambda where: where, lines.get(known_part(one.where.removeprefix(front), lines))) for one in ordered
    ).error()


# A report reads the file of a run for its values and again for its study; parsing is most of that work.
@functools.lru_cache(maxsize=256)
def _document(text: str, where: str) -> Document:
    return parse_document(text, where)


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        near = ", ".join(sorted(str(other) for other in path.parent.glob("*.yaml"))[:6])
        repair = f"in that folder: {near}" if near else ""
        raise InputError(str(path), "is not there", "needs a study file", repair) from None
    except IsADirectoryError:
        raise InputError(str(path), "is a folder", "needs a study file") from None
    except UnicodeDecodeError:
        raise InputError(str(path), "is not text in UTF-8", "needs a study file", "save it as UTF-8") from None
    except OSError as error:  # such as a name that is too long
        raise InputError(shortened(str(path)), f"cannot be read ({error.strerror})", "needs a study file") from None
