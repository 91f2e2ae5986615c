"""Nested dissection orders every unknown once and keeps the factors of meshes small."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import linalg

from fingerslip.linear.ordering import nested_dissection


def grid(*sizes: int, components: int = 1) -> sparse.csr_matrix:
    """Return the Laplacian of a grid, plus one; with several coupled unknowns at each point."""
    total = sparse.csr_matrix((1, 1))
    for size in sizes:
        line = sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(size, size))
        total = sparse.kronsum(total, line)
    block = np.eye(components) + 0.1
    return sparse.csr_matrix(sparse.kron(total + sparse.identity(total.shape[0]), block))


def fill(matrix: sparse.csr_matrix, order: np.ndarray) -> int:
    ordered = sparse.csc_matrix(matrix[order][:, order])
    options = {"SymmetricMode": True}
    return int(linalg.splu(ordered, permc_spec="NATURAL", diag_pivot_thresh=0.0, options=options).nnz)


@pytest.mark.parametrize("matrix", [grid(9), grid(40, 30), grid(9, 8, 7, components=3), sparse.identity(500)])
def test_every_unknown_is_eliminated_once(matrix):
    order = nested_dissection(sparse.csr_matrix(matrix))
    np.testing.assert_array_equal(np.sort(order), np.arange(matrix.shape[0]))


def test_no_unknowns_have_an_empty_order():
    assert nested_dissection(sparse.csr_matrix((0, 0))).shape == (0,)


def test_separate_bodies_are_ordered_too():
    matrix = sparse.block_diag([grid(15, 15), grid(14, 14)], format="csr")
    np.testing.assert_array_equal(np.sort(nested_dissection(matrix)), np.arange(15 * 15 + 14 * 14))


def test_the_order_beats_the_natural_one_by_far_in_space():
    """A cube of n^3 points fills like n^5 in natural order and like n^4 with nested dissection."""
    matrix = grid(16, 16, 16)
    assert fill(matrix, nested_dissection(matrix)) < 0.4 * fill(matrix, np.arange(16**3))


def test_unknowns_of_one_node_stay_together():
    order = nested_dissection(grid(6, 6, 6, components=3))
    np.testing.assert_array_equal(np.diff(order.reshape(-1, 3)), 1)
