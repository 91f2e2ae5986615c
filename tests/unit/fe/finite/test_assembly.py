"""The stiffness of cells adds up as SciPy adds it, on a pattern that does not depend on the values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.fe.finite.assembly import pattern_of_cells

NODES = {2: np.array([[0, 1, 2], [2, 1, 3], [4, 3, 1]]), 3: np.array([[0, 1, 2, 3], [4, 2, 1, 3]])}


@pytest.mark.parametrize("dim", [2, 3])
def test_the_sum_of_cells_is_that_of_their_entries(dim):
    nodes = NODES[dim]
    matrices = np.random.default_rng(dim).normal(size=(len(nodes), nodes.shape[1] * dim, nodes.shape[1] * dim))
    dofs = (dim * nodes[..., None] + np.arange(dim)).reshape(len(nodes), -1)
    rows, columns = np.repeat(dofs, dofs.shape[1], axis=1).ravel(), np.tile(dofs, dofs.shape[1]).ravel()
    expected = sparse.coo_matrix((matrices.ravel(), (rows, columns)), shape=(5 * dim, 5 * dim))
    found = pattern_of_cells(nodes, 5, dim).assemble(matrices)
    np.testing.assert_allclose(found.toarray(), expected.toarray(), atol=1e-14)
    assert found.has_canonical_format


def test_zeros_stay_and_a_node_without_cells_has_none():
    found = pattern_of_cells(np.array([[0, 2]]), 4, 2).assemble(np.zeros((1, 4, 4)))
    assert found.nnz == 16
    np.testing.assert_array_equal(np.diff(found.indptr), [4, 4, 0, 0, 4, 4, 0, 0])
