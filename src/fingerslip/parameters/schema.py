"""JSON Schema of parameter sets, as editors read it: words, units and defaults beside each key."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from fingerslip.errors import InputError
from fingerslip.parameters import plain_fields
from fingerslip.parameters.words import field_words, plain_words


def json_schema(cls: type) -> dict[str, Any]:
    """Return the JSON Schema of a parameter set, for editors: words of the docstring, units, defaults as files have."""
    return TypeAdapter(cls).json_schema(schema_generator=_ForEditors)


class _ForEditors(GenerateJsonSchema):
    """A generator of schemas whose unions do not ask that exactly one member fits: a mesh of 2D may also fit 3D."""

    def tagged_union_schema(self, schema: core_schema.TaggedUnionSchema) -> JsonSchemaValue:
        """Return the schema of a union."""
        union = super().tagged_union_schema(schema)
        return {"anyOf": union["oneOf"]} if "oneOf" in union else union

    def dataclass_schema(self, schema: core_schema.DataclassSchema) -> JsonSchemaValue:
        """Return the schema of a parameter set with its words and defaults."""
        cls, definition = schema["cls"], super().dataclass_schema(schema)
        values = {
            field.name: field.default if field.default_factory is dataclasses.MISSING else field.default_factory()
            for field in dataclasses.fields(cls)
        }
        plain = {name: value for name, value in values.items() if value is not dataclasses.MISSING}
        words, defaults = field_words(cls), plain_fields(cls, plain)
        for name, key in definition.get("properties", {}).items():
            key.pop("title", None)
            sentences = (words.get(name, ""), key.get("description", ""))
            if any(sentences):
                key["description"] = " ".join(f"{sentence.rstrip('.')}." for sentence in sentences if sentence)
            if name in defaults and _is_plain(defaults[name]):
                key["default"] = defaults[name]
        return definition | {"description": plain_words((inspect.getdoc(cls) or "").partition("\n\n")[0])}


def _is_plain(value: object) -> bool:
    """Tell whether a value is what JSON knows."""
    if isinstance(value, Mapping):
        return all(map(_is_plain, value.values()))
    if isinstance(value, Sequence) and not isinstance(value, str):
        return all(map(_is_plain, value))
    return value is None or isinstance(value, bool | int | float | str)


T = TypeVar("T")


def describe(value: object) -> str:
    """Return what errors call a value of the wrong type."""
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
