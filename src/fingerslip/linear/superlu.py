"""SuperLU, the fallback that comes with SciPy."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from fingerslip.errors import FingerslipError
from fingerslip.linear.ordering import nested_dissection

__all__ = ["SuperLUFactor", "SuperLUSchurFactor", "superlu_schur_bytes"]

Array = NDArray[np.float64]

# Unknowns from which nested dissection gives smaller factors than SuperLU's own minimum degree (measured in 3D).
_LARGE = 20_000
# Values with their indices and the room that SuperLU takes in advance; SciPy's copies of the factors.
_BYTES_PER_ENTRY, _BYTES_OF_COPY = 16, 12


class SuperLUFactor:
    """Triangular factors by SuperLU; its forward half is put off to the backward one, in one full solve."""

    name = "SuperLU"

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        self._order = nested_dissection(matrix) if matrix.shape[0] >= _LARGE else np.arange(matrix.shape[0])
        self._factors = _factors(matrix, self._order, "NATURAL" if matrix.shape[0] >= _LARGE else "MMD_AT_PLUS_A")

    def forward(self, right_hand_side: Array) -> Array:
        """Return b as it is (L is the identity here)."""
        return right_hand_side

    def backward(self, halfway: Array) -> Array:
        """Return x = A^-1 y; shapes (n,) or (n, k)."""
        solution = np.empty_like(halfway)
        solution[self._order] = self._factors.solve(halfway[self._order])
        return solution

    def transposed_backward(self, right_hand_side: Array) -> Array:
        """Return A^-1 b, A being symmetric."""
        return self.backward(right_hand_side)


class SuperLUSchurFactor:
    """Factors of all unknowns but some, and the Schur complement on these; each half is a solution of its own.

    Parameters
    ----------
    matrix : scipy.sparse.csr_matrix
        Symmetric positive definite, shape (n, n).
    places : (m,) array
        The unknowns that are left, ascending.
    schur : (m, m) array
        Takes the Schur complement.
    """

    name = "SuperLU"
    substitutions = 2

    def __init__(self, matrix: sparse.csr_matrix, places: NDArray[np.int64], schur: Array) -> None:
        schur[:] = _schur(matrix, places)
        self._places, self._others = places, np.setdiff1d(np.arange(matrix.shape[0]), places)
        self._coupling = sparse.csr_matrix(matrix[places][:, self._others])
        self._factor = SuperLUFactor(sparse.csr_matrix(matrix[self._others][:, self._others]))

    def forward(self, right_hand_side: Array) -> Array:
        """Eliminate: return a vector that holds, at the places, the right-hand side of the Schur complement."""
        halfway = np.array(right_hand_side)
        halfway[self._places] -= self._coupling @ self._factor.backward(halfway[self._others])
        return halfway

    def backward(self, halfway: Array) -> Array:
        """Return the solution from a halfway vector that holds, at the places, the solution there."""
        solution = np.array(halfway)
        given = halfway[self._others] - self._coupling.T @ halfway[self._places]
        solution[self._others] = self._factor.backward(given)
        return solution


def superlu_schur_bytes(matrix: sparse.csr_matrix, places: NDArray[np.int64]) -> int:
    """Return about what memory factors around some unknowns take, by counting the entries of all factors."""
    order = _last(matrix, places)
    entries = [_entries(matrix, order), _entries(matrix, order[: order.size - places.size])]
    return 2 * max((_BYTES_PER_ENTRY + _BYTES_OF_COPY) * entries[0], _BYTES_PER_ENTRY * entries[1])


def _entries(matrix: sparse.csr_matrix, order: NDArray[np.int64]) -> int:
    ordered = sparse.csr_matrix(matrix[order][:, order])
    return int(_count_entries(ordered.indptr, ordered.indices))


def _schur(matrix: sparse.csr_matrix, places: NDArray[np.int64]) -> Array:
    """Return the Schur complement of a symmetric positive definite matrix on some unknowns, shape (m, m).

    With these unknowns eliminated last, it is the product of the last blocks of both factors.
    """
    size, count = matrix.shape[0], places.size
    order = _last(matrix, places)
    factors = _factors(matrix, order, "NATURAL")
    # SuperLU may still change the order, and of separate bodies also which unknowns come last.
    last = factors.perm_c[size - count :] - (size - count)
    if last.min() < 0:
        inverse = np.zeros((count, count))
        for column, place in enumerate(range(size - count, size)):
            inverse[:, column] = factors.solve(np.eye(1, size, place).ravel())[size - count :]
        return np.asarray(np.linalg.inv(0.5 * (inverse + inverse.T)))
    lower, upper = (part[size - count :, size - count :].toarray() for part in (factors.L, factors.U))
    schur: Array = (lower @ upper)[np.ix_(last, last)]
    return 0.5 * (schur + schur.T)


def _last(matrix: sparse.csr_matrix, places: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return an order of elimination that ends with `places`."""
    others = np.setdiff1d(np.arange(matrix.shape[0]), places)
    return np.concatenate([others[nested_dissection(matrix[others][:, others])], places])


@numba.njit(cache=True)
def _count_entries(starts, columns):  # type: ignore[no-untyped-def]
    """Return the number of entries of a Cholesky factor: row by row, along the elimination tree (Davis 2006)."""
    size = starts.size - 1
    parent, mark, total = np.full(size, -1), np.full(size, -1), size
    for row in range(size):
        mark[row] = row
        for place in range(starts[row], starts[row + 1]):
            column = columns[place]
            while column < row and mark[column] != row:
                if parent[column] == -1:
                    parent[column] = row
                total += 1
                mark[column] = row
                column = parent[column]
    return total


def _factors(matrix: sparse.csr_matrix, order: NDArray[np.int64], column_order: str) -> linalg.SuperLU:
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
