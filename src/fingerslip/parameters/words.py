"""What parameters are, in words: beside each field of a class, in its docstring and in schemas."""

from __future__ import annotations

import dataclasses
import inspect
import re
import textwrap
from collections.abc import Mapping
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import pydantic

T = TypeVar("T")

_ENTRY = re.compile(r"^(?P<names>\w+(?:, \w+)*) : .*\n(?P<words>(?:(?:    .*)?(?:\n|$))*)", re.MULTILINE)
_ROLE = re.compile(r":\w+:`~?(?:[\w.]*\.)?(\w+)`")
_SECTION = re.compile(r"^\w[\w ]*\n-+\n", re.MULTILINE)
_WIDTH = 120


def describe_fields(cls: type[T]) -> type[T]:
    """Give the docstring of a dataclass a section of its parameters, by the words beside the fields.

    A field is ``mass: Annotated[Mass, "Mass of the object [kg]."]``. Words begin with the type where the annotation
    does not say it, as in ``"(n,) array : Times [s]."``.
    """
    described: Any = cls
    hints = vars(cls).get("__pydantic_fields__") or {
        name: pydantic.fields.FieldInfo.from_annotation(hint)
        for name, hint in get_type_hints(cls, include_extras=True).items()
    }
    entries = [
        _entry(field, words, hints[field.name].annotation)
        for field in dataclasses.fields(described)
        for words in hints[field.name].metadata
        if isinstance(words, str)
    ]
    text = f"{inspect.cleandoc(cls.__doc__ or '')}\n\n"
    section = _SECTION.search(text)
    # A class that has the section says there what differs from its bases.
    if entries and not (section and section[0].startswith("Parameters\n")):
        start = section.start() if section else len(text)
        cls.__doc__ = f"{text[:start]}Parameters\n----------\n{''.join(entries)}\n{text[start:]}".rstrip()
        # Help would show all words twice. Subclasses of plain dataclasses would inherit a signature.
        if "__signature__" in vars(cls):
            signature = inspect.signature(cls)
            bare = [entry.replace(annotation=entry.empty) for entry in signature.parameters.values()]
            described.__signature__ = signature.replace(parameters=bare)
        else:
            described.__init__.__annotations__ = {"return": None}
    return cls


def _entry(field: dataclasses.Field[Any], words: str, annotation: Any) -> str:
    kind, separator, explanation = words.partition(" : ")
    if not separator:
        explanation, kind = words, _type_words(annotation)
        if type(None) in get_args(annotation):
            is_needed = field.default is field.default_factory is dataclasses.MISSING
            kind += " or None" if is_needed else ", optional"
    return f"{field.name} : {kind}\n{textwrap.indent(textwrap.fill(explanation, _WIDTH - 4), '    ')}\n"


def _type_words(annotation: Any) -> str:
    """Return a type as docstrings write it, such as 'tuple of float'."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated or annotation is Any:
        return _type_words(arguments[0] if arguments else object)
    if origin is Literal:
        return f"{{{', '.join(map(repr, arguments))}}}"
    inner = [_type_words(argument) for argument in arguments if argument not in (type(None), Ellipsis)]
    if origin in (Union, UnionType):
        return " or ".join(", ".join(inner).rsplit(", ", 1))
    if origin is tuple and Ellipsis not in arguments:
        return f"({', '.join(inner)})"
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return f"mapping of {inner[0]} to {inner[1]}"
    return f"{origin.__name__} of {inner[0]}" if origin else str(getattr(annotation, "__name__", annotation))


def field_words(cls: type) -> dict[str, str]:
    """Return what the docstring of a class says of each of its parameters."""
    words: dict[str, str] = {}
    for base in reversed(cls.__mro__[:-1]):
        text = inspect.cleandoc(base.__doc__ or "")
        section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", text, re.DOTALL | re.MULTILINE)
        for entry in _ENTRY.finditer(section[1] if section else ""):
            words |= dict.fromkeys(entry["names"].split(", "), plain_words(entry["words"]))
    return words


def plain_words(words: str) -> str:
    """Return words of a docstring on one line and without its marks."""
    return _ROLE.sub(r"\1", " ".join(words.split())).replace("``", "").replace("`", "")
