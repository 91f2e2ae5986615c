"""Parameters that take any object with the members of a protocol, also one that a user wrote."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from fingerslip.errors import InputError

__all__ = ["conforms", "describe", "require", "require_kind"]

T = TypeVar("T")


def describe(value: object) -> str:
    """Return what errors call a value of the wrong type.

    Examples
    --------
    >>> describe(0.5), describe("plate"), describe([1, 2])
    ('0.5', "'plate'", 'a list')
    """
    return repr(value) if isinstance(value, str | int | float | None) else f"a {type(value).__name__}"


def require(value: Any, protocol: type[T], needs: str, where: str = "") -> T:
    """Return a value that has all members of a protocol; refuse any other."""
    members = [name for name in vars(protocol) if not name.startswith("_")]
    missing = [name for name in members if not hasattr(value, name)]
    if isinstance(value, type):
        raise InputError(where, f"got the class {value.__name__}", f"needs {needs}", f"write {value.__name__}(...)")
    if missing:
        repair = f"{type(value).__name__} lacks {', '.join(missing)}" if len(missing) < len(members) else ""
        raise InputError(where, f"got {describe(value)}", f"needs {needs}", repair)
    return value  # type: ignore[no-any-return]


def require_kind(value: Any, kind: type[T] | tuple[type, ...], needs: str, where: str) -> T:
    """Return a value of a class; refuse any other."""
    if not isinstance(value, kind):
        raise InputError(where, f"got {describe(value)}", f"needs {needs}")
    return value  # type: ignore[return-value]


def conforms(protocol: type[T], needs: str) -> Callable[[Any], T]:
    """Return the validator of a parameter that :func:`require` checks."""
    return lambda value: require(value, protocol, needs)
