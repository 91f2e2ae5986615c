"""What pydantic finds wrong in parameter sets, in four parts and plain words."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import pydantic

from fingerslip.errors import InputError, shorten
from fingerslip.parameters.dotted import is_below, join_path, known_part
from fingerslip.parameters.fields import Location, locate
from fingerslip.units import Unit

_UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden")
_ALIKE = 0.5
_SIGNS = MappingProxyType(
    {
        "greater than or equal to ": ">= ",
        "less than or equal to ": "<= ",
        "greater than ": "> ",
        "less than ": "< ",
    }
)
_PLAIN_NEEDS = MappingProxyType(
    {
        "multiple_argument_values": "needs its value once, by place or by name",
        "unexpected_positional_argument": "needs fewer values, or their names",
        "dataclass_type": "needs keys and values",
        "dict_type": "needs keys and values",
        "mapping_type": "needs keys and values",
        "tuple_type": "needs a list",
        "list_type": "needs a list",
        "string_type": "needs text",
        "float_type": "needs a number",
        "float_parsing": "needs a number",
        "finite_number": "needs a finite number",
        "int_type": "needs a whole number",
        "int_parsing": "needs a whole number",
        "int_from_float": "needs a whole number",
        "bool_type": "needs true or false",
        "bool_parsing": "needs true or false",
    }
)

_Detail = Mapping[str, Any]


def mistakes_in(error: pydantic.ValidationError, cls: type) -> tuple[InputError, ...]:
    """Return everything that pydantic found wrong."""
    details = [(detail, locate(cls, detail["loc"])) for detail in error.errors(include_url=False)]
    misspelt = {
        join_path(*location.path[:-1], near)
        for detail, location in details
        if detail["type"] in _UNKNOWN and (near := _nearest_key(location))
    }
    mistakes = [
        mistake
        for detail, location in details
        if not (detail["type"] == "missing" and join_path(*location.path) in misspelt)
        for mistake in _mistakes(detail, location)
    ]
    return tuple({str(mistake): mistake for mistake in mistakes}.values())


def in_order(mistakes: Iterable[InputError], paths: Iterable[str], front: str = "") -> list[InputError]:
    """Return mistakes in the order in which a file holds the values that they are about."""
    order = {path: number for number, path in enumerate(paths)}

    def position(mistake: InputError) -> tuple[int, bool]:
        path = mistake.where.removeprefix(front)
        group = known_part(path, order)
        if group == path and group in order:
            return order[group], False
        inside = (number for available, number in order.items() if not group or is_below(available, group))
        return max(inside, default=0), True

    return sorted(mistakes, key=position)


def _mistakes(detail: _Detail, location: Location) -> Iterator[InputError]:
    where = join_path(*location.path)
    cause = (detail.get("ctx") or {}).get("error")
    if isinstance(cause, InputError):
        yield from (mistake.moved(lambda inner: join_path(where, inner)) for mistake in cause.all)
    elif detail["type"] == "missing":
        yield InputError(where, "is missing", "needs a value")
    elif detail["type"] in _UNKNOWN:
        near = _nearest_key(location)
        repair = f"did you mean '{near}'?" if near else ""
        yield InputError(where, "is not known", f"may be one of {', '.join(_known_keys(location))}", repair)
    else:
        needed = _PLAIN_NEEDS.get(detail["type"]) or _requirement(str(detail["msg"]), location.unit)
        value = detail["input"]
        fault = "is empty" if value is None else f"got {_show(value, location.unit)}"
        yield InputError(where, fault, needed)


def _known_keys(location: Location) -> Sequence[str]:
    return [field.name for field in dataclasses.fields(location.owner)] if location.owner else []


def _nearest_key(location: Location) -> str:
    near = difflib.get_close_matches(location.path[-1], _known_keys(location), n=1, cutoff=_ALIKE)
    return near[0] if near else ""


def _show(value: object, unit: Unit | None) -> str:
    if unit and isinstance(value, int | float) and not isinstance(value, bool):
        return unit.format(value)
    return shorten(repr(value))


def _requirement(message: str, unit: Unit | None) -> str:
    text = message.removeprefix("Input should be ").removeprefix("Value error, ")
    for words, sign in _SIGNS.items():
        text = text.replace(words, f"a {'value' if unit else 'number'} {sign}")
    return f"needs {text}"
