"""Sparse products whose cost is reading the matrix."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

__all__ = ["two_products"]

Array = NDArray[np.float64]


def two_products(matrix: sparse.csr_matrix, first: Array, second: Array) -> tuple[Array, Array]:
    """Return a matrix (n, m) times two vectors (m,), both (n,), for which it is read once.

    Examples
    --------
    >>> one, other = two_products(sparse.csr_matrix([[2.0, 1.0], [0.0, 3.0]]), np.array([1.0, 0.0]), np.ones(2))
    >>> one.tolist(), other.tolist()
    ([2.0, 0.0], [3.0, 3.0])
    """
    one, other = np.empty(matrix.shape[0]), np.empty(matrix.shape[0])
    _two_products(matrix.indptr, matrix.indices, matrix.data, first, second, one, other)
    return one, other


@numba.njit(cache=True, nogil=True)
def _two_products(starts, columns, values, first, second, one, other):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    for row in range(one.size):
        total, other_total = 0.0, 0.0
        for entry in range(starts[row], starts[row + 1]):
            total += values[entry] * first[columns[entry]]
            other_total += values[entry] * second[columns[entry]]
        one[row], other[row] = total, other_total
