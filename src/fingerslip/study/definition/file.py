"""Study files as plain data: YAML, the files they are based on, and what chooses among kinds."""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import functools
import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar, get_args

from fingerslip.errors import InputError, Mistakes, shorten
from fingerslip.parameters import parameters
from fingerslip.parameters.dotted import known_part
from fingerslip.parameters.mistakes import in_order
from fingerslip.parameters.yaml_text import Document, parse_document, to_text

__all__ = [
    "BASE",
    "choice_of",
    "chosen",
    "kinds_of",
    "line_numbers",
    "read_mapping",
    "read_with_base",
    "write_mapping",
]


def read_mapping(path: Path) -> dict[str, Any]:
    """Read a YAML file that holds one mapping."""
    content = copy.deepcopy(_document(_read_text(path), str(path)).content)
    if not isinstance(content, dict):
        fault = "is empty" if content is None else f"holds a {type(content).__name__}"
        raise InputError(str(path), fault, "needs 'key: value' lines")
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
        mistake.moved(lambda where: where, lines.get(known_part(mistake.where.removeprefix(front), lines)))
        for mistake in ordered
    ).error()


# A report reads the file of a run for its values and again for its study; parsing is most of that work.
@functools.lru_cache(maxsize=256)
def _document(text: str, where: str) -> Document:
    return parse_document(text, where)


def _read_text(path: Path) -> str:
    name = path.name.encode(errors="surrogateescape")
    if name.decode(errors="replace").encode() != name:
        repair = "rename the file: results and reports are written under its name"
        raise InputError(shorten(ascii(path.name)), "is a name that is not UTF-8", "needs a study file", repair)
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
        raise InputError(shorten(str(path)), f"cannot be read ({error.strerror})", "needs a study file") from None


#: The key that names the base of a study file.
BASE = "base"


def read_with_base(path: Path) -> dict[str, Any]:
    """Read a study file, and what it does not write from its base.

    Groups are merged key by key; anything else that is written replaces what the base has, lists as a whole.
    """
    files, mappings = [path], [read_mapping(path)]
    while BASE in mappings[-1]:
        base = _base_of(files[-1], mappings[-1].pop(BASE))
        if base in files:
            names = shorten(" -> ".join(file.name for file in (*files, base)))
            fault = f"leads back to {base.name} ({names})"
            raise InputError(f"{files[-1]}: {BASE}", fault, "needs a file without this one as base")
        files.append(base)
        mappings.append(read_mapping(base))
    return functools.reduce(_merge, reversed(mappings))


def _base_of(path: Path, name: object) -> Path:
    """Return the file of a base, which is in the folder of the study, as paths of mesh files are."""
    if not isinstance(name, str) or not name or Path(name).name != name:
        fault = f"got {shorten(repr(name))}"
        raise InputError(f"{path}: {BASE}", fault, "needs the name of a study file in the same folder", "copy it there")
    return path.with_name(name)


def _merge(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        inner = None if key == "sweep" else base.get(key)
        merged[key] = _merge(inner, value) if isinstance(inner, Mapping) and isinstance(value, Mapping) else value
    return merged


T = TypeVar("T")


def kinds_of(union: Any) -> dict[str, type]:
    """Return the members of a union of classes by the keys that study files name them by: the names in snake case.

    Examples
    --------
    >>> class StaticKinetic: ...
    >>> list(kinds_of(StaticKinetic | int))
    ['static_kinetic', 'int']
    """
    return {re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower(): kind for kind in get_args(union)}


def choice_of(union: Any, what: str) -> Callable[[type[T]], type[T]]:
    """Return a class decorator that makes a parameter set with one optional field for each member of a union.

    Exactly one of the fields has to be given; :func:`chosen` returns it. The fields are listed in the docstring.
    """
    kinds = kinds_of(union)

    def decorate(cls: type[T]) -> type[T]:
        fields = "\n".join(f"{key} : {kind.__name__}, optional\n    {_summary(kind)}" for key, kind in kinds.items())
        cls.__doc__ = f"{inspect.getdoc(cls)}\n\nParameters\n----------\n{fields}\n"
        cls.__annotations__ = {key: kind | None for key, kind in kinds.items()}
        for key in kinds:
            setattr(cls, key, None)
        cls.__post_init__ = lambda self: _check(self, what)  # type: ignore[attr-defined]
        return parameters(cls)

    return decorate


def chosen(choice: object) -> tuple[str, Any]:
    """Return the one field of a choice that was given: its key and its value."""
    return next(iter(_given_values(choice).items()))


def _given_values(choice: object) -> dict[str, Any]:
    values = {field.name: getattr(choice, field.name) for field in dataclasses.fields(choice)}  # type: ignore[arg-type]
    return {name: value for name, value in values.items() if value is not None}


def _check(choice: object, what: str) -> None:
    """Refuse a choice of which not exactly one field is given."""
    values = _given_values(choice)
    if len(values) != 1:
        names = ", ".join(field.name for field in dataclasses.fields(choice))  # type: ignore[arg-type]
        raise InputError("", f"has {' and '.join(values) or f'no {what}'}", f"needs one of {names}")


def _summary(kind: type) -> str:
    return (inspect.getdoc(kind) or "").partition("\n")[0]
