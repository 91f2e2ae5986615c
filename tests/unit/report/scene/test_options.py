"""Options of a scene, and the titles of its fields."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.parameters import from_mapping
from fingerslip.report.scene.options import SCALARS, SceneOptions


def test_unknown_names_are_refused_with_those_that_are_known() -> None:
    with pytest.raises(InputError, match="view: camera: got 'top', needs 'oblique', 'side', 'front' or 'below'"):
        from_mapping(SceneOptions, {"camera": "top"}, "view")


def test_titles_have_the_unit_to_which_the_factor_leads() -> None:
    assert SCALARS["displacement"] == ("displacement [mm]", 1e3)
