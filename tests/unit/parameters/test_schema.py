"""Parameter sets as editors read them."""

from __future__ import annotations

from typing import Literal

from fingerslip.parameters import PositiveLength, parameters
from fingerslip.parameters.schema import field_words, json_schema


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


def test_words_are_those_of_the_docstring_and_of_the_bases() -> None:
    size = "Its size, see Model and a [m]."
    assert field_words(Width) == {"width": size, "height": size, "kind": "A word."}
    assert field_words(Sides) == {"width": size, "height": size, "kind": "Another word.", "left": "One side."}


def test_schema_says_that_quantities_are_text_with_a_unit() -> None:
    schema = json_schema(Width)
    width, height = schema["properties"]["width"], schema["properties"]["height"]
    assert width["type"] == "string"
    assert width["description"] == "Its size, see Model and a [m]. A quantity such as '1.5 mm'."
    assert "default" not in width
    assert height["default"] == "0.002 m"
    assert schema["description"] == "How wide it is."


def test_parts_have_their_words() -> None:
    schema = json_schema(Sides)
    assert schema["properties"]["left"]["description"] == "One side."
    assert schema["$defs"]["Width"]["properties"]["kind"]["default"] == "wide"
