"""What pydantic finds wrong: each mistake once, in plain words, in the order of the file."""

from __future__ import annotations

from typing import Any

import pydantic
import pytest

from fingerslip.errors import InputError
from fingerslip.model.programme import Press, Slide
from fingerslip.parameters import from_mapping
from fingerslip.parameters.mistakes import in_order, mistakes_in
from fingerslip.study.definition.settings import ContactSettings


def found(cls: type, values: dict[str, Any]) -> list[str]:
    with pytest.raises(InputError) as caught:
        from_mapping(cls, values)
    return str(caught.value).splitlines()


def test_all_mistakes_are_found() -> None:
    assert found(Slide, {"speed": 3, "distance": "1 kg", "way": 1}) == [
        "speed: '3' has no unit, needs a unit of [m/s]; write '3 mm/s' or '3 m/s'",
        "distance: got '1 kg', needs a unit of [m]; write for example '1 mm'",
        "way: is not known, may be one of distance, speed, direction, press",
    ]


def test_a_misspelt_key_is_one_mistake_and_another_missing_key_one_more() -> None:
    assert found(Press, {"dept": "1 mm"}) == [
        "dept: is not known, may be one of depth, speed; did you mean 'depth'?",
        "speed: is missing, needs a value",
    ]


def test_several_mistakes_of_one_check_are_all_there() -> None:
    assert found(ContactSettings, {"boundary": 3, "normal": ["x"], "programme": [{"press": {}}]}) == [
        "boundary: got 3, needs text",
        "normal.0: got 'x', needs a number",
        "programme.0.press.depth: is missing, needs a value",
        "programme.0.press.speed: is missing, needs a value",
    ]


def test_long_values_are_cut() -> None:
    (line,) = found(ContactSettings, {"friction_coefficient": list(range(1000))})
    assert line.startswith("friction_coefficient: got [0, 1, 2,")
    assert line.endswith("..., needs a number")
    assert len(line) < 140


@pytest.mark.parametrize(("value", "needed"), [(float("inf"), "needs a finite number"), ({}, "needs a number")])
def test_odd_values_are_refused_in_plain_words(value: object, needed: str) -> None:
    assert found(ContactSettings, {"friction_coefficient": value}) == [f"friction_coefficient: got {value}, {needed}"]


def test_order_is_that_of_the_file_and_missing_values_follow_their_group() -> None:
    paths = ["b", "b.x", "b.y", "a", "a.z"]
    mistakes = [InputError(where, "f", "a") for where in ("a.z", "c", "b", "b.missing", "b.y", "a.missing.deep")]
    assert [mistake.where for mistake in in_order(mistakes, paths)] == [
        "b",
        "b.y",
        "b.missing",
        "a.z",
        "c",
        "a.missing.deep",
    ]
    placed = [mistake.moved(lambda where: f"f: {where}") for mistake in mistakes]
    assert [mistake.where for mistake in in_order(placed, paths, "f: ")][:2] == ["f: b", "f: b.y"]


def test_mistakes_of_plain_pydantic_are_told_too() -> None:
    with pytest.raises(pydantic.ValidationError) as caught:
        pydantic.TypeAdapter(ContactSettings).validate_python({"boundary": 1, "friction_coefficient": 0.5})
    assert [str(mistake) for mistake in mistakes_in(caught.value, ContactSettings)] == ["boundary: got 1, needs text"]


def test_arguments_that_are_too_many_or_given_twice_are_named() -> None:
    with pytest.raises(InputError, match=r"Press\.depth: got 2 mm, needs its value once, by place or by name"):
        Press(1e-3, 1e-3, depth=2e-3)  # type: ignore[misc]
    with pytest.raises(InputError, match=r"Press\.2: got 7, needs fewer values, or their names"):
        Press(1e-3, 1e-3, 7)  # type: ignore[call-arg]
