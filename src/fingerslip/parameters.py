"""One definition of a parameter serves YAML, Python, errors, tables and JSON Schema.

A parameter set is a frozen dataclass made with :func:`parameters`. Its quantities carry a
:class:`~fingerslip.units.Unit` mark: Python code passes SI floats (or text with a unit), files must
write text with a unit. Both report mistakes as :class:`~fingerslip.errors.InputError`.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, TypeVar, dataclass_transform, get_args, get_type_hints

import pydantic
from pydantic.dataclasses import dataclass as pydantic_dataclass
from pydantic_core import ArgsKwargs

from fingerslip.errors import InputError, warn_renamed
from fingerslip.units import Unit

__all__ = [
    "Angle",
    "Density",
    "Duration",
    "Force",
    "Fraction",
    "Length",
    "Mass",
    "NonNegativeLength",
    "NonNegativeNumber",
    "PositiveDuration",
    "PositiveLength",
    "Pressure",
    "Rate",
    "SignedAcceleration",
    "SignedLength",
    "SignedPressure",
    "SignedSpeed",
    "Speed",
    "Stiffness",
    "as_mapping",
    "from_mapping",
    "json_schema",
    "parameters",
    "unit_of",
    "walk_quantities",
]

SignedLength = Annotated[float, Unit("m", "mm")]
Length = SignedLength
PositiveLength = Annotated[float, Unit("m", "mm"), pydantic.Field(gt=0)]
NonNegativeLength = Annotated[float, Unit("m", "mm"), pydantic.Field(ge=0)]
Duration = Annotated[float, Unit("s", "s"), pydantic.Field(ge=0)]
PositiveDuration = Annotated[float, Unit("s", "ms"), pydantic.Field(gt=0)]
Speed = Annotated[float, Unit("m/s", "mm/s"), pydantic.Field(gt=0)]
Pressure = Annotated[float, Unit("Pa", "kPa"), pydantic.Field(gt=0)]
Density = Annotated[float, Unit("kg/m^3"), pydantic.Field(gt=0)]
Stiffness = Annotated[float, Unit("Pa/m"), pydantic.Field(gt=0)]
Force = Annotated[float, Unit("N")]
Mass = Annotated[float, Unit("kg", "g"), pydantic.Field(gt=0)]
SignedPressure = Annotated[float, Unit("Pa", "kPa")]
SignedSpeed = Annotated[float, Unit("m/s", "mm/s")]
SignedAcceleration = Annotated[float, Unit("m/s^2")]
Rate = Annotated[float, Unit("1/s"), pydantic.Field(ge=0)]
Angle = Annotated[float, Unit("rad", "deg")]
Fraction = Annotated[float, pydantic.Field(ge=0, le=1)]
NonNegativeNumber = Annotated[float, pydantic.Field(ge=0)]

T = TypeVar("T")

_UNKNOWN = {"unexpected_keyword_argument", "extra_forbidden"}
_ALIKE = 0.5
_SIGNS = {
    "greater than or equal to ": ">= ",
    "less than or equal to ": "<= ",
    "greater than ": "> ",
    "less than ": "< ",
}
_PLAIN_NEEDS = {
    "dataclass_type": "needs keys and values",
    "dict_type": "needs keys and values",
    "mapping_type": "needs keys and values",
    "tuple_type": "needs a list",
    "list_type": "needs a list",
    "string_type": "needs text",
    "float_type": "needs a number",
    "float_parsing": "needs a number",
    "int_type": "needs a whole number",
    "int_parsing": "needs a whole number",
    "int_from_float": "needs a whole number",
    "bool_type": "needs true or false",
    "bool_parsing": "needs true or false",
}


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, pydantic.Field))
def parameters(cls: type[T]) -> type[T]:
    """Make `cls` a frozen, checked dataclass whose mistakes raise :class:`InputError`.

    A class whose fields were renamed says so in ``RENAMED``, a class variable that maps old names to new ones. The old
    names are then still read, from Python and from files, with a FutureWarning.
    """
    renamed: Mapping[str, str] = getattr(cls, "RENAMED", {})
    if renamed:
        cls.accept_renamed = pydantic.model_validator(mode="before")(_with_new_names)  # type: ignore[attr-defined]
    config = pydantic.ConfigDict(extra="forbid", arbitrary_types_allowed=True, allow_inf_nan=False)
    made: Any = pydantic_dataclass(frozen=True, config=config)(cls)
    for old, new in renamed.items():
        setattr(made, old, _alias(old, new))
    initialise: Callable[..., None] = made.__init__

    @functools.wraps(initialise)
    def init(self: object, *args: object, **values: object) -> None:
        try:
            initialise(self, *args, **values)
        except pydantic.ValidationError as error:
            raise _input_error(error, made, made.__name__) from None

    made.__init__ = init
    return made  # type: ignore[no-any-return]


@classmethod  # type: ignore[misc]
def _with_new_names(cls: Any, given: Any) -> Any:
    """Give values under old names to the new ones; `given` is what pydantic validates."""
    passed = given.kwargs if isinstance(given, ArgsKwargs) else given
    if not isinstance(passed, Mapping) or passed.keys().isdisjoint(cls.RENAMED):
        return given
    values = dict(passed)
    old_names = [name for name in cls.RENAMED if name in values]
    for old in old_names:
        new = cls.RENAMED[old]
        if new in values:
            raise InputError(old, f"stands beside {new}, its new name", "needs one of the two", f"leave {old} out")
        warn_renamed(old, new)
        values[new] = values.pop(old)
    return ArgsKwargs(given.args, values) if isinstance(given, ArgsKwargs) else values


def _alias(old: str, new: str) -> property:
    """Return a property that reads a field under its old name."""

    def read(self: object) -> Any:
        warn_renamed(old, new)
        return getattr(self, new)

    return property(read, doc=f"Old name of `{new}`.")


def from_mapping(cls: type[T], values: Mapping[str, Any], where: str) -> T:
    """Build a parameter set from a file's mapping, in which every quantity is text with a unit.

    Parameters
    ----------
    cls : type
        A class made with :func:`parameters`.
    values : mapping
        Nested plain data, as YAML gives it.
    where : str
        What errors put first: the file's name, with a colon and a path in it where `values` is a part of the file.

    Raises
    ------
    InputError
        For the first mistake: unknown or missing key, unit, type, range.
    """
    try:
        return _adapter(cls).validate_python(dict(values), context={"from_text": True})  # type: ignore[arg-type, no-any-return]
    except pydantic.ValidationError as error:
        raise _input_error(error, cls, where, separator="." if ": " in where else ": ") from None


def json_schema(cls: type) -> dict[str, Any]:
    """Return the JSON Schema of a parameter set, for editors."""
    return _adapter(cls).json_schema()


def as_mapping(instance: object) -> Any:
    """Turn a parameter set into plain data, quantities as text with units: the inverse of :func:`from_mapping`."""
    if dataclasses.is_dataclass(instance) and not isinstance(instance, type):
        marks = {name: unit_of(type(instance), name) for name in (f.name for f in dataclasses.fields(instance))}
        return {name: _plain(getattr(instance, name), unit) for name, unit in marks.items()}
    return _plain(instance, None)


def _plain(value: object, unit: Unit | None) -> Any:
    if unit is not None and isinstance(value, int | float):
        # repr keeps every digit, so that a run can be repeated exactly from what was written.
        return f"{value!r} {unit.si}"
    if isinstance(value, Mapping):
        return {str(key): _plain(item, unit) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(item, unit) for item in value]
    return as_mapping(value) if dataclasses.is_dataclass(value) else value


def unit_of(cls: type, name: str) -> Unit | None:
    """Return the unit mark of field `name` of `cls`, None where it has none."""
    return next(_units_in(_hints(cls).get(name)), None)


def walk_quantities(instance: object, prefix: str = "") -> Iterator[tuple[str, Any, Unit | None]]:
    """Yield (dotted path, value, unit) of every leaf of a parameter set."""
    for field in dataclasses.fields(instance):  # type: ignore[arg-type]
        value, path = getattr(instance, field.name), f"{prefix}{field.name}"
        if dataclasses.is_dataclass(value):
            yield from walk_quantities(value, f"{path}.")
        elif isinstance(value, tuple) and any(dataclasses.is_dataclass(item) for item in value):
            for place, item in enumerate(value):
                yield from walk_quantities(item, f"{path}.{place}.")
        elif isinstance(value, Mapping) and any(dataclasses.is_dataclass(item) for item in value.values()):
            for key, item in value.items():
                yield from walk_quantities(item, f"{path}.{key}.")
        else:
            yield path, value, unit_of(type(instance), field.name)


@functools.cache
def _adapter(cls: type) -> pydantic.TypeAdapter[Any]:
    return pydantic.TypeAdapter(cls)


@functools.cache
def _hints(cls: type) -> dict[str, Any]:
    return get_type_hints(cls, include_extras=True)


def _units_in(hint: object) -> Iterator[Unit]:
    for mark in getattr(hint, "__metadata__", ()):
        if isinstance(mark, Unit):
            yield mark
    for argument in get_args(hint):
        yield from _units_in(argument)


def _input_error(error: pydantic.ValidationError, cls: type, where: str, separator: str = ".") -> InputError:
    """Say the first mistake of `error` in four parts."""
    mistakes = error.errors()
    first = next((mistake for mistake in mistakes if mistake["type"] in _UNKNOWN), mistakes[0])
    location = tuple(_field_name(cls, part, place) for place, part in enumerate(first["loc"]))
    path = ".".join(str(part) for part in location if not _is_tag(part))
    cause = (first.get("ctx") or {}).get("error")
    if isinstance(cause, InputError):
        path = ".".join(part for part in (path, cause.where) if part)
    place = f"{where}{separator}{path}" if path else where
    if isinstance(cause, InputError):
        return type(cause)(place, cause.found, cause.allowed, cause.repair)
    if first["type"] == "missing":
        return InputError(place, "is missing", "needs a value")
    if first["type"] in _UNKNOWN:
        known = _known_keys(cls, location[:-1])
        near = difflib.get_close_matches(str(location[-1]), known, n=1, cutoff=_ALIKE)
        repair = f"did you mean '{near[0]}'?" if near else ""
        return InputError(place, "is not known", f"may be one of {', '.join(known)}", repair)
    unit = _unit_at(cls, location)
    found = unit.format(first["input"]) if unit and isinstance(first["input"], int | float) else repr(first["input"])
    return InputError(place, f"got {found}", _PLAIN_NEEDS.get(first["type"]) or _need(str(first["msg"]), unit))


def _field_name(cls: type, part: int | str, place: int) -> int | str:
    """Name the field behind a positional argument, which pydantic locates by its number."""
    return dataclasses.fields(cls)[part].name if place == 0 and isinstance(part, int) else part


def _is_tag(part: object) -> bool:
    """Tell whether a part of a location is pydantic's name of a union member, not a key."""
    return isinstance(part, str) and (part[:1].isupper() or "[" in part or part.startswith("function-"))


