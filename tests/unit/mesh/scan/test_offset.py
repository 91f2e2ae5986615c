"""Decimation keeps the shape, distances are exact, and the inner surface is as deep as it should."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.scan.offset import decimate_surface, distances, offset_inwards
from fingerslip.mesh.scan.surfaces import check_enclosure
from unit.ellipsoids import ellipsoid, together

SPHERE = ellipsoid((8e-3, 8e-3, 8e-3), points=1200)


def test_distance_on_both_sides():
    points = np.array([[0.0, 0, 0], [7e-3, 0, 0], [0, 10e-3, 0]])
    assert distances(SPHERE, points) == pytest.approx([8e-3, 1e-3, 2e-3], abs=0.04e-3)


def test_decimation_keeps_the_shape():
    fewer = decimate_surface(SPHERE, 1.5e-3)
    assert len(fewer.triangles) == pytest.approx(SPHERE.area / (np.sqrt(3) / 4 * 1.5e-3**2), rel=0.05)
    check_enclosure(fewer)
    assert fewer.volume == pytest.approx(SPHERE.volume, rel=0.01)


def test_coarse_surface_stays_as_it_is():
    assert decimate_surface(SPHERE, 0.1e-3) is SPHERE


@pytest.mark.parametrize("thickness", [1.2e-3, 3e-3])
def test_inner_sphere_has_the_smaller_radius(thickness: float):
    inner = offset_inwards(SPHERE, thickness)
    check_enclosure(inner)
    assert inner.volume > 0
    assert np.linalg.norm(inner.points, axis=1) == pytest.approx(8e-3 - thickness, abs=0.05 * thickness)


@pytest.mark.slow
def test_thin_neck_parts_in_two():
    # Two balls that a neck of 1 mm radius joins: 1.5 mm below the skin only balls of 3.5 mm radius are left.
    balls = (ellipsoid((5e-3,) * 3, (x, 0.0, 0.0)) for x in (-6e-3, 6e-3))
    inner = offset_inwards(together(*balls, ellipsoid((7e-3, 1e-3, 1e-3), points=2000)), 1.5e-3)
    radius = np.linalg.norm(np.abs(inner.points) - [6e-3, 0.0, 0.0], axis=1)
    assert np.median(radius) == pytest.approx(3.5e-3, abs=0.05e-3)
    assert radius.max() < 3.55e-3


def test_piece_inside_another_does_not_count():
    plain = offset_inwards(SPHERE, 2e-3)
    nested = offset_inwards(together(SPHERE, ellipsoid((2e-3,) * 3)), 2e-3)
    assert nested.volume == pytest.approx(plain.volume, rel=1e-3)


def test_too_thick_skin_leaves_nothing():
    with pytest.raises(MeshError, match=r"is nowhere 8.5 mm deep.*smaller skin_thickness"):
        offset_inwards(SPHERE, 8.5e-3)


def test_skin_too_thin_for_the_body():
    with pytest.raises(MeshError, match="needs a thicker skin"):
        offset_inwards(SPHERE, 0.05e-3)


def test_lengths_that_are_none():
    with pytest.raises(InputError, match="thickness"):
        offset_inwards(SPHERE, 0.0)
    with pytest.raises(InputError, match="edge_length"):
        decimate_surface(SPHERE, -1.0)


def test_a_surface_of_which_nothing_is_left_is_refused():
    with pytest.raises(MeshError, match="has no triangle with an area"):
        decimate_surface(ellipsoid(), 1e3)
