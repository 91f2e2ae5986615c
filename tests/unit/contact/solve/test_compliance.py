"""The compliance and its parts are those of the full matrix, in frames that stay and in frames that turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fingerslip.contact.frames import contact_frames, rotate_compliance
from fingerslip.contact.solve.compliance import Compliance


def example(dim, turning):
    rng = np.random.default_rng(dim)
    root = rng.normal(size=(9 * dim, 9 * dim))
    normals = rng.normal(size=(9, dim))
    frames = contact_frames(normals / np.linalg.norm(normals, axis=1, keepdims=True), np.eye(dim)[0])
    penalty = rng.uniform(1.0, 2.0, (9, dim))
    compliance = Compliance(root @ root.T, penalty, frames if turning else None)
    body = rotate_compliance(root @ root.T, frames) if turning else root @ root.T
    return compliance, body + np.diag(penalty.ravel()), frames


@pytest.mark.parametrize("turning", [True, False])
@pytest.mark.parametrize("dim", [2, 3])
def test_block_diagonal_and_response_are_those_of_the_matrix(dim, turning):
    compliance, exact, _ = example(dim, turning)
    np.testing.assert_allclose(compliance.matrix, exact, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(compliance.diagonal.ravel(), np.diag(exact), rtol=1e-12)
    nodes = np.array([1, 2, 7])
    places = (nodes[:, None] * dim + np.arange(dim)).ravel()
    np.testing.assert_allclose(compliance.block(nodes), exact[np.ix_(places, places)], rtol=1e-12, atol=1e-12)
    forces = np.random.default_rng(0).normal(size=(9, dim))
    forces[3:6] = 0.0
    moved = compliance.response(forces) + compliance.penalty * forces
    np.testing.assert_allclose(moved.ravel(), exact @ forces.ravel(), rtol=1e-11)


@pytest.mark.parametrize("turning", [True, False])
def test_a_factor_scales_the_body_alone(turning):
    compliance, exact, _ = example(3, turning)
    scaled = replace(compliance, body=compliance.body / 8.0, factor=8.0)
    np.testing.assert_allclose(scaled.matrix, exact, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(scaled.diagonal, compliance.diagonal, rtol=1e-12)
    for touching in (1, 9):
        forces = np.where(np.arange(9)[:, None] < touching, 1.0, 0.0) * np.ones(3)
        np.testing.assert_allclose(scaled.response(forces), compliance.response(forces), rtol=1e-11, atol=1e-12)


def test_taking_a_block_leaves_the_body_as_it_was():
    compliance, _, _ = example(3, turning=False)
    before = compliance.body.copy()
    compliance.block(np.arange(9))
    np.testing.assert_array_equal(compliance.body, before)
