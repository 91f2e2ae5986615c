"""Objects of other classes are taken where they have all members, and else refused with what is missing."""

from __future__ import annotations

from typing import Protocol

import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.parameters.schema import conforms, require


class Duck(Protocol):
    """What a duck can do."""

    @property
    def name(self) -> str:
        """What it is called."""

    def quack(self) -> str:
        """Make a noise."""


class Mallard:
    name = "m"

    def quack(self) -> str:
        return "q"


class Swan:
    name = "s"


def test_an_object_with_all_members_is_returned_as_it_is() -> None:
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
def test_anything_else_is_refused_with_what_is_missing(value: object, message: str) -> None:
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
