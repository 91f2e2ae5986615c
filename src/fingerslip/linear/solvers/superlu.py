"""SuperLU, the solver that comes with SciPy, with an order of elimination that keeps factors small.

Nested dissection by level sets: the middle level of a breadth-first search from one end of a sparse graph cuts it in
two. Both halves are ordered first and the cut last, and the halves are cut in the same manner (George 1973). On meshes
in 3D the factors become a fraction of those of a minimum-degree order.
"""

from __future__ import annotations

import functools
import logging
import platform
import sys
from dataclasses import dataclass
from typing import ClassVar

import numba
import numpy as np
from scipy import sparse
from scipy.sparse import csgraph, linalg

from fingerslip.arrays import Floats, Integers
from fingerslip.errors import FingerslipError
from fingerslip.linear.solver import InnerFactor

_logger = logging.getLogger(__name__)


# Unknowns from which nested dissection gives smaller factors than SuperLU's own minimum degree (measured in 3D).
_LARGE = 20_000
# Unknowns around which factors are made whose Schur complement is solved for column by column.
_FEW = 400
# Unknowns that are not cut further.
_LEAF = 60
# Values with their indices and the room that SuperLU takes in advance; SciPy's copies of the factors.
_BYTES_PER_ENTRY, _BYTES_OF_COPY = 16, 12


@dataclass(frozen=True)
class SuperLU:
    """SuperLU: see :class:`fingerslip.linear.solver.LinearSolver`."""

    name: ClassVar[str] = "SuperLU"
    preference: ClassVar[int] = 0

    def is_available(self) -> bool:
        """Tell that SciPy has it everywhere."""
        return True

    def series(self) -> SuperLU:
        """Return this solver: it orders every matrix anew."""
        return self

    def rough(self) -> SuperLU:
        """Return this solver: all its factors are of double precision."""
        return self

    def factorise(self, matrix: sparse.csr_matrix) -> SuperLUFactor:
        """Factorise a matrix (n, n)."""
        return SuperLUFactor(matrix)

    def factorise_around(self, matrix: sparse.csr_matrix, interface: Integers) -> tuple[InnerFactor, Floats]:
        """Factorise a matrix (n, n) but for unknowns `kept` (m,); also return their Schur complement (m, m)."""
        factor = InnerFactor(self, matrix, interface)
        return factor, factor.schur() if interface.size <= _FEW else _schur(matrix, interface)

    def bytes_around(self, matrix: sparse.csr_matrix, interface: Integers) -> int:
        """Return about what memory factors around unknowns `kept` (m,) take [bytes], by counting their entries."""
        order = _last(matrix, interface)
        parts_ordered = [sparse.csr_matrix(matrix[rows][:, rows]) for rows in (order, order[: -interface.size or None])]
        entries = [int(_count_entries(ordered.indptr, ordered.indices)) for ordered in parts_ordered]
        return 2 * max((_BYTES_PER_ENTRY + _BYTES_OF_COPY) * entries[0], _BYTES_PER_ENTRY * entries[1])


SOLVER = SuperLU()


class SuperLUFactor:
    """Triangular factors of a matrix (n, n), with L the identity: the backward half is a whole solution."""

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        if matrix.shape[0] >= _LARGE:
            _suggest_pardiso()
        self._order = nested_dissection(matrix) if matrix.shape[0] >= _LARGE else np.arange(matrix.shape[0])
        self._factors = _factors(matrix, self._order, "NATURAL" if matrix.shape[0] >= _LARGE else "MMD_AT_PLUS_A")

    def forward(self, right_hand_side: Floats) -> Floats:
        """Return b (n,) or (n, k) unchanged."""
        return right_hand_side

    def backward(self, halfway: Floats) -> Floats:
        """Return A^-1 b for a right-hand side b (n,) or (n, k), same shape."""
        solution = np.empty_like(halfway)
        solution[self._order] = self._factors.solve(halfway[self._order])
        return solution


@functools.cache
def _suggest_pardiso() -> None:
    """Say once what is faster, on the machines for which there is MKL."""
    if sys.platform in ("linux", "win32") and platform.machine().lower() in ("x86_64", "amd64"):
        _logger.warning('SuperLU; MKL PARDISO is several times as fast in 3D: pip install "fingerslip[pardiso]"')


