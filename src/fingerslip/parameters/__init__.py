"""Parameters: one definition of each serves YAML, Python, errors, tables and JSON Schema.

A parameter set is a frozen dataclass made with :func:`parameters`. Its quantities carry a
:class:`~fingerslip.units.Unit` mark: Python code passes SI floats (or text with a unit), files must
write text with a unit. Both report mistakes as :class:`~fingerslip.errors.InputError`. A field that holds one of
several kinds carries a :class:`~fingerslip.parameters.fields.Choice`: files name the kind by a key.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import Annotated, Any, TypeVar, dataclass_transform, get_args

import pydantic
from pydantic.dataclasses import dataclass as pydantic_dataclass

from fingerslip.errors import InputError, Mistakes, shorten
from fingerslip.parameters.dotted import walk
from fingerslip.parameters.fields import Choice, choice_of, in_order, mistakes_in, type_hints, unit_of
from fingerslip.parameters.words import describe_fields
from fingerslip.units import Unit

Length = Annotated[float, Unit("m", "mm")]
PositiveLength = Annotated[float, Unit("m", "mm"), pydantic.Field(gt=0)]
NonNegativeLength = Annotated[float, Unit("m", "mm"), pydantic.Field(ge=0)]
Duration = Annotated[float, Unit("s", "s"), pydantic.Field(ge=0)]
ShortDuration = Annotated[float, Unit("s", "ms"), pydantic.Field(ge=0)]
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


def _no_truth_value(value: object) -> object:
    """Refuse true and false, which pydantic would take for 1 and 0."""
    if isinstance(value, bool):
        raise InputError("", f"got {str(value).lower()}", "needs a number")
    return value


Number = Annotated[float, pydantic.BeforeValidator(_no_truth_value)]
Fraction = Annotated[Number, pydantic.Field(ge=0, le=1)]
NonNegativeNumber = Annotated[Number, pydantic.Field(ge=0)]


def _no_null(name: str) -> str:
    """Refuse what no system takes as the name of a file."""
    if "\0" in name:
        raise InputError("", f"got {shorten(repr(name))}", "needs the name of a file")
    return name


FileName = Annotated[str, pydantic.AfterValidator(_no_null)]

T = TypeVar("T")

_FROM_TEXT = MappingProxyType({"from_text": True})


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, pydantic.Field))
def parameters(cls: type[T]) -> type[T]:
    """Make `cls` a frozen, checked dataclass whose mistakes raise :class:`InputError`."""
    config = pydantic.ConfigDict(extra="forbid", arbitrary_types_allowed=True, allow_inf_nan=False)
    checked: Any = pydantic_dataclass(frozen=True, config=config)(cls)
    initialise: Callable[..., None] = checked.__init__

    @functools.wraps(initialise)
    def init(self: object, *args: object, **values: object) -> None:
        try:
            initialise(self, *args, **values)
        except pydantic.ValidationError as error:
            raise _together(mistakes_in(error, checked), f"{checked.__name__}.") from None

    checked.__init__ = init
    return describe_fields(checked)


def kinds_of(union: Any) -> dict[str, type]:
    """Return the members of a union of classes by the keys that study files name them by: the names in snake case."""
    return {key_of(kind): kind for kind in get_args(union)}


def key_of(kind: type) -> str:
    """Return the name of a class in snake case.

    Examples
    --------
    >>> key_of(FloatingPointError)
    'floating_point_error'
    """
    return re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower()


def one_of(union: Any, what: str, name: str, words: str) -> Choice:
    """Return the mark of a field that holds a member of a union of parameter sets, under its key in files.

    Errors call a member `what`, such as ``phase``; `name` and `words` stand in schemas.
    """
    kinds = kinds_of(union)

    def check(form: object) -> None:
        keys = [key for key in kinds if getattr(form, key) is not None]
        if len(keys) != 1:
            raise InputError("", f"has {' and '.join(keys) or f'no {what}'}", f"needs one of {', '.join(kinds)}")

    summaries = {key: (inspect.getdoc(kind) or "").partition("\n")[0] for key, kind in kinds.items()}
    fields = "\n".join(f"{key} : {kind.__name__}, optional\n    {summaries[key]}" for key, kind in kinds.items())
    members = {
        "__doc__": f"{words}\n\nParameters\n----------\n{fields}\n",
        "__annotations__": {key: kind | None for key, kind in kinds.items()},
        "__post_init__": check,
        **dict.fromkeys(kinds),
    }
    return Choice(parameters(type(name, (), members)), kinds)


def from_mapping(cls: type[T], values: Mapping[str, Any], where: str = "") -> T:
    """Build a parameter set from a file's mapping, whose quantities are text with units; errors begin with `where`."""
    try:
        return _adapter(cls).validate_python(dict(values), context=_FROM_TEXT)  # type: ignore[no-any-return]
    except pydantic.ValidationError as error:
        # Such as `x.yaml: ` or `x.yaml: fingertip.`
        front = f"{where}{'.' if ': ' in where else ': '}" if where else ""
        raise _together(in_order(mistakes_in(error, cls), walk(values)), front) from None


