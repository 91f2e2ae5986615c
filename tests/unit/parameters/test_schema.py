"""What editors read of parameter sets, and objects that a user wrote."""

from __future__ import annotations

from typing import Literal, Protocol

import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.parameters.schema import conforms, field_words, json_schema, require


@parameters
class Width:
    """How wide it is.

    More of it.

    Parameters
    ----------
    width, height : float
        Its size, see :class:`~fingerslip.model.model.Model` and ``a``
        [m].
    kind : {'wide', 'narrow'}, optional
        A word.

    Examples
    --------
    count : int
        Not a parameter.
    """

    width: PositiveLength
    height: PositiveLength = 2e-3
    kind: Literal["wide", "narrow"] = "wide"


@parameters
class Sides(Width):
    """Both sides.

    Parameters
    ----------
    kind : {'wide', 'narrow'}
        Another word.
    left : Width, optional
        One side.
    """

    left: Width | None = None


def test_words_are_those_of_the_docstring_and_of_the_bases():
    size = "Its size, see Model and a [m]."
    assert field_words(Width) == {"width": size, "height": size, "kind": "A word."}
    assert field_words(Sides) == {"width": size, "height": size, "kind": "Another word.", "left": "One side."}


def test_schema_says_that_quantities_are_text_with_a_unit_and_parts_have_their_words():
    schema = json_schema(Width)
    width, height = schema["properties"]["width"], schema["properties"]["height"]
    assert width["type"] == "string"
    assert width["description"] == "Its size, see Model and a [m]. A quantity such as '1.5 mm'."
    assert "default" not in width
    assert height["default"] == "0.002 m"
    assert schema["description"] == "How wide it is."
    schema = json_schema(Sides)
    assert schema["properties"]["left"]["description"] == "One side."
    assert schema["$defs"]["Width"]["properties"]["kind"]["default"] == "wide"


class Duck(Protocol):
    """What a duck can do."""

    @property
    def name(self):
        """What it is called."""

    def quack(self):
        """Make a noise."""


class Mallard:
    name = "m"

    def quack(self):
        return "q"


class Swan:
    name = "s"


def test_an_object_with_all_members_is_returned_as_it_is():
    mallard = Mallard()
    assert require(mallard, Duck, "a duck") is mallard
    assert conforms(Duck, "a duck")(mallard) is mallard


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (0.5, "pond: got 0.5, needs a duck"),
        (None, "pond: got None, needs a duck"),
        ("duck", "pond: got 'duck', needs a duck"),
        ([1], "pond: got a list, needs a duck"),
        (Swan(), "pond: got a Swan, needs a duck; Swan lacks quack"),
        (Mallard, "pond: got the class Mallard, needs a duck; write Mallard(...)"),
    ],
)
def test_anything_else_is_refused_with_what_is_missing(value, message):
    with pytest.raises(InputError) as caught:
        require(value, Duck, "a duck", "pond")
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fs.build_section("wang2014-2d"), "fingertip: got 'wang2014-2d', needs a fingertip"),
        (lambda: fs.build_solid(None), "fingertip: got None, needs a fingertip"),
        (lambda: fs.find_events(fs.preset("wang2014-2d")), "history: got a Fingertip, needs a history"),
        (lambda: fs.run_study(fs.preset("wang2014-2d")), "study: got a Fingertip, needs the path of a study file"),
    ],
)
def test_a_value_of_another_class_is_refused(call, message):
    with pytest.raises(fs.InputError, match=message):
        call()
