"""The strain of a cell as a linear map of its displacements: one operator for assembly and recovery."""

from __future__ import annotations

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.materials.material import SHEARS, STRAIN_COMPONENTS

__all__ = ["cell_dofs", "divergence_operator", "gradient_map", "matrix_of_rows", "shape_gradients", "strain_operator"]

Array = NDArray[np.float64]
Cells = NDArray[np.int64]


def strain_operator(basis: skfem.CellBasis, cells: Cells) -> Array:
    """Return the strains at the quadrature points of cells for unit displacements of their nodes.

    Arrays: cells (k,); returns (k, n_points, m, n_local) [1/m].
    """
    gradients = shape_gradients(basis, cells)
    count, points, nodes, dim = gradients.shape
    operator = np.zeros((count, points, STRAIN_COMPONENTS[dim], nodes, dim))
    for axis in range(dim):
        operator[:, :, axis, :, axis] = gradients[..., axis]
    for row, (first, second) in enumerate(SHEARS[dim], start=dim):
        operator[:, :, row, :, first] = gradients[..., second]
        operator[:, :, row, :, second] = gradients[..., first]
    return operator.reshape(count, points, STRAIN_COMPONENTS[dim], nodes * dim)


def divergence_operator(basis: skfem.CellBasis, cells: Cells) -> Array:
    """Return the mean divergence of cells [1/m], shape (k, n_local), for unit displacements of their nodes."""
    weights = basis.dx[cells] / basis.dx[cells].sum(axis=1, keepdims=True)
    gradients = shape_gradients(basis, cells)
    mean: Array = np.einsum("kqad,kq->kad", gradients, weights)
    return mean.reshape(len(cells), gradients.shape[2] * gradients.shape[3])


def gradient_map(basis: skfem.CellBasis, cells: Cells, n_dofs: int) -> sparse.csr_matrix:
    """Return the displacement gradients of cells at their first point as a map of the displacement [1/m].

    Its shape is (dim^2 * k, n_dofs); components of a cell are xx, xy, (xz,) yx, and so on.
    """
    gradients = shape_gradients(basis, cells)[:, 0]
    count, nodes, dim = gradients.shape
    operator = np.zeros((count, dim, dim, nodes, dim))
    for axis in range(dim):
        operator[:, axis, :, :, axis] = gradients.transpose(0, 2, 1)
    columns = np.repeat(cell_dofs(basis, cells), dim**2, axis=0)
    return matrix_of_rows(operator.reshape(count * dim**2, nodes * dim), columns, n_dofs)


def matrix_of_rows(values: Array, columns: NDArray[np.int32], width: int) -> sparse.csr_matrix:
    """Return the sparse matrix with the given values in the given columns of its rows, both (k, n); no zeros."""
    rows = np.repeat(np.arange(len(columns)), columns.shape[1])
    found = sparse.csr_matrix((values.ravel(), (rows, columns.ravel())), shape=(len(columns), width))
    found.eliminate_zeros()
    return found


def cell_dofs(basis: skfem.CellBasis, cells: Cells) -> NDArray[np.int32]:
    """Return the degrees of freedom of cells, shape (k, n_local): node by node, all components of a node together."""
    nodes, dim = basis.element_dofs[:, cells].T, basis.mesh.dim()
    dofs: NDArray[np.int32] = (dim * nodes[..., None] + np.arange(dim)).astype(np.int32)
    return dofs.reshape(len(cells), nodes.shape[1] * dim)


def shape_gradients(basis: skfem.CellBasis, cells: Cells) -> Array:
    """Return the gradients of the shape functions of cells (k,) [1/m], shape (k, n_points, n_nodes, dim)."""
    by_node = [np.asarray(basis.basis[node][0].grad)[:, cells] for node in range(basis.Nbfun)]
    return np.ascontiguousarray(np.stack(by_node).transpose(2, 3, 0, 1))