def valid_fields(cls: type, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a file's mapping that are right on their own, with defaults for what it leaves out."""
    fields: dict[str, Any] = {}
    for name, field in cls.__pydantic_fields__.items():  # type: ignore[attr-defined]
        if name not in values:
            if not field.is_required():
                fields[name] = field.get_default(call_default_factory=True)
            continue
        with contextlib.suppress(pydantic.ValidationError):
            fields[name] = _field_adapter(cls, name).validate_python(values[name], context=_FROM_TEXT)
    return fields


def _together(mistakes: Iterable[InputError], front: str) -> InputError:
    """Return mistakes as one error, with `front` before each path, or without its separator where there is none."""
    alone = front.removesuffix(": ").removesuffix(".")
    return Mistakes([mistake.moved(lambda path: f"{front}{path}" if path else alone) for mistake in mistakes]).error()


def as_mapping(instance: Any) -> Any:
    """Turn a parameter set into plain data, quantities as text with units: the inverse of :func:`from_mapping`."""
    values = {field.name: getattr(instance, field.name) for field in dataclasses.fields(instance)}
    return plain_fields(type(instance), values)


def plain_fields(cls: type, values: Mapping[str, Any]) -> dict[str, Any]:
    """Turn values of fields of a parameter set into plain data, quantities as text with units."""
    return {name: _plain(value, unit_of(cls, name), choice_of(cls, name)) for name, value in values.items()}


def _plain(value: object, unit: Unit | None, choice: Choice | None) -> Any:
    if unit is not None and isinstance(value, int | float):
        # repr keeps every digit, so that a run can be repeated exactly from what was written.
        return f"{value!r} {unit.si}"
    if isinstance(value, Mapping):
        return {str(key): _plain(item, unit, choice) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(item, unit, choice) for item in value]
    if not dataclasses.is_dataclass(value):
        return value
    return as_mapping(value) if choice is None else choice.under_key(value, as_mapping(value))


@dataclasses.dataclass(frozen=True)
class Leaf:
    """A single value of a parameter set."""

    path: str  # its dotted path
    value: Any  # the value, quantities in SI units
    unit: Unit | None  # the unit mark of its field
    is_default: bool  # whether it is the default of its field


def walk_values(instance: Any, prefix: str = "", default: object = dataclasses.MISSING) -> Iterator[Leaf]:
    """Yield every single value of a parameter set, in the order of its fields; what is empty is left out."""
    cls: Any = type(instance)
    for field in dataclasses.fields(instance):
        default_value = getattr(default, field.name, dataclasses.MISSING) if type(default) is cls else field.default
        marks = unit_of(cls, field.name), choice_of(cls, field.name)
        yield from _below(f"{prefix}{field.name}", getattr(instance, field.name), default_value, *marks)


def _below(path: str, value: Any, default: object, unit: Unit | None, choice: Choice | None) -> Iterator[Leaf]:
    if value is None or value in ((), {}, ""):
        return
    if dataclasses.is_dataclass(value):
        yield from walk_values(value, f"{path}.{choice.key_of(value)}." if choice else f"{path}.", default)
    elif isinstance(value, Mapping):
        defaults = default if isinstance(default, Mapping) else {}
        for key, item in value.items():
            yield from _below(f"{path}.{key}", item, defaults.get(key, dataclasses.MISSING), unit, choice)
    elif isinstance(value, tuple) and any(dataclasses.is_dataclass(item) for item in value):
        for number, item in enumerate(value):
            yield from _below(f"{path}.{number}", item, dataclasses.MISSING, unit, choice)
    else:
        yield Leaf(path, value, unit, bool(value == default))


_adapter: Callable[[type], pydantic.TypeAdapter[Any]] = functools.cache(pydantic.TypeAdapter)


@functools.cache
def _field_adapter(cls: type, name: str) -> pydantic.TypeAdapter[Any]:
    return pydantic.TypeAdapter(type_hints(cls)[name])
