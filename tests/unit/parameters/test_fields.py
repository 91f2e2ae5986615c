"""Locations of mistakes: keys may have any name, and only what pydantic put in is left out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import pydantic
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic
from fingerslip.parameters import PositiveLength, from_mapping, parameters
from fingerslip.parameters.fields import locate, type_hints, unit_of
from fingerslip.study.definition.spec import Study
from unit.study.block import block_values


@parameters
class Skin:
    """A member of the unions below, called like a key."""

    width: PositiveLength


@parameters
class Bone:
    """Another member."""

    depth: PositiveLength


def kind(value: Any) -> str:
    return "bony" if isinstance(value, Bone) or (isinstance(value, Mapping) and "depth" in value) else "Skin"


@parameters
class Body:
    """Unions of every kind."""

    layers: Mapping[str, Skin | Bone]
    tagged: (
        Annotated[
            Annotated[Skin, pydantic.Tag("Skin")] | Annotated[Bone, pydantic.Tag("bony")], pydantic.Discriminator(kind)
        ]
        | None
    ) = None
    optional: Mapping[str, Elastic | None] | None = None
    pair: tuple[int, PositiveLength] = (1, 1.0)
    either: float | tuple[PositiveLength, ...] = 1.0


@pytest.mark.parametrize(
    ("parts", "path", "owner"),
    [
        (("layers", "Skin", "Skin", "width"), "layers.Skin.width", Skin),
        (("layers", "Bone", "Skin", "width"), "layers.Bone.width", Skin),
        (("tagged", "bony", "depth"), "tagged.depth", Bone),
        (("tagged", "Skin", "width"), "tagged.width", Skin),
        (("tagged",), "tagged", Body),
        (("optional", "Elastic", "poisson_ratio"), "optional.Elastic.poisson_ratio", Elastic),
        (("optional", 7, "[key]"), "optional.7", None),
        (("optional", "[key]", "poisson_ratio"), "optional.[key].poisson_ratio", Elastic),
        (("pair", 1), "pair.1", None),
        (("either", "tuple[function-before[read(), float], ...]", 0), "either.0", None),
        ((0, "a"), "layers.a", None),
        ((), "", None),
    ],
)
def test_tags_are_left_out_and_keys_are_kept(parts: tuple[int | str, ...], path: str, owner: type | None) -> None:
    found = locate(Body, parts)
    assert ".".join(found.path) == path
    assert found.owner is owner


def test_units_are_those_of_the_quantity_itself() -> None:
    assert [locate(Body, parts).unit for parts in (("pair", 0), ("layers", "a", "Skin"))] == [None, None]
    unit = locate(Body, ("pair", 1)).unit
    assert unit is not None
    assert unit.si == "m"


def test_unit_of_a_field() -> None:
    assert unit_of(Body, "pair") is not None
    assert unit_of(Study, "title") is None
    assert set(type_hints(Skin)) == {"width"}


names = st.sampled_from(["Skin", "Elastic", "function-x", "a[b]", "[key]", "tuple", "Components", "float"]) | st.text(
    st.characters(codec="ascii", exclude_categories=["Cc"], exclude_characters="."), min_size=1
)


@given(name=names)
def test_a_layer_may_have_any_name(name: str) -> None:
    material = {"youngs_modulus": "1 kPa", "poisson_ratio": 2, "density": "1 kg/m^3"}
    values = block_values() | {"materials": {name: material}}
    with pytest.raises(InputError) as caught:
        from_mapping(Study, values)
    assert [error.where for error in caught.value.all] == [f"materials.{name}.poisson_ratio"]


@given(name=names)
def test_a_loaded_boundary_may_have_any_name(name: str) -> None:
    values = block_values() | {"tractions": {name: {"value": ["1 m"], "ramp": {"times": ["0 s"], "factors": [1]}}}}
    with pytest.raises(InputError) as caught:
        from_mapping(Study, values)
    assert caught.value.where == f"tractions.{name}.value.0"
