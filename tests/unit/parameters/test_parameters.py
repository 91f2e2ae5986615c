"""Parameter sets: made, read from plain data, written back, with one of several kinds in a field; dotted paths."""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Mapping
from typing import Annotated

import pydantic
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.contact.friction import Coulomb
from fingerslip.errors import InputError, MeshError
from fingerslip.materials.elastic import Elastic
from fingerslip.model.programme import Hold
from fingerslip.model.timing import TimeStepping
from fingerslip.parameters import (
    FileName,
    Length,
    PositiveLength,
    as_mapping,
    from_mapping,
    one_of,
    parameters,
    plain_fields,
    valid_fields,
    walk_values,
)
from fingerslip.parameters.dotted import assign, flatten, is_below, known_part, nearest, walk
from fingerslip.parameters.schema import json_schema


@parameters
class Inner:
    """A part."""

    width: PositiveLength
    places: tuple[Length, ...] = ()

    def __post_init__(self):
        if self.width > 1.0:
            raise MeshError("width", f"got {self.width} m", "needs <= 1 m")


@parameters
class Outer:
    """A whole."""

    inner: Inner
    parts: Mapping[str, Inner] = pydantic.Field(default_factory=dict)
    count: Annotated[int, pydantic.Field(ge=1)] = 1
    name: str = ""

    def __post_init__(self):
        if self.name == "wrong":
            raise InputError("", "is wrong as a whole", "needs another name")


def test_python_passes_si_numbers_or_text_and_sets_are_frozen_and_go_to_worker_processes():
    inner = Inner(width=0.5)
    assert inner == Inner(width="50 cm")
    with pytest.raises(dataclasses.FrozenInstanceError):
        inner.width = 1.0
    for value in (Hold(0.5), TimeStepping(step=0.005), Elastic(1.0, 0.3, 1.0)):
        assert pickle.loads(pickle.dumps(value)) == value


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"inner": {"width": "-1 mm"}}, "f: inner.width: got '-1 mm', needs a value > 0"),
        ({"inner": {}}, "f: inner.width: is missing, needs a value such as 1.5 mm"),
        ({"inner": 3}, "f: inner: got 3, needs keys and values"),
        ({"inner": None}, "f: inner: is empty, needs keys and values"),
        ({"inner": {"width": True}}, "f: inner.width: got true, needs a quantity such as '1.5 mm'"),
        ({"inner": {"width": "1 mm"}, "count": 0}, "f: count: got 0, needs a number >= 1"),
        ({"inner": {"width": "1 mm"}, "count": 1.5}, "f: count: got 1.5, needs a whole number"),
        ({"inner": {"width": "1 mm"}, "name": "wrong"}, "f: is wrong as a whole, needs another name"),
        ({"inner": {"width": "2 m"}}, "f: inner.width: got 2.0 m, needs <= 1 m"),
        ({"inner": {"width": "1 mm"}, "parts": {"a": {"width": "2 m"}}}, "f: parts.a.width: got 2.0 m, needs <= 1 m"),
    ],
)
def test_errors_of_files_name_the_path(values, message):
    with pytest.raises(InputError) as caught:
        from_mapping(Outer, values, "f")
    assert str(caught.value) == message
    assert isinstance(caught.value, MeshError) == ("<= 1 m" in message), "an error keeps its kind"


ELASTIC = {"youngs_modulus": "1 kPa", "poisson_ratio": True, "density": "1000 kg/m^3"}


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: from_mapping(Inner, {"width": "0 mm"}, "f.yaml: tip"), "f.yaml: tip.width: got '0 mm', needs a value"),
        (lambda: from_mapping(Inner, {"width": "inf m"}, "f"), "f: width: 'inf m' is not a quantity, needs a number"),
        (lambda: from_mapping(Inner, {"width": "1e999 m"}, "f"), "f: width: got '1e999 m', needs a number that"),
        (lambda: from_mapping(Elastic, ELASTIC, "f"), "f: poisson_ratio: got true, needs a number"),
        (lambda: Coulomb(False), "Coulomb.coefficient: got false, needs a number"),
        (lambda: Elastic(34e3, 0.6, 1000.0), "Elastic.poisson_ratio: got 0.6, needs a number <= 0.5"),
    ],
)
def test_truth_values_are_no_numbers_and_python_names_the_class(make, message):
    with pytest.raises(InputError) as caught:
        make()
    assert str(caught.value).startswith(message)


@given(width=st.floats(1e-12, 1.0), places=st.lists(st.floats(-1e6, 1e6), max_size=3), modulus=st.floats(1e-3, 1e12))
def test_written_parameters_read_back_exactly(width, places, modulus):
    part = Inner(width=width, places=tuple(places))
    whole = Outer(inner=part, parts={"a": part}, count=3, name="n")
    assert from_mapping(Outer, as_mapping(whole), "f") == whole
    material = Elastic(modulus, 0.3, 1000.0)
    assert from_mapping(Elastic, as_mapping(material), "f") == material


