"""The shape in 3D: what it refuses, and that both sections have to fit together."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip import Nail, preset
from unit.fingers import change, change_solid

NAIL = {"start": "-4 mm", "end": "5 mm", "half_width": "5 mm", "thickness": "0.5 mm"}


def test_preset_in_space_keeps_the_sections_of_the_plane_one():
    plane, solid = preset("wang2014-2d"), preset("wang2014-3d")
    # The half height of the section is calibrated, that of the fingertip in 3D is not.
    assert dataclasses.replace(plane.sagittal, half_height=6.5e-3) == solid.sagittal
    assert plane.sagittal.half_height == 7e-3
    assert plane.transverse == solid.transverse
    assert plane.phalanx.sagittal == solid.phalanx.sagittal
    assert solid.layers.skin_thickness == 1e-3
    assert solid.materials["epidermis"] == solid.materials["dermis"]


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ({"transverse": {"half_height": "6 mm"}}, r"transverse.half_height: got 6 mm, needs 6.5 mm"),
        ({"solid": {"angle": "40 deg"}}, r"solid.angle: got 0.6981 rad"),
        ({"solid": {"phalanx": {"waist_position": "1 mm"}}}, r"waist_position: got 1 mm, needs a value between -16 mm"),
        ({"solid": {"nail": NAIL}}, r"materials: has .*, needs .*nail"),
        ({"solid": {"nail": {**NAIL, "end": "-5 mm"}}}, r"solid.nail.end: got -5 mm, needs a value > -4 mm"),
        ({"solid": {"base_half_width": "0 mm"}}, r"base_half_width"),
    ],
)
def test_shapes_that_do_not_fit_are_refused(groups, message):
    with pytest.raises(InputError, match=message):
        change_solid(**groups)


@pytest.mark.parametrize(
    ("name", "value"), [("end", "9 mm"), ("half_width", "9 mm"), ("thickness", "1 mm"), ("start", "-17 mm")]
)
def test_nail_lies_on_the_finger(name, value):
    material = {"youngs_modulus": "170 MPa", "poisson_ratio": 0.3, "density": "1300 kg/m^3"}
    assert change_solid(solid={"nail": NAIL}, materials={"nail": material}).solid.nail == Nail(-4e-3, 5e-3, 5e-3, 5e-4)
    with pytest.raises(InputError, match=f"solid.nail.{name}: got {value}"):
        change_solid(solid={"nail": {**NAIL, name: value}}, materials={"nail": material})


def test_sections_alone_need_no_shape_in_space():
    assert change().solid is None
    assert np.isfinite(change_solid().solid.base_half_width)
