"""The strain operator: exact on linear fields, with the components in the order that material laws take."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.fe.recovery import cell_dofs, divergence_operator, strain_operator
from fingerslip.fe.space import build_space
from problems.blocks import distorted

GRADIENT = {
    2: np.array([[1.0e-2, 2.0e-3], [-3.0e-3, -4.0e-3]]),
    3: np.array([[1e-3, 4e-4, -2e-4], [-3e-4, -5e-4, 6e-4], [2e-4, 1e-4, 7e-4]]),
}


def expected(gradient):
    """Return the strain by hand: normal strains, then xy, and in 3D yz and xz."""
    shears = [(0, 1)] if len(gradient) == 2 else [(0, 1), (1, 2), (0, 2)]
    return np.concatenate([np.diag(gradient), [gradient[i, j] + gradient[j, i] for i, j in shears]])


@pytest.mark.parametrize("element", ["Q4", "T3", "T6", "H8", "T4", "T10"])
def test_a_linear_field_has_its_strain_at_every_point(element):
    space = build_space(distorted(element, 2))
    gradient, cells = GRADIENT[space.dim], np.array([0, 2])
    field = (space.positions @ gradient.T).ravel()
    local = field[cell_dofs(space.full, cells)]
    strains = np.einsum("kqmn,kn->kqm", strain_operator(space.full, cells), local)
    assert strains.shape[:2] == (2, space.full.dx.shape[1])
    np.testing.assert_allclose(strains, np.broadcast_to(expected(gradient), strains.shape), atol=1e-15)
    np.testing.assert_allclose(
        np.sum(divergence_operator(space.full, cells) * local, axis=1), np.trace(gradient), atol=1e-15
    )


def test_the_mean_divergence_is_weighted_by_the_quadrature():
    """On a distorted quadrilateral the divergence of a bilinear field differs from point to point."""
    space = build_space(distorted("Q4", 3))
    x, y = space.positions.T
    field, cells = np.column_stack([x * y, 0.0 * x]).ravel(), np.arange(space.mesh.nelements)
    local = field[cell_dofs(space.full, cells)]
    divergence = np.einsum("kqmn,kn->kqm", strain_operator(space.full, cells), local)[:, :, :2].sum(axis=2)
    assert np.ptp(divergence, axis=1).max() > 0.1
    mean = np.sum(divergence * space.full.dx, axis=1) / space.full.dx.sum(axis=1)
    np.testing.assert_allclose(np.sum(divergence_operator(space.full, cells) * local, axis=1), mean, rtol=1e-13)


def test_degrees_of_freedom_come_node_by_node():
    space = build_space(distorted("T4", 2))
    dofs = cell_dofs(space.full, np.array([5]))
    np.testing.assert_array_equal(dofs[0, ::3] // 3, space.mesh.t[:, 5])
    np.testing.assert_array_equal(dofs[0] % 3, np.tile([0, 1, 2], 4))
