"""Choices have one field for every member of a union, and exactly one of them is given."""

from __future__ import annotations

import dataclasses

import pytest

from fingerslip.contact.counterfaces import BuiltInCounterface, Plane
from fingerslip.contact.friction import BuiltInLaw, Coulomb, StaticKinetic
from fingerslip.errors import InputError
from fingerslip.model.programme import Phase
from fingerslip.parameters import from_mapping, parameters
from fingerslip.parameters.schema import json_schema
from fingerslip.study.definition.file import choice_of, chosen, kinds_of


@parameters
class Cat:
    """A small one."""

    age: int


@parameters
class WildDog:
    """A large one."""

    age: int


@choice_of(Cat | WildDog, "animal")
class Animal:
    """One of several."""


def test_kinds_are_named_in_snake_case() -> None:
    assert list(kinds_of(BuiltInLaw))[:4] == ["coulomb", "static_kinetic", "pressure_dependent", "anisotropic"]
    assert list(kinds_of(BuiltInCounterface))[:3] == ["plane", "cylinder", "sphere"]
    assert list(kinds_of(Phase)) == ["press", "hold", "slide", "lift"]
    assert kinds_of(BuiltInLaw)["static_kinetic"] is StaticKinetic
    assert list(kinds_of(Plane | Coulomb)) == ["plane", "coulomb"]


def test_a_member_that_is_added_to_the_union_can_be_chosen() -> None:
    made = from_mapping(Animal, {"wild_dog": {"age": 3}}, "file")
    assert chosen(made) == ("wild_dog", WildDog(3))
    assert [field.name for field in dataclasses.fields(Animal)] == ["cat", "wild_dog"]  # type: ignore[arg-type]
    assert set(json_schema(Animal)["properties"]) == {"cat", "wild_dog"}


def test_the_docstring_lists_the_kinds() -> None:
    assert Animal.__doc__ is not None
    assert Animal.__doc__.startswith(
        "One of several.\n\nParameters\n----------\ncat : Cat, optional\n    A small one.\n"
    )


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "file: has no animal, needs one of cat, wild_dog"),
        ({"cat": {"age": 1}, "wild_dog": {"age": 2}}, "file: has cat and wild_dog, needs one of cat, wild_dog"),
        ({"wolf": {}}, "file: wolf: is not known, may be one of cat, wild_dog"),
        ({"cat": {"age": "x"}}, "file: cat.age: got 'x', needs a whole number"),
    ],
)
def test_mistakes_name_the_kinds(values: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        from_mapping(Animal, values, "file")
    assert str(caught.value).startswith(message)
