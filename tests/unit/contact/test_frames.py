"""Frames of contact nodes: orthonormal, normal first, and rotations that keep work."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.contact.frames import contact_frames, rotate_compliance, sliding_direction


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@pytest.mark.parametrize("dim", [2, 3])
def test_frames_are_orthonormal_with_the_normal_first(dim):
    normals = unit(np.random.default_rng(0).normal(size=(50, dim)))
    frames = contact_frames(normals, np.eye(dim)[0])
    np.testing.assert_array_equal(frames[:, 0], normals)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.tile(np.eye(dim), (50, 1, 1)), atol=1e-12)


def test_a_plate_below_slides_along_x():
    np.testing.assert_array_equal(contact_frames(np.array([[0.0, 1.0]]), np.zeros(2))[0, 1], [1.0, 0.0])
    np.testing.assert_array_equal(contact_frames(np.array([[0.0, -1.0]]), np.zeros(2))[0, 1], [-1.0, 0.0])
    frame = contact_frames(np.array([[0.0, 0.0, 1.0]]), np.array([1.0, 0.0, 5.0]))[0]
    np.testing.assert_allclose(frame, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-15)
    np.testing.assert_array_equal(sliding_direction(np.array([0.0, 1.0])), [1.0, 0.0])
    np.testing.assert_array_equal(sliding_direction(np.array([0.0, 0.0, 1.0])), [1.0, 0.0, 0.0])


def test_a_surface_across_the_wanted_direction_still_has_a_frame():
    frame = contact_frames(np.array([[1.0, 0.0, 0.0]]), np.array([1.0, 0.0, 0.0]))[0]
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.isfinite(sliding_direction(np.array([1.0, 0.0, 0.0]))).all()


@pytest.mark.parametrize("dim", [2, 3])
def test_a_rotated_compliance_gives_the_same_energy(dim):
    rng = np.random.default_rng(4)
    root = rng.normal(size=(4 * dim, 4 * dim))
    compliance = root @ root.T
    frames = contact_frames(unit(rng.normal(size=(4, dim))), np.eye(dim)[0])
    local = rng.normal(size=(4, dim))
    spread = np.einsum("cij,ci->cj", frames, local).ravel()
    turned = rotate_compliance(compliance, frames)
    assert local.ravel() @ turned @ local.ravel() == pytest.approx(spread @ compliance @ spread, rel=1e-12)
