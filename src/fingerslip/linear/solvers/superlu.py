"""SuperLU, the solver that comes with SciPy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from fingerslip.errors import FingerslipError
from fingerslip.linear.ordering import nested_dissection

__all__ = ["SOLVER", "SuperLU", "SuperLUFactor", "SuperLUSchurFactor"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# Unknowns from which nested dissection gives smaller factors than SuperLU's own minimum degree (measured in 3D).
_LARGE = 20_000
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

    def factorise_around(self, matrix: sparse.csr_matrix, interface: Indices) -> tuple[SuperLUSchurFactor, Array]:
        """Factorise a matrix (n, n) but for unknowns `kept` (m,); also return their Schur complement (m, m)."""
        schur = _schur(matrix, interface)
        return SuperLUSchurFactor(matrix, interface), schur

    def bytes_around(self, matrix: sparse.csr_matrix, interface: Indices) -> int:
        """Return about what memory factors around unknowns `kept` (m,) take [bytes], by counting their entries."""
        order = _last(matrix, interface)
        entries = [_entries(matrix, order), _entries(matrix, order[: order.size - interface.size])]
        return 2 * max((_BYTES_PER_ENTRY + _BYTES_OF_COPY) * entries[0], _BYTES_PER_ENTRY * entries[1])


SOLVER = SuperLU()


class SuperLUFactor:
    """Triangular factors of a matrix (n, n), with L the identity: the backward half is a whole solution."""

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        self._order = nested_dissection(matrix) if matrix.shape[0] >= _LARGE else np.arange(matrix.shape[0])
        self._factors = _factors(matrix, self._order, "NATURAL" if matrix.shape[0] >= _LARGE else "MMD_AT_PLUS_A")

    def forward(self, right_hand_side: Array) -> Array:
        """Return b (n,) or (n, k) unchanged."""
        return right_hand_side

    def backward(self, halfway: Array) -> Array:
        """Return A^-1 b for a right-hand side b (n,) or (n, k), same shape."""
        solution = np.empty_like(halfway)
        solution[self._order] = self._factors.solve(halfway[self._order])
        return solution

    def transposed_backward(self, right_hand_side: Array) -> Array:
        """Return A^-1 b for b (n,) or (n, k), same shape: A is symmetric."""
        return self.backward(right_hand_side)


class SuperLUSchurFactor:
    """Factors of all unknowns of a matrix but `kept` (m,), ascending; each half is a solution of its own."""

    substitutions = 2
    is_single = False

    def __init__(self, matrix: sparse.csr_matrix, interface: Indices) -> None:
        self._kept, self._others = interface, np.setdiff1d(np.arange(matrix.shape[0]), interface)
        self._coupling = sparse.csr_matrix(matrix[interface][:, self._others])
        self._factor = SuperLUFactor(sparse.csr_matrix(matrix[self._others][:, self._others]))

    def forward(self, right_hand_side: Array) -> Array:
        """Return b with the right-hand side of the Schur complement at the kept unknowns; (n,) or (n, k)."""
        halfway = np.array(right_hand_side)
        halfway[self._kept] -= self._coupling @ self._factor.backward(halfway[self._others])
        return halfway

    def backward(self, halfway: Array) -> Array:
        """Return the solution from a forward half that holds the solution at the kept unknowns; (n,) or (n, k)."""
        solution = np.array(halfway)
        right = halfway[self._others] - self._coupling.T @ halfway[self._kept]
        solution[self._others] = self._factor.backward(right)
        return solution


def _entries(matrix: sparse.csr_matrix, order: Indices) -> int:
    ordered = sparse.csr_matrix(matrix[order][:, order])
    return int(_count_entries(ordered.indptr, ordered.indices))


def _schur(matrix: sparse.csr_matrix, interface: Indices) -> Array:
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
    schur: Array = (lower @ upper)[np.ix_(last, last)]
    return 0.5 * (schur + schur.T)


def _last(matrix: sparse.csr_matrix, interface: Indices) -> Indices:
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


def _factors(matrix: sparse.csr_matrix, order: Indices, column_order: str) -> linalg.SuperLU:
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
