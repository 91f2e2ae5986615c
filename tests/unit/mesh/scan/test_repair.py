"""Repair: debris goes, normals face outwards, holes close along the curvature; the report says what was done."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import MeshError
from fingerslip.mesh.scan.repair import Repairs, closed_where, repair_surface
from fingerslip.mesh.scan.surfaces import Surface, boundary_loops, check_enclosure
from unit.ellipsoids import ellipsoid, together, with_hole

WHOLE = ellipsoid()


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_any_turned_triangles_are_turned_back(seed: int, share: float):
    turned = np.random.default_rng(seed).random(len(WHOLE.triangles)) < share
    dirty = np.where(turned[:, None], WHOLE.triangles[:, ::-1], WHOLE.triangles)
    repaired, repairs = repair_surface(Surface(WHOLE.points, dirty))
    assert repairs.turned_triangles == turned.sum()
    assert repaired.volume == pytest.approx(WHOLE.volume)
    check_enclosure(repaired)


def test_triangles_that_share_no_points_are_joined():
    apart = Surface(WHOLE.corners.reshape(-1, 3), np.arange(WHOLE.triangles.size).reshape(-1, 3))
    repaired, repairs = repair_surface(apart)
    assert repairs == Repairs(0, 0, (), ())
    assert len(repaired.points) == len(WHOLE.points)
    assert repaired.volume == pytest.approx(WHOLE.volume)
    check_enclosure(repaired)


def test_two_pieces_are_both_turned_outwards():
    other = ellipsoid((3e-3, 3e-3, 3e-3), (0.0, 30e-3, 0.0))
    dirty = together(WHOLE, dataclasses.replace(other, triangles=other.triangles[:, ::-1]))
    repaired, repairs = repair_surface(dirty)
    assert repairs.turned_triangles == len(other.triangles)
    # Volume about a common point adds up for closed pieces.
    assert repaired.volume == pytest.approx(WHOLE.volume + other.volume)


def test_hole_is_closed_on_the_sphere_that_it_was_in():
    sphere = ellipsoid((10e-3, 10e-3, 10e-3), points=2000)
    repaired, repairs = repair_surface(with_hole(sphere, (0.0, -10e-3, 0.0), 1.6e-3))
    assert len(repairs.closed_holes) == 1
    assert repairs.closed_holes[0] == pytest.approx(3.2e-3, abs=1e-3)
    assert repairs.open_holes == ()
    check_enclosure(repaired)
    # A flat lid would lie 0.15 mm too deep.
    assert np.linalg.norm(repaired.points[-1]) == pytest.approx(10e-3, abs=0.03e-3)


def test_large_hole_stays_open_and_is_reported():
    repaired, repairs = repair_surface(with_hole(WHOLE, (0.0, 0.0, 7e-3), 4e-3), largest_hole=5e-3)
    assert repairs.closed_holes == ()
    assert len(repairs.open_holes) == len(boundary_loops(repaired)) == 1
    assert repairs.open_holes[0] > 5e-3


def test_debris_is_dropped():
    repaired, repairs = repair_surface(together(WHOLE, ellipsoid((2e-4,) * 3, (0.0, 9e-3, 0.0), 20)))
    assert repairs.dropped_pieces == 1
    assert len(repaired.points) == len(WHOLE.points)


def test_moebius_strip_has_no_inside():
    count = 30
    turn = 2 * np.pi * np.arange(count) / count
    across = np.array([[-0.3], [0.3]])
    radius = 1 + across * np.cos(turn / 2)
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), across * np.sin(turn / 2)], -1).reshape(-1, 3)
    a, b = np.arange(count), count + np.arange(count)
    c, d = np.append(a[1:], b[0]), np.append(b[1:], a[0])
    strip = Surface(points, np.vstack([np.column_stack([a, b, c]), np.column_stack([b, d, c])]))
    with pytest.raises(MeshError, match="Moebius"):
        repair_surface(strip)


def test_proximal_end_is_closed_whatever_its_size():
    stump = Surface(WHOLE.points, WHOLE.triangles[WHOLE.corners[:, :, 0].max(axis=1) > -6e-3])
    assert len(boundary_loops(stump)) == 1
    check_enclosure(closed_where(stump, -4e-3))
    with pytest.raises(MeshError, match="is open"):
        check_enclosure(closed_where(stump, -9e-3))


def test_a_surface_without_triangles_is_refused():
    with pytest.raises(MeshError, match="has no triangle with an area"):
        repair_surface(Surface(np.zeros((3, 3)), np.empty((0, 3), dtype=np.int64), "skin.stl"))
