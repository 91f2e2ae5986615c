"""Affine motions give exact gradients and strains; rotations strain nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import floats

from fingerslip.marker_layouts import hexagonal_layout, ring_layout
from fingerslip.vision.fields import green_strain, marker_means, marker_triangles, triangle_gradients

REST = ring_layout(1.0).position


def test_triangles_fill_the_layout_and_turn_one_way():
    triangles = marker_triangles(REST)
    first, second = (REST[triangles[:, corner]] - REST[triangles[:, 0]] for corner in (1, 2))
    areas = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    assert (areas > 0).all()
    # The outer ring is a polygon of 32 corners with the radius 4.
    assert areas.sum() == pytest.approx(0.5 * 32 * 16 * np.sin(2 * np.pi / 32))
    assert len(marker_triangles(hexagonal_layout(1.0, 3).position)) == 54


def test_too_few_markers_or_a_line_have_no_triangles():
    assert marker_triangles(REST[:2]).shape == (0, 3)
    assert marker_triangles(np.column_stack([np.arange(5.0), np.zeros(5)])).shape == (0, 3)
    assert marker_triangles(np.full((5, 2), np.nan)).shape == (0, 3)
    assert triangle_gradients(REST, REST[None], np.empty((0, 3), dtype=int)).shape == (1, 0, 2, 2)


def test_flat_triangles_are_left_out():
    points = np.array([[0.0, 0.0], [1.0, -0.001], [2.0, 0.0], [1.0, 1.0]])
    assert sorted(map(sorted, marker_triangles(points).tolist())) == [[0, 1, 3], [1, 2, 3]]


def test_a_marker_without_a_place_at_rest_is_in_no_triangle():
    rest = REST.copy()
    rest[3] = np.nan
    assert 3 not in marker_triangles(rest)


@given(arrays(float, (2, 2), elements=floats(-0.5, 0.5)))
def test_affine_motions_are_exact(gradient):
    moved = REST + REST @ gradient.T + (5.0, -2.0)
    found = triangle_gradients(REST, moved[None], marker_triangles(REST))
    np.testing.assert_allclose(found, np.broadcast_to(gradient, found.shape), atol=1e-12)
    strain = 0.5 * (gradient + gradient.T + gradient.T @ gradient)
    np.testing.assert_allclose(
        green_strain(found),
        np.broadcast_to([strain[0, 0], strain[1, 1], strain[0, 1]], (*found.shape[:2], 3)),
        atol=1e-12,
    )


def test_rotations_strain_nothing():
    turn = np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    found = green_strain(triangle_gradients(REST, (REST @ turn.T)[None], marker_triangles(REST)))
    np.testing.assert_allclose(found, 0.0, atol=1e-13)


def test_lost_corners_take_their_triangles_with_them_and_means_do_without():
    triangles = marker_triangles(REST)
    moved = 1.1 * REST
    moved[0] = np.nan
    found = triangle_gradients(REST, moved[None], triangles)
    np.testing.assert_array_equal(np.isnan(found[0, :, 0, 0]), (triangles == 0).any(axis=1))
    means = marker_means(found[..., 0, 0], REST, triangles)
    assert np.isnan(means[0]).nonzero()[0].tolist() == [0]
    np.testing.assert_allclose(means[0, 1:], 0.1)


def test_means_weigh_by_area():
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-3.0, 0.0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    means = marker_means(np.array([[1.0, 5.0]]), rest, triangles)
    np.testing.assert_allclose(means, [[4.0, 1.0, 4.0, 5.0]])
