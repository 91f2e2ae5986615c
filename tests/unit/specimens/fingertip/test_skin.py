"""The outer surface in 3D: its cuts are the sections; normals, layers, fingerprint, and the finger at an angle."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.specimens.fingertip.outline import at_depth, inward_normal, outline_curve, surface_depth
from fingerslip.specimens.fingertip.skin import (
    below_skin,
    depth_below_skin,
    inward_skin_normal,
    onto_skin,
    pose_points,
    relief_depth,
    skin_grid,
    skin_ring,
)
from unit.fingers import change_solid

FINGER = change_solid(solid={"base_half_width": "7 mm"})


def section(name):
    return dataclasses.replace(FINGER, section=name)


def in_3d(points, name):
    """Put the points of a section where they are in 3D."""
    along, up = points.T
    zero = np.zeros_like(up)
    return np.column_stack([along, up, zero] if name == "sagittal" else [zero, up, along])


@pytest.mark.parametrize("name", ["sagittal", "transverse"])
@pytest.mark.parametrize("depth", [0.0, 1e-3])
def test_cuts_are_the_sections_with_their_layers(name, depth):
    curve = outline_curve(section(name))
    s = curve.arc_length[(curve.points[:, 0] >= -16e-3)][::50]
    skin = in_3d(at_depth(curve, s, 0.0), name)
    assert np.abs(onto_skin(FINGER, skin) - skin).max() < 1e-9
    assert np.allclose(below_skin(FINGER, skin, depth), in_3d(at_depth(curve, s, depth), name), atol=1e-8)
    normal = in_3d(inward_normal(curve, s), name)
    assert np.allclose(inward_skin_normal(FINGER, skin), normal, atol=1e-5)


@given(x=st.floats(-16e-3, 7.9e-3), angle=st.floats(0.0, 6.3))
def test_normals_are_those_of_the_surface(x, angle):
    def at(dx, da):
        return skin_ring(FINGER, np.array([x + dx]), np.array([angle + da]))

    along, across = at(1e-8, 0.0) - at(-1e-8, 0.0), at(0.0, 1e-5) - at(0.0, -1e-5)
    normal = inward_skin_normal(FINGER, at(0.0, 0.0))
    for tangent in (along, across):
        assert abs(float(np.sum(normal * tangent))) < 2e-5 * np.linalg.norm(tangent)


def test_depth_is_measured_along_normals_and_projection_goes_back_along_them():
    skin = skin_grid(FINGER)[10:-10:15, ::20].reshape(-1, 3)
    for depth in (-1e-4, 0.0, 1e-4, 1e-3):
        assert np.allclose(depth_below_skin(FINGER, below_skin(FINGER, skin, depth)), depth, atol=5e-6)
    assert np.abs(onto_skin(FINGER, below_skin(FINGER, skin, 1e-4)) - skin).max() < 5e-6


RIPPLED = change_solid(fingerprint={"enabled": True})


def test_middle_line_has_the_ripples_of_the_section_and_back_and_sides_are_smooth():
    curve = outline_curve(dataclasses.replace(RIPPLED, section="sagittal"))
    s = np.linspace(-11e-3, 6e-3, 500)
    x, y = (np.interp(s, curve.arc_length, column) for column in curve.points.T)
    relief = relief_depth(RIPPLED, np.column_stack([x, y, np.zeros_like(x)]))
    assert np.allclose(relief, surface_depth(RIPPLED, s), atol=1e-9)
    assert np.ptp(relief) > 0.09e-3
    places = np.array([[0.0, 6.5e-3, 0.0], [0.0, 1e-4, 8e-3], [0.0, -1e-4, -8e-3]])
    assert not relief_depth(RIPPLED, places).any()
    assert not relief_depth(change_solid(), np.array([[0.0, -6.5e-3, 0.0]])).any()


@pytest.mark.parametrize("angle", [-0.4, 0.0, 0.3])
def test_lowest_point_stays_and_distances_too(angle):
    finger = change_solid(solid={"angle": f"{angle} rad"})
    grid = skin_grid(finger)
    turned = pose_points(finger, grid.reshape(-1, 3)).reshape(grid.shape)
    lowest = turned.reshape(-1, 3)[turned[..., 1].argmin()]
    assert lowest == pytest.approx([0.0, -6.5e-3, 0.0], abs=2e-4)
    assert lowest[1] == pytest.approx(-6.5e-3, abs=2e-6)
    before, after = (np.linalg.norm(points[5] - points[60], axis=1) for points in (grid, turned))
    assert np.allclose(before, after, rtol=1e-12)
    tip = np.array([[8e-3, 0.0, 0.0]])
    assert np.sign(pose_points(finger, tip)[0, 1].round(3)) == np.sign(angle), "a positive angle lifts the tip"
