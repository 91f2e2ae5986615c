"""What the annotations of parameter sets say, and mistakes in them: where they are, what is allowed, how to mend it."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import types
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import pydantic
from pydantic_core import CoreSchema, PydanticKnownError, core_schema

from fingerslip.errors import InputError, shorten
from fingerslip.parameters.dotted import guesses, is_below, join_path, known_part
from fingerslip.units import Unit

T = TypeVar("T")

_IN_FILE, _AS_OBJECT = "under its key", "as an object"


@dataclasses.dataclass(frozen=True, eq=False)
class Choice:
    """Mark of a field that holds one of several kinds; files write it under the key that names its kind."""

    form: type[Any]  # the parameter set that files write: an optional field for each kind, of which one is given
    kinds: Mapping[str, type]  # the kinds by their keys

    def key_of(self, value: object) -> str:
        """Return the key of a value."""
        return next(key for key, kind in self.kinds.items() if type(value) is kind)

    def under_key(self, value: object, plain: Any) -> dict[str, Any]:
        """Return a value as plain data under its key, beside the keys of the other kinds without any."""
        return dict.fromkeys(self.kinds) | {self.key_of(value): plain}

    def __get_pydantic_core_schema__(self, source: object, handler: pydantic.GetCoreSchemaHandler) -> CoreSchema:
        def require_mapping(value: object, info: core_schema.ValidationInfo) -> object:
            if info.context and not isinstance(value, (Mapping, *self.kinds.values())):
                raise PydanticKnownError("dataclass_type", {"class_name": self.form.__name__})
            return value

        def member(form: object) -> object:
            return next(value for key in self.kinds if (value := getattr(form, key)) is not None)

        form = core_schema.no_info_after_validator_function(member, handler.generate_schema(self.form))
        either = core_schema.tagged_union_schema(
            {_IN_FILE: form, _AS_OBJECT: handler(source)},
            lambda value: _IN_FILE if isinstance(value, Mapping) else _AS_OBJECT,
        )
        return core_schema.with_info_before_validator_function(require_mapping, either)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: pydantic.GetJsonSchemaHandler) -> Any:
        either: Any = schema
        return handler(either["schema"]["choices"][_IN_FILE])


@dataclasses.dataclass(frozen=True)
class Location:
    """Where in a parameter set a mistake is."""

    path: tuple[str, ...] = ()  # keys and numbers of items that lead to it
    owner: type | None = None  # the parameter set whose field the last key names
    unit: Unit | None = None  # the unit of the quantity that stands there
    hint: Any = None  # the annotation of that

    @property
    def keys(self) -> list[str]:
        """The keys that may stand there."""
        return [field.name for field in dataclasses.fields(self.owner)] if self.owner else []


@functools.cache
def type_hints(cls: type) -> dict[str, Any]:
    """Return the annotations of a class by field, with their marks."""
    return get_type_hints(cls, include_extras=True)


@functools.cache
def unit_of(cls: type, name: str) -> Unit | None:
    """Return the unit mark of field `name` of `cls`, None where it has none."""
    return next(_marks_in(type_hints(cls).get(name), Unit), None)


@functools.cache
def choice_of(cls: type, name: str) -> Choice | None:
    """Return the choice among kinds of field `name` of `cls`, None where it has none."""
    return next(_marks_in(type_hints(cls).get(name), Choice), None)


def locate(cls: type, location: Sequence[int | str]) -> Location:
    """Return what pydantic's location of a mistake means.

    Such a location has the keys that lead to the mistake, and between them the tags of union members, which no user
    wrote. What is which follows from the annotations, so a key may have any name.
    """
    hint: Any = cls
    owner: type | None = None
    path: list[str] = []
    if len(location) > 1 and location[-1] == "[key]" and not isinstance(location[-2], str):
        location = location[:-1]  # the mark behind a key that is no text, and wrong itself
    for part in location:
        hint, marks = _plain(hint)
        choice = next((mark for mark in marks if isinstance(mark, Choice)), None)
        if choice and part in {_IN_FILE, _AS_OBJECT}:
            hint = choice.form if part == _IN_FILE else hint
            continue
        if _union(hint):
            members = [member for member in _union(hint) if member is not type(None)]
            named = (member for member in members if _name_of(member) == part)
            nameless = (member for member in members if not dataclasses.is_dataclass(_plain(member)[0]))
            hint = next(named, next(nameless, None))
            continue
        owner, name, hint = _inside(hint, part)
        path.append(name)
    return Location(tuple(path), owner, next(_marks_in(hint, Unit), None), hint)


def _inside(hint: Any, part: int | str) -> tuple[type | None, str, Any]:
    """Return the parameter set that owns the key `part`, its name, and the annotation of what it leads to."""
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        fields = dataclasses.fields(hint)
        # Of positional arguments there may be more than fields.
        name = fields[part].name if isinstance(part, int) and part < len(fields) else str(part)
        return hint, name, type_hints(hint).get(name)
    arguments = get_args(hint)
    origin = get_origin(hint)
    if isinstance(origin, type) and issubclass(origin, Mapping) and arguments:
        return None, str(part), arguments[1]
    if isinstance(origin, type) and issubclass(origin, Sequence) and arguments:
        number = part if isinstance(part, int) and part < len(arguments) and Ellipsis not in arguments else 0
        return None, str(part), arguments[number]
    return None, str(part), None


def _plain(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return an annotation without its marks and without None, and the marks."""
    marks: tuple[Any, ...] = ()
    while True:
        if get_origin(hint) is Annotated:
            marks += hint.__metadata__
            hint = get_args(hint)[0]
            continue
        members = _union(hint)
        if type(None) not in members or len(members) != 2:
            return hint, marks
        hint = next(member for member in members if member is not type(None))


