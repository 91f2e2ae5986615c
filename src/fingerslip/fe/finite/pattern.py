"""Where the entries of cells are in the matrix of a mesh, and their sum."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.arrays import Floats, Integers


@dataclass(frozen=True)
class Pattern:
    """Where the entries of cells are in the matrix of a mesh."""

    nodes: Integers  # (n_cells, n_nodes), nodes of the cells
    starts: Integers  # (n_nodes_of_mesh + 1,), where the neighbours of each node begin
    places: NDArray[np.int32]  # (n_cells, n_nodes, n_nodes)
    row_starts: NDArray[np.int32]  # compressed rows of the matrix, node by node with all components of a node together
    columns: NDArray[np.int32]  # compressed rows of the matrix, node by node with all components of a node together

    def assemble(self, matrices: Floats) -> sparse.csr_matrix:
        """Return the sum of the matrices of cells (n_cells, n_local, n_local), shape (n_dofs, n_dofs).

        Entries that come to zero stay in it, so that its pattern is always the same.
        """
        size, values = self.row_starts.size - 1, np.zeros(self.columns.size)
        _add(matrices, self.nodes, self.starts, self.places, values)
        return sparse.csr_matrix((values, self.columns, self.row_starts), shape=(size, size))


def pattern_of_cells(nodes: Integers, count: int, dim: int) -> Pattern:
    """Return the pattern of cells with `nodes` (n_cells, n_nodes) in a mesh of `count` nodes in `dim` dimensions."""
    corners = nodes.shape[1]
    first, second = np.repeat(nodes, corners, axis=1).ravel(), np.tile(nodes, (1, corners)).ravel()
    pairs, number = np.unique(first * count + second, return_inverse=True)
    neighbours = pairs % count
    starts = np.searchsorted(pairs, np.arange(count + 1) * count)
    places = (number.ravel() - starts[first]).astype(np.int32).reshape(len(nodes), corners, corners)
    lengths = np.repeat(dim * np.diff(starts), dim)
    row_starts = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
    columns = np.empty(row_starts[-1], dtype=np.int32)
    _fill_columns(starts, neighbours, dim, columns)
    return Pattern(nodes, starts, places, row_starts, columns)


@numba.njit(cache=True, nogil=True)
def _fill_columns(starts, neighbours, dim, columns):  # type: ignore[no-untyped-def]
    """Fill in the columns (n_entries,) of rows that are made of blocks of `dim`."""
    entry = 0
    for node in range(starts.size - 1):
        for _ in range(dim):
            for position in range(starts[node], starts[node + 1]):
                for component in range(dim):
                    columns[entry] = dim * neighbours[position] + component
                    entry += 1


@numba.njit(cache=True, nogil=True)
def _add(matrices, nodes, starts, places, values):  # type: ignore[no-untyped-def]
    """Add the matrices of cells to the values (n_entries,) of the rows."""
    cells, corners = nodes.shape
    dim = matrices.shape[1] // corners
    for c in range(cells):
        for a in range(corners):
            node = nodes[c, a]
            width = dim * (starts[node + 1] - starts[node])
            for i in range(dim):
                row = dim * dim * starts[node] + i * width
                for b in range(corners):
                    entry = row + dim * places[c, a, b]
                    for j in range(dim):
                        values[entry + j] += matrices[c, a * dim + i, b * dim + j]
