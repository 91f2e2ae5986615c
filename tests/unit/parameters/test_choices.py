"""A field that holds one of several kinds: files name the kind by a key, and exactly one is given."""

from __future__ import annotations

from typing import Annotated

import pytest

from fingerslip.contact.counterfaces import BuiltInCounterface, Plane
from fingerslip.contact.friction import BuiltInLaw, Coulomb, StaticKinetic
from fingerslip.errors import InputError
from fingerslip.model.programme import Phase
from fingerslip.parameters import as_mapping, from_mapping, kinds_of, one_of, parameters
from fingerslip.parameters.schema import json_schema


@parameters
class Cat:
    """A small one."""

    age: int


@parameters
class WildDog:
    """A large one."""

    age: int


ANIMAL = one_of(Cat | WildDog, "animal", "Animal", "One of several.")


@parameters
class Owner:
    """Somebody."""

    pet: Annotated[Cat | WildDog, ANIMAL]


def test_kinds_are_named_in_snake_case() -> None:
    assert list(kinds_of(BuiltInLaw))[:4] == ["coulomb", "static_kinetic", "pressure_dependent", "anisotropic"]
    assert list(kinds_of(BuiltInCounterface))[:3] == ["plane", "cylinder", "sphere"]
    assert list(kinds_of(Phase)) == ["press", "hold", "slide", "lift"]
    assert kinds_of(BuiltInLaw)["static_kinetic"] is StaticKinetic
    assert list(kinds_of(Plane | Coulomb)) == ["plane", "coulomb"]


def test_a_member_is_written_under_its_key_and_held_as_it_is() -> None:
    owner = from_mapping(Owner, {"pet": {"wild_dog": {"age": 3}}}, "file")
    assert owner == Owner(WildDog(3))
    assert as_mapping(owner) == {"pet": {"cat": None, "wild_dog": {"age": 3}}}
    animal = json_schema(Owner)["$defs"]["Animal"]
    assert animal["properties"]["cat"]["description"] == "A small one."
    assert set(animal["properties"]) == {"cat", "wild_dog"}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "file: pet: has no animal, needs one of cat, wild_dog"),
        ({"cat": {"age": 1}, "wild_dog": {"age": 2}}, "file: pet: has cat and wild_dog, needs one of cat, wild_dog"),
        ({"wolf": {}}, "file: pet.wolf: is not known, may be one of cat, wild_dog"),
        (3, "file: pet: got 3, needs keys and values"),
        ({"cat": {"age": "x"}}, "file: pet.cat.age: got 'x', needs a whole number"),
    ],
)
def test_mistakes_name_the_kinds(values: object, message: str) -> None:
    with pytest.raises(InputError) as caught:
        from_mapping(Owner, {"pet": values}, "file")
    assert str(caught.value).startswith(message)
