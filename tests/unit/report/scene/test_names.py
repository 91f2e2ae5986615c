"""Names of cameras, fields and cuts stand in one place, from which options, help and completion take them."""

from __future__ import annotations

import pytest

from fingerslip.commands.shared import cameras, fields
from fingerslip.report.scene import scene
from fingerslip.report.scene.names import CAMERAS, CUTS, FIELDS, alternatives
from fingerslip.report.scene.options import SCALARS, SceneOptions


def test_every_name_is_an_option_and_can_be_drawn() -> None:
    assert set(CAMERAS) == set(scene._DIRECTIONS)
    assert tuple(SCALARS) == FIELDS
    for name, names in (("camera", CAMERAS), ("scalar", FIELDS), ("cut", CUTS)):
        assert [getattr(SceneOptions(**{name: one}), name) for one in names] == list(names)


def test_completion_takes_the_same_names() -> None:
    assert cameras("") == list(CAMERAS)
    assert fields("") == list(FIELDS)
    assert fields("re") == ["region"]


@pytest.mark.parametrize(("names", "text"), [(("a", "b"), "a or b"), (("a", "b", "c"), "a, b or c")])
def test_alternatives_are_written_as_people_do(names: tuple[str, ...], text: str) -> None:
    assert alternatives(names) == text