@parameters
class Nested:
    """Parts of parts, some of them optional."""

    outer: Outer
    around: Inner = Inner(width=0.25, places=(1.0,))
    several: tuple[Inner, ...] = ()
    loads: Mapping[str, tuple[Length, ...]] = pydantic.Field(default_factory=dict)
    nothing: PositiveLength | None = None


def test_every_value_is_walked_once_with_its_default_and_what_is_empty_is_left_out():
    whole = Nested(Outer(inner=Inner(width=0.5)), several=(Inner(width=0.1),), loads={"left": (1.0, 2.0)})
    outer, around = {"outer.inner.width": 0.5, "outer.count": 1}, {"around.width": 0.25, "around.places": (1.0,)}
    several, loads = {"several.0.width": 0.1}, {"loads.left": (1.0, 2.0)}
    assert {leaf.path: leaf.value for leaf in walk_values(whole)} == outer | around | several | loads
    (load,) = (leaf for leaf in walk_values(whole) if leaf.path == "loads.left")
    assert load.unit is not None
    assert load.unit.si == "m"

    def defaults(whole):
        return {leaf.path for leaf in walk_values(whole) if leaf.is_default}

    inner = Inner(width=0.5)
    assert defaults(Nested(Outer(inner))) == {"outer.count", "around.width", "around.places"}
    assert defaults(Nested(Outer(inner, count=2), Inner(width=0.25))) == {"around.width"}


def test_all_mistakes_of_a_call_come_together():
    with pytest.raises(InputError) as caught:
        Elastic(-1.0, 0.6, "1 m")
    names = [error.where.removeprefix("Elastic.") for error in caught.value.all]
    assert names == ["youngs_modulus", "poisson_ratio", "density"]


def test_fields_that_are_right_on_their_own():
    found = valid_fields(Outer, {"inner": {"width": 1}, "count": 3})
    assert found == {"parts": {}, "count": 3, "name": ""}
    assert plain_fields(Inner, {"width": 0.5, "places": (1.0,)}) == {"width": "0.5 m", "places": ["1.0 m"]}

    @parameters
    class Named:
        file: FileName

    assert Named("a.msh").file == "a.msh"
    with pytest.raises(InputError, match=r"file: got 'a\\x00b', needs the name of a file"):
        Named("a\0b")


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


def test_a_member_is_written_under_its_key_and_held_as_it_is():
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
def test_mistakes_name_the_kinds(values, message):
    with pytest.raises(InputError) as caught:
        from_mapping(Owner, {"pet": values}, "file")
    assert str(caught.value).startswith(message)


keys = st.sampled_from(["a", "b", "c"])
plain = st.dictionaries(
    keys,
    st.recursive(st.integers(), lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3)),
)


def at(values, path):
    for key in path.split("."):
        values = values[int(key)] if isinstance(values, list) else values[key]
    return values


@given(values=plain)
def test_every_path_leads_to_a_value_that_can_be_replaced(values):
    for path in list(walk(values)):
        at(values, path)
    for path in reversed(list(walk(values))):
        assign(values, path, "new")
        assert at(values, path) == "new"


def test_groups_come_before_what_they_hold_and_leaves_of_lists_are_numbered():
    paths = ["b", "b.d", "b.c", "b.c.0", "b.c.1", "b.c.1.e", "a"]
    assert list(walk({"b": {"d": 1, "c": [2, {"e": 3}]}, "a": ()})) == paths
    nested = {"contact": {"friction_coefficient": 0.6}, "programme": [{"press": {"depth": "1 mm"}}], "none": {}}
    assert flatten(nested) == {"contact.friction_coefficient": 0.6, "programme.0.press.depth": "1 mm", "none": {}}


def test_missing_groups_are_made_and_empty_ones_filled():
    values = {"contact": None}
    assign(values, "contact.friction.coulomb", 1)
    assign(values, "time.step", 2)
    assert values == {"contact": {"friction": {"coulomb": 1}}, "time": {"step": 2}}
    for path in ("a.b", "l.1", "l.x", "l.0.c", "l.-1"):  # through a scalar, or beyond a list
        with pytest.raises(LookupError):
            assign({"a": 1, "l": [2]}, path, 3)


def test_parts_and_neighbours_of_a_path():
    assert [is_below(path, "time") for path in ("time.step", "time", "times")] == [True, True, False]
    assert nearest("phalanx.variant", ["fingertip.phalanx.variant", "time.step"]) == "fingertip.phalanx.variant"
    assert known_part("a.b.c", {"a", "a.b"}) == "a.b"
    assert known_part("x.y", {"a"}) == ""
    known = ["contact.friction_coefficient", "fingertip.phalanx.variant", "time.step"]
    assert nearest("time.stp", known) == "time.step"
    assert nearest("qqq", known) is None
