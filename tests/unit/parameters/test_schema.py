"""What editors read of parameter sets, objects that a user wrote, and presets."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from typing import Annotated, Any, Literal, Protocol

import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.parameters import Density, PositiveLength, parameters
from fingerslip.parameters.presets import Presets, PresetValue
from fingerslip.parameters.schema import conforms, json_schema, require
from fingerslip.parameters.words import describe_fields, field_words


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


@parameters
class Box:
    """A box.

    Examples
    --------
    >>> Box(1.0)
    """

    size: Annotated[PositiveLength | None, "Its size [m]."]
    names: Annotated[tuple[str, ...], "What is in it."] = ()
    form: Literal["round", "square"] = "round"


@describe_fields
@dataclass(frozen=True)
class Lid(Box):
    """A lid."""

    rims: Annotated[Mapping[str, object], "(n,) array : Its rims : all."] = field(default_factory=dict)
    kind: Annotated[Literal["round", "square"], "Its kind."] = "round"
    colour: Annotated[str | None, "Its colour."] = None
    notes: Annotated[Mapping[str, Any], "What else."] = field(default_factory=dict)


@describe_fields
@dataclass(frozen=True)
class Weight:
    """A weight."""

    value: Annotated[float | None, "Its value [kg]; None where it is not known."]


@dataclass(frozen=True)
class Load(Weight):
    """A weight that lasts."""

    duration: float = 1.0


def test_words_beside_fields_stand_in_the_docstring_and_not_in_the_signature():
    of_box = (
        "Parameters\n----------\nsize : float or None\n    Its size [m].\nnames : tuple of str\n    What is in it.\n"
    )
    assert inspect.getdoc(Box) == f"A box.\n\n{of_box}\nExamples\n--------\n>>> Box(1.0)"
    more = "rims : (n,) array\n    Its rims : all.\nkind : {'round', 'square'}\n    Its kind.\n"
    more += "colour : str, optional\n    Its colour.\nnotes : mapping of str to object\n    What else."
    assert inspect.getdoc(Lid) == f"A lid.\n\n{of_box}{more}"
    assert str(inspect.signature(Box)) == "(size, names=(), form='round') -> None"
    assert str(inspect.signature(Weight)) == "(value) -> None"
    assert list(inspect.signature(Load).parameters) == ["value", "duration"]
    assert field_words(Box) == {"size": "Its size [m].", "names": "What is in it."}


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
def test_an_object_with_all_members_is_returned_and_anything_else_refused_with_what_is_missing(value, message):
    mallard = Mallard()
    assert require(mallard, Duck, "a duck") is conforms(Duck, "a duck")(mallard) is mallard
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


DOCUMENT = """
citation: >-
  Someone: A block.
  Journal, 2020.
claims_not: anything
values:
  size.width: {value: 10 mm, source: someone2020, note: measured}
  size.height: {value: 5 mm, source: assumed}
  density: {value: 1000 kg/m^3, source: someone2020, note: of water}
  soft: {value: true, source: assumed}
"""


@parameters
class Size:
    """Width and height of a block."""

    width: PositiveLength
    height: PositiveLength


@parameters
class Block:
    """A block."""

    size: Size
    density: Density
    soft: bool


@pytest.fixture
def presets(tmp_path, monkeypatch):
    (tmp_path / "presets").mkdir()
    (tmp_path / "presets" / "someone2020.yaml").write_text(DOCUMENT)
    (tmp_path / "presets" / "notes.txt").write_text("")
    monkeypatch.setattr(resources, "files", lambda _: tmp_path)
    return Presets(Block, str(tmp_path))


def test_presets_are_named_read_and_listed_with_the_assumed_values_first(presets):
    assert presets.names == ("someone2020",)
    assert presets.read("someone2020") == Block(Size(10e-3, 5e-3), 1000.0, True)
    table = presets.table("someone2020")
    assert table[0] == PresetValue("size.height", "5 mm", "assumed", "")
    assert [row.path for row in table] == ["size.height", "soft", "size.width", "density"]
    assert table[1].value == "true"
    header = presets.header("someone2020")
    assert header == {"citation": "Someone: A block. Journal, 2020.", "claims_not": "anything"}
    for ask in (presets.read, presets.table, presets.header):
        with pytest.raises(InputError, match="preset: 'nobody' is not known, needs one of someone2020"):
            ask("nobody")


def test_changes_merge_deeply_ranges_stand_with_the_notes_and_what_is_left_may_be_chosen(presets, tmp_path):
    changed = presets.changed({"preset": "someone2020", "size": {"height": "6 mm"}}, "x.yaml: block")
    assert changed.size == Size(10e-3, 6e-3)
    text = "citation: a\nvalues:\n  density: {value: 1 kg/m^3, source: assumed, note: of air, range: 1 to 2 kg/m^3}\n"
    (tmp_path / "presets" / "air.yaml").write_text(text)
    assert presets.table("air")[0].note == "of air; range 1 to 2 kg/m^3"
    choosy = Presets(Block, presets.package, lambda group, _: {"width": group["width"]} if "width" in group else group)
    with pytest.raises(InputError, match=r"size\.height: is missing"):
        choosy.changed({"preset": "someone2020", "size": {"width": "1 mm"}})


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ({}, "x.yaml: block.preset: is missing, needs one of someone2020"),
        ({"preset": "someone2021"}, "x.yaml: block.preset: 'someone2021' is not known.*did you mean 'someone2020'"),
        ({"preset": "someone2020", "size": {"hight": "1 mm"}}, "x.yaml: block.size.hight: .*did you mean 'height'"),
    ],
)
def test_wrong_changes_are_named(presets, mapping, message):
    with pytest.raises(InputError, match=message):
        presets.changed(mapping, "x.yaml: block")