def _need(message: str, unit: Unit | None) -> str:
    text = message.removeprefix("Input should be ").removeprefix("Value error, ")
    for words, sign in _SIGNS.items():
        text = text.replace(words, f"a {'value' if unit else 'number'} {sign}")
    return f"needs {text}"


def _member(cls: type, part: object) -> type | None:
    """Return the parameter class found under key `part` of `cls`."""
    candidates = list(_classes_in(_hints(cls).get(str(part))))
    return candidates[0] if len(candidates) == 1 else None


def _classes_in(hint: object) -> Iterator[type]:
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        yield hint
    for argument in get_args(hint):
        yield from _classes_in(argument)


def _owner(cls: type, location: tuple[int | str, ...]) -> type:
    """Walk down `location` to the parameter class that owns its last key."""
    current = cls
    for part in location:
        named = next((c for c in _classes_below(cls) if c.__name__ == part), None)
        current = named or _member(current, part) or current
    return current


@functools.cache
def _classes_below(cls: type) -> tuple[type, ...]:
    found: dict[type, None] = {cls: None}
    for hint in _hints(cls).values():
        for member in _classes_in(hint):
            if member not in found:
                found.update(dict.fromkeys(_classes_below(member)))
    return tuple(found)


def _known_keys(cls: type, location: tuple[int | str, ...]) -> list[str]:
    return [field.name for field in dataclasses.fields(_owner(cls, location))]


def _unit_at(cls: type, location: tuple[int | str, ...]) -> Unit | None:
    return unit_of(_owner(cls, location[:-1]), str(location[-1])) if location else None
