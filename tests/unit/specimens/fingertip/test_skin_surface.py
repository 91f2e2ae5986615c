"""The outer surface in 3D: its cuts are the sections, its normals its gradient, its layers parallel."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip import (
    at_depth,
    below_skin,
    depth_below_skin,
    inward_skin_normal,
    onto_skin,
    outline_curve,
    skin_grid,
    skin_ring,
    solid_shape,
)
from fingerslip.specimens.fingertip.outline import inward_normal
from unit.fingers import change, change_solid

FINGER = change_solid(solid={"base_half_width": "7 mm"})


def section(name):
    return dataclasses.replace(FINGER, section=name)


def in_space(points, name):
    """Put the points of a section where they are in 3D."""
    along, up = points.T
    zero = np.zeros_like(up)
    return np.column_stack([along, up, zero] if name == "sagittal" else [zero, up, along])


@pytest.mark.parametrize("name", ["sagittal", "transverse"])
@pytest.mark.parametrize("depth", [0.0, 1e-3])
def test_cuts_are_the_sections_with_their_layers(name, depth):
    curve = outline_curve(section(name))
    s = curve.arc_length[(curve.points[:, 0] >= -16e-3)][::50]
    skin = in_space(at_depth(curve, s, 0.0), name)
    assert np.abs(onto_skin(FINGER, skin) - skin).max() < 1e-9
    assert np.allclose(below_skin(FINGER, skin, depth), in_space(at_depth(curve, s, depth), name), atol=1e-8)
    normal = in_space(inward_normal(curve, s), name)
    assert np.allclose(inward_skin_normal(FINGER, skin), normal, atol=1e-5)


@given(x=st.floats(-16e-3, 7.9e-3), angle=st.floats(0.0, 6.3))
def test_normals_are_those_of_the_surface(x, angle):
    def at(dx, da):
        return skin_ring(FINGER, np.array([x + dx]), np.array([angle + da]))

    along, across = at(1e-8, 0.0) - at(-1e-8, 0.0), at(0.0, 1e-5) - at(0.0, -1e-5)
    normal = inward_skin_normal(FINGER, at(0.0, 0.0))
    for tangent in (along, across):
        assert abs(float(np.sum(normal * tangent))) < 2e-5 * np.linalg.norm(tangent)


def test_projection_lands_on_the_surface_along_its_normal():
    skin = skin_grid(FINGER)[10:-10:15, ::20].reshape(-1, 3)
    off = below_skin(FINGER, skin, 1e-4)
    assert np.abs(onto_skin(FINGER, off) - skin).max() < 5e-6


def test_depth_is_measured_along_normals():
    skin = skin_grid(FINGER)[::15, ::20].reshape(-1, 3)
    for depth in (-1e-4, 0.0, 1e-3):
        assert np.allclose(depth_below_skin(FINGER, below_skin(FINGER, skin, depth)), depth, atol=5e-6)


def test_sections_have_no_surface_in_space():
    with pytest.raises(InputError, match=r"fingertip.solid: is missing"):
        solid_shape(change())