def _union(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else ()


def _name_of(member: Any) -> str:
    plain, marks = _plain(member)
    tags = (mark.tag for mark in marks if isinstance(mark, pydantic.Tag))
    return next(tags, getattr(plain, "__name__", ""))


def _marks_in(hint: object, kind: type[T]) -> Iterator[T]:
    for mark in getattr(hint, "__metadata__", ()):
        if isinstance(mark, kind):
            yield mark
    for argument in get_args(hint):
        yield from _marks_in(argument, kind)


_UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden")
_ALIKE = 0.5
_SIGNS = MappingProxyType(
    {"greater than or equal to ": ">= ", "less than or equal to ": "<= ", "greater than ": "> ", "less than ": "< "}
)
_PLAIN_NEEDS = MappingProxyType(
    {
        "multiple_argument_values": "needs its value once, by place or by name",
        "unexpected_positional_argument": "needs fewer values, or their names",
        **dict.fromkeys(("dataclass_type", "dict_type", "mapping_type"), "needs keys and values"),
        **dict.fromkeys(("tuple_type", "list_type"), "needs a list"),
        "string_type": "needs text",
        **dict.fromkeys(("float_type", "float_parsing"), "needs a number"),
        "finite_number": "needs a finite number",
        **dict.fromkeys(("int_type", "int_parsing", "int_from_float"), "needs a whole number"),
        **dict.fromkeys(("bool_type", "bool_parsing"), "needs true or false"),
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
        plain, example = _plain(location.hint)[0], _example(location.hint)
        choices = ", ".join(get_args(plain)) if get_origin(plain) is Literal else ""
        needs = f"one of {choices}" if choices else f"a value such as {example}" if example else "a value"
        yield InputError(where, "is missing", f"needs {needs}")
    elif detail["type"] in _UNKNOWN:
        near = _nearest_key(location)
        repair = guesses(location.path[-1], _inner_paths(location)) or (f"did you mean '{near}'?" if near else "")
        yield InputError(where, "is not known", f"may be one of {', '.join(location.keys)}", repair)
    else:
        value, unit = detail["input"], location.unit
        is_quantity = unit and isinstance(value, int | float) and not isinstance(value, bool)
        text = unit.format(value) if unit and is_quantity else shorten(repr(value))
        needed = str(detail["msg"]).removeprefix("Input should be ").removeprefix("Value error, ")
        for words, sign in _SIGNS.items():
            needed = needed.replace(words, f"a {'value' if unit else 'number'} {sign}")
        fault = "is empty" if value is None else f"got {text}"
        yield InputError(where, fault, _PLAIN_NEEDS.get(detail["type"], f"needs {needed}"))


def _example(hint: Any) -> str:
    """Return a value that an annotation allows, as files write it: a quantity, or a group that needs only such."""
    plain, marks = _plain(hint)
    if isinstance(plain, type) and dataclasses.is_dataclass(plain):
        required = [field.name for field in dataclasses.fields(plain) if field.default is field.default_factory]
        # Of several, one may have to be larger than another.
        value = _example(type_hints(plain)[required[0]]) if len(required) == 1 else ""
        return f"{{{required[0]}: {value}}}" if value else ""
    if _union(plain):
        return _example(_union(plain)[0])
    return next((f"1.5 {mark.shown}" for mark in marks if isinstance(mark, Unit)), "")


def _inner_paths(location: Location) -> Iterator[str]:
    """Yield the paths of what may stand in the groups beside a key."""
    for name, hint in (type_hints(location.owner) if location.owner else {}).items():
        for member in _union(_plain(hint)[0]) or (hint,):
            group, _ = _plain(member)
            yield from (f"{name}.{field.name}" for field in getattr(group, "__dataclass_fields__", {}).values())


def _nearest_key(location: Location) -> str:
    key = location.path[-1]
    near = difflib.get_close_matches(key, location.keys, n=1, cutoff=_ALIKE)
    # FA-I for FA-II is no slip of the pen.
    is_another = bool(near) and ("_ii_" in key) != ("_ii_" in near[0])
    return near[0] if near and not is_another else ""
