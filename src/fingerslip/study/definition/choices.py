"""Settings that are one of several kinds, under the key that names the kind: ``counterface: {sphere: {...}}``."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable
from typing import Any, TypeVar, get_args

from fingerslip.errors import InputError
from fingerslip.parameters import parameters

__all__ = ["choice_of", "chosen", "kinds_of"]

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
    return next(iter(_given(choice).items()))


def _given(choice: object) -> dict[str, Any]:
    values = {field.name: getattr(choice, field.name) for field in dataclasses.fields(choice)}  # type: ignore[arg-type]
    return {name: value for name, value in values.items() if value is not None}


def _check(choice: object, what: str) -> None:
    """Refuse a choice of which not exactly one field is given."""
    given = _given(choice)
    if len(given) != 1:
        known = ", ".join(field.name for field in dataclasses.fields(choice))  # type: ignore[arg-type]
        raise InputError("", f"has {' and '.join(given) or f'no {what}'}", f"needs one of {known}")


def _summary(kind: type) -> str:
    return (inspect.getdoc(kind) or "").partition("\n")[0]