def _schur(matrix: sparse.csr_matrix, interface: Integers) -> Floats:
    """Return the Schur complement of a symmetric positive definite matrix on some unknowns, shape (m, m).

    With these unknowns eliminated last, it is the product of the last blocks of both factors.
    """
    size, count = matrix.shape[0], interface.size
    order = _last(matrix, interface)
    factors = _factors(matrix, order, "NATURAL")
    # SuperLU may still change the order, and of separate bodies also which unknowns come last.
    last = factors.perm_c[size - count :] - (size - count)
    if last.min() < 0:
        inverse = np.zeros((count, count))
        for column, unknown in enumerate(range(size - count, size)):
            inverse[:, column] = factors.solve(np.eye(1, size, unknown).ravel())[size - count :]
        return np.asarray(np.linalg.inv(0.5 * (inverse + inverse.T)))
    lower, upper = (part[size - count :, size - count :].toarray() for part in (factors.L, factors.U))
    schur: Floats = (lower @ upper)[np.ix_(last, last)]
    return 0.5 * (schur + schur.T)


def _last(matrix: sparse.csr_matrix, interface: Integers) -> Integers:
    """Return an order of elimination that ends with `kept`."""
    others = np.setdiff1d(np.arange(matrix.shape[0]), interface)
    return np.concatenate([others[nested_dissection(matrix[others][:, others])], interface])


@numba.njit(cache=True)
def _count_entries(starts, columns):  # type: ignore[no-untyped-def]
    """Return the number of entries of a Cholesky factor: row by row, along the elimination tree (Davis 2006)."""
    size = starts.size - 1
    parent, mark, total = np.full(size, -1), np.full(size, -1), size
    for row in range(size):
        mark[row] = row
        for entry in range(starts[row], starts[row + 1]):
            column = columns[entry]
            while column < row and mark[column] != row:
                if parent[column] == -1:
                    parent[column] = row
                total += 1
                mark[column] = row
                column = parent[column]
    return total


def _factors(matrix: sparse.csr_matrix, order: Integers, column_order: str) -> linalg.SuperLU:
    """Factorise without pivoting; the factors' own order of rows and columns is the same then."""
    try:
        return linalg.splu(
            sparse.csc_matrix(matrix[order][:, order]),
            permc_spec=column_order,
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise FingerslipError(f"SuperLU: {error}; the matrix is not positive definite") from error


def nested_dissection(matrix: sparse.csr_matrix) -> Integers:
    """Return an order (n,) of the unknowns of a matrix with symmetric pattern."""
    groups, members = _groups(matrix)
    order = np.zeros(groups.shape[0], dtype=np.int64)
    waiting = [(np.arange(groups.shape[0]), 0)]
    while waiting:
        vertices, first = waiting.pop()
        halves = _cut(groups, vertices) if vertices.size > _LEAF else [vertices]
        position = first
        for part in halves[:-1]:
            waiting.append((part, position))
            position += part.size
        order[position : position + halves[-1].size] = halves[-1]
    return np.concatenate([members[group] for group in order]) if order.size else order


def _groups(matrix: sparse.csr_matrix) -> tuple[sparse.csr_matrix, list[Integers]]:
    """Join unknowns with the same neighbours, such as those of a node; return their graph and the members."""
    pattern = sparse.csr_matrix((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)
    marks = np.random.default_rng(0).random(matrix.shape[0])
    _, first, group = np.unique(np.round(pattern @ marks, 9), return_index=True, return_inverse=True)
    order = np.argsort(group, kind="stable")
    members = np.split(order, np.cumsum(np.bincount(group))[:-1])
    return sparse.csr_matrix(pattern[first][:, first]), members


def _cut(graph: sparse.csr_matrix, vertices: Integers) -> list[Integers]:
    """Return two or more parts without edges between them but for those to the last part, the cut."""
    subgraph = graph[vertices][:, vertices]
    count, label = csgraph.connected_components(subgraph, directed=False)
    if count > 1:
        return [*(vertices[label == number] for number in range(count)), vertices[:0]]
    # Distances from a vertex at an end.
    start, distance = 0, np.zeros(0)
    for _ in range(3):
        distance = csgraph.dijkstra(subgraph, directed=False, indices=start, unweighted=True)
        start = int(np.argmax(distance))
    level = distance.astype(np.int64)
    if level.max() < 2:
        return [vertices]
    middle = int(np.clip(np.searchsorted(np.cumsum(np.bincount(level)), 0.5 * level.size), 1, level.max() - 1))
    below, cut, above = level < middle, level == middle, level > middle
    # Only the vertices of the middle level with neighbours above are needed to separate the halves.
    needed = cut & (subgraph @ above.astype(float) > 0.0)
    return [vertices[below | (cut & ~needed)], vertices[above], vertices[needed]]
