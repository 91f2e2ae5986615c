"""Rigid motions leave nothing, and others what they are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fingerslip.vision.fields import fit_rigid_motions

RANDOM = np.random.default_rng(0)


@pytest.mark.parametrize("angle", [0.0, 0.3, -2.5])
def test_a_rotation_in_the_plane_leaves_nothing(angle):
    rest = RANDOM.standard_normal((20, 2))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    motions = fit_rigid_motions(rest, (rest @ turn.T + (3.0, -1.0))[None])
    np.testing.assert_allclose(motions.residual, 0.0, atol=1e-14)
    assert motions.rotation[0] == pytest.approx(angle, abs=1e-14)
    np.testing.assert_allclose(motions.translation[0], rest.mean(axis=0) @ turn.T + (3.0, -1.0) - rest.mean(axis=0))


def test_a_rotation_in_space_leaves_nothing():
    rest = RANDOM.standard_normal((20, 3))
    turn = Rotation.from_rotvec([0.3, -0.2, 0.9])
    motions = fit_rigid_motions(rest, (turn.apply(rest) + 1.0)[None])
    np.testing.assert_allclose(motions.residual, 0.0, atol=1e-14)
    assert motions.rotation[0] == pytest.approx(turn.magnitude())


def test_markers_in_a_plane_of_space_are_turned_and_not_mirrored():
    rest = np.column_stack([RANDOM.standard_normal((20, 2)), np.zeros(20)])
    turn = Rotation.from_rotvec([0.0, 3.0, 0.0])
    motions = fit_rigid_motions(rest, turn.apply(rest)[None])
    np.testing.assert_allclose(motions.residual, 0.0, atol=1e-13)
    assert motions.rotation[0] == pytest.approx(3.0)


def test_lost_markers_have_no_weight():
    rest = RANDOM.standard_normal((20, 2))
    position = np.array([rest + 1.0, rest + 2.0, np.full_like(rest, np.nan)])
    position[0, 3] = np.nan
    rest[5] = np.nan
    motions = fit_rigid_motions(rest, position)
    assert np.argwhere(np.isnan(motions.residual[:2]).any(axis=2)).tolist() == [[0, 3], [0, 5], [1, 5]]
    np.testing.assert_allclose(motions.residual[~np.isnan(motions.residual)], 0.0, atol=1e-13)
    np.testing.assert_allclose(motions.translation[:2], [[1, 1], [2, 2]])
    assert np.isnan(motions.rotation).tolist() == [False, False, True]
    assert np.isnan(motions.translation[2]).all()


def test_one_marker_that_moves_alone_is_what_is_left():
    rest = RANDOM.standard_normal((400, 2))
    position = rest[None].copy()
    position[0, 7] += (0.1, 0.0)
    motions = fit_rigid_motions(rest, position)
    assert motions.residual[0, 7, 0] == pytest.approx(0.1, rel=0.02)
    assert np.abs(np.delete(motions.residual[0], 7, axis=0)).max() < 2e-3


def test_the_fit_is_the_best_one():
    rest = RANDOM.standard_normal((30, 2))
    position = rest + 0.3 * RANDOM.standard_normal((1, 30, 2))
    best = (fit_rigid_motions(rest, position).residual ** 2).sum()
    known, error = Rotation.align_vectors(
        np.column_stack([position[0] - position[0].mean(axis=0), np.zeros(30)]),
        np.column_stack([rest - rest.mean(axis=0), np.zeros(30)]),
    )
    assert best == pytest.approx(error**2)
    assert fit_rigid_motions(rest, position).rotation[0] == pytest.approx(known.as_rotvec()[2])
