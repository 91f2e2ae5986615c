"""Which law a study file means: `law` in a material names it, and without it the material is linear elastic."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import operator
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import pydantic

from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.finite import FiniteMaterial
from fingerslip.materials.material import Material
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden

__all__ = ["LAWS", "AnyMaterial", "MaterialChoice", "kept_values"]

#: A law of small strain or of large strain.
AnyMaterial: TypeAlias = Material | FiniteMaterial

#: The laws that a study file may name. A new law is its file, with a field `law`, and its entry here.
LAWS: tuple[type[AnyMaterial], ...] = (Elastic, NeoHookean, MooneyRivlin, Ogden)

_DEFAULT = "elastic"


def _fields(law: type) -> Mapping[str, dataclasses.Field[Any]]:
    return {field.name: field for field in dataclasses.fields(law)}


_LAWS: Mapping[str, type] = MappingProxyType({str(_fields(law)["law"].default): law for law in LAWS})


def kept_values(values: Mapping[str, Any], changes: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return which values of a preset's material are left by changes: of another law those that it needs.

    Parameters
    ----------
    values : mapping of str to object
        Values of the material, or of any other group of a preset, which no `law` changes.
    changes : mapping of str to object
        Other values of the material, with the name of its `law` where that is another one.

    Examples
    --------
    >>> kept_values({"youngs_modulus": "34 kPa", "poisson_ratio": 0.48, "density": "1 kg/m^3"}, {"law": "ogden"})
    {'density': '1 kg/m^3'}
    """
    own = values.get("law", _DEFAULT)
    law = changes.get("law", own)
    if law not in _LAWS or law == own:
        return values
    needed = [name for name, field in _fields(_LAWS[law]).items() if field.default is dataclasses.MISSING]
    return {name: value for name, value in values.items() if name in needed}


def _name(value: object) -> str:
    return str(value.get("law", _DEFAULT) if isinstance(value, Mapping) else getattr(value, "law", _DEFAULT))


def _check_name(value: object) -> object:
    name = _name(value)
    if name not in _LAWS:
        near = difflib.get_close_matches(name, _LAWS, n=1)
        repair = f"did you mean '{near[0]}'?" if near else ""
        raise InputError("law", f"'{name}' is not known", f"needs one of {', '.join(_LAWS)}", repair)
    return value


if TYPE_CHECKING:
    MaterialChoice = AnyMaterial
else:
    #: A material of a study file or a preset, by its `law`.
    MaterialChoice = Annotated[
        functools.reduce(operator.or_, (Annotated[law, pydantic.Tag(name)] for name, law in _LAWS.items())),
        pydantic.Discriminator(_name),
        pydantic.BeforeValidator(_check_name),
    ]
