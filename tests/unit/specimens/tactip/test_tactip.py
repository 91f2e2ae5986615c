"""What a model takes from a TacTip."""

from __future__ import annotations

import dataclasses

import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.tactip.tactip import PRESETS

SENSOR = PRESETS.read("tactip-ridged-2d")


def test_a_half_is_held_at_its_plane_of_symmetry():
    assert SENSOR.supports(2) == {"window": ("x", "y")}
    assert dataclasses.replace(SENSOR, part="half").supports(3) == {"window": ("x", "y", "z"), "symmetry": ("z",)}


def test_unknown_sites_are_refused():
    with pytest.raises(InputError, match="a tactip has no 'FA-I', needs some of internal_markers"):
        SENSOR.sites(("FA-I",), 2)
    with pytest.raises(InputError, match="got the sites of a section for 3 dimensions"):
        SENSOR.sites(("internal_markers",), 3)


def test_the_default_mesh_follows_the_part():
    assert SENSOR.default_mesh.element == "Q4"
    assert dataclasses.replace(SENSOR, part="whole").default_mesh.element == "T4"


def test_materials_change_no_mesh():
    assert not {"materials", "depth", "formulation"} & SENSOR.shape.keys()
