"""Choosing a material: by `law` and constants, without a law linear elastic, or from one that ships.

For the latter `preset` names it, and all else in the material overrides its values.
"""

from __future__ import annotations

import dataclasses
import functools
import operator
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import pydantic

from fingerslip.errors import unknown_name
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.material import Material
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden
from fingerslip.parameters.presets import Presets
from fingerslip.parameters.schema import require

#: A law of small strain or of large strain.
AnyMaterial: TypeAlias = Material | FiniteMaterial

#: The laws that a study file may name. A new law is its file, with a field `law`, and its entry here.
LAWS: tuple[type[AnyMaterial], ...] = (Elastic, NeoHookean, MooneyRivlin, Ogden)

#: The key of a material that starts from one that ships.
PRESET = "preset"
_DEFAULT = "elastic"


def _fields(law: type) -> Mapping[str, dataclasses.Field[Any]]:
    return {field.name: field for field in dataclasses.fields(law)}


_LAWS: Mapping[str, type] = MappingProxyType({str(_fields(law)["law"].default): law for law in LAWS})


def kept_values(values: Mapping[str, Any], changes: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return which values of a preset's material are left by changes: of another law those that it needs.

    None are left by a material that starts from another one that ships.
    """
    # Every material needs a density, and no other group has one.
    if "density" not in values:
        return values
    if PRESET in changes:
        return {}
    element = values.get("law", _DEFAULT)
    law = changes.get("law", element)
    if not isinstance(law, str) or law not in _LAWS or law == element:
        return values
    needed = [name for name, field in _fields(_LAWS[law]).items() if field.default is dataclasses.MISSING]
    return {name: value for name, value in values.items() if name in needed}


def _name(value: object) -> str:
    if isinstance(value, Mapping) and PRESET in value:
        return PRESET
    return str(value.get("law", _DEFAULT) if isinstance(value, Mapping) else getattr(value, "law", _DEFAULT))


def _check_name(value: object) -> object:
    name = _name(value)
    if name != PRESET and name not in _LAWS:
        raise unknown_name("law", name, _LAWS)
    return value


_PRESET_SCHEMA: dict[str, Any] = {
    "type": "object",
    "title": "Preset",
    "description": "A material that ships, and the values that differ from it.",
    "properties": {PRESET: {"type": "string", "description": "Its name: fingerslip show lists all."}},
    "required": [PRESET],
}


def _check_preset(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a material that starts from one that ships as it is written, where it is right."""
    MATERIALS.changed(values)
    return values


def conforming_law(value: Any) -> AnyMaterial:
    """Return a material law, also one that a user wrote; refuse any other object."""
    if isinstance(value, Material | FiniteMaterial) and not isinstance(value, type):
        return value
    laws = ", ".join(law.__name__ for law in LAWS)
    finite = any(hasattr(value, name) for name in ("at_rest", "stored_energy", "kirchhoff_stress", "kirchhoff_tangent"))
    kind: Any = FiniteMaterial if finite else Material
    needs = f"a material: {laws}, or an object with the members of {kind.__name__}"
    law: AnyMaterial = require(value, kind, needs)
    return law


def material_of(entry: AnyMaterial | Mapping[str, Any]) -> AnyMaterial:
    """Return the material that an entry of a study means.

    Examples
    --------
    >>> material_of({"preset": "pulp", "youngs_modulus": "40 kPa"}).youngs_modulus
    40000.0
    """
    return MATERIALS.changed(entry) if isinstance(entry, Mapping) else entry


if TYPE_CHECKING:
    MaterialEntry: TypeAlias = AnyMaterial | Mapping[str, Any]
    MaterialChoice: TypeAlias = AnyMaterial
else:
    _FromPreset = Annotated[
        Mapping[str, Any],
        pydantic.AfterValidator(_check_preset),
        pydantic.WithJsonSchema(_PRESET_SCHEMA),
        pydantic.Tag(PRESET),
    ]
    _EachLaw = [Annotated[law, pydantic.Tag(name)] for name, law in _LAWS.items()]
    #: A material of a study file, by its `law`; one with a `preset` is kept as it is written.
    MaterialEntry = Annotated[
        functools.reduce(operator.or_, [*_EachLaw, _FromPreset]),
        pydantic.Discriminator(_name),
        pydantic.BeforeValidator(_check_name),
    ]
    #: The same with all its values.
    MaterialChoice = Annotated[MaterialEntry, pydantic.AfterValidator(material_of)]

_KIND: Any = MaterialChoice
#: The materials that ship.
MATERIALS: Presets[AnyMaterial] = Presets(_KIND, "fingerslip.materials", kept_values)


def material_names() -> tuple[str, ...]:
    """Return the names of all materials that ship.

    Examples
    --------
    >>> import fingerslip as fs
    >>> [name for name in fs.material_names() if "pulp" in name]
    ['pulp', 'pulp-relaxing']
    """
    return MATERIALS.names


def material(name: str) -> AnyMaterial:
    """Return a material that ships.

    Parameters
    ----------
    name : str
        One of :func:`material_names`; any other is refused with an InputError.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.material("pulp").youngs_modulus
    34000.0
    """
    return MATERIALS.read(name)
