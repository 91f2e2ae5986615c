"""Products of dense symmetric matrices with vectors, whose cost is reading the matrix.

A matrix of single precision may be multiplied with vectors of double precision. Its entries are then taken as they
are, and the product is exact but for rounding in double precision, while half as many bytes are read.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["symmetric_product", "symmetric_products", "write_symmetric_product"]

_ROWS_AT_ONCE = 256


def symmetric_product(matrix: NDArray[Any], vector: NDArray[Any]) -> NDArray[Any]:
    """Return a symmetric matrix (n, n) times a vector (n,), in the precision of the vector.

    Half of the matrix is read: what is above its diagonal may be anything.

    Examples
    --------
    >>> symmetric_product(np.array([[2.0, np.nan], [1.0, 3.0]], dtype=np.float32), np.array([1.0, 2.0])).tolist()
    [4.0, 7.0]
    """
    found = np.empty_like(vector)
    write_symmetric_product(matrix, np.ascontiguousarray(vector), found)
    return found


def symmetric_products(matrix: NDArray[Any], columns: NDArray[Any]) -> NDArray[Any]:
    """Return a symmetric matrix (n, n), all of which is there, times columns (n, k), in their precision."""
    if matrix.dtype == columns.dtype:
        found: NDArray[Any] = matrix @ columns
        return found
    starts = range(0, len(matrix), _ROWS_AT_ONCE)
    parts = [matrix[start : start + _ROWS_AT_ONCE].astype(columns.dtype) @ columns for start in starts]
    return np.concatenate(parts) if parts else columns.copy()


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def write_symmetric_product(matrix, vector, found):  # type: ignore[no-untyped-def]
    """Write a symmetric matrix times a vector (n,) into `found` (n,), of the same precision as the vector.

    Arrays: matrix (m, m).
    """
    size, zero = vector.size, vector.dtype.type(0)
    found.fill(zero)
    whole = size - size % 4
    # Four rows at a time: each entry serves its row and its column, and found is read and written once for all four.
    for i in range(0, whole, 4):
        first, second, third, fourth = matrix[i], matrix[i + 1], matrix[i + 2], matrix[i + 3]
        a, b, c, d = vector[i], vector[i + 1], vector[i + 2], vector[i + 3]
        of_a, of_b, of_c, of_d = zero, zero, zero, zero
        for j in range(i):
            own = vector[j]
            of_a += first[j] * own
            of_b += second[j] * own
            of_c += third[j] * own
            of_d += fourth[j] * own
            found[j] += first[j] * a + second[j] * b + third[j] * c + fourth[j] * d
        found[i] += of_a
        found[i + 1] += of_b
        found[i + 2] += of_c
        found[i + 3] += of_d
        _add_corner(matrix, vector, found, i, i + 4)
    for i in range(whole, size):
        for j in range(whole):
            found[i] += matrix[i, j] * vector[j]
            found[j] += matrix[i, j] * vector[i]
    _add_corner(matrix, vector, found, whole, size)


@numba.njit(cache=True, nogil=True)
def _add_corner(matrix, vector, found, start, end):  # type: ignore[no-untyped-def]
    """Add what the diagonal block from `start` to `end` contributes."""
    for i in range(start, end):
        for j in range(start, i):
            found[i] += matrix[i, j] * vector[j]
            found[j] += matrix[i, j] * vector[i]
        found[i] += matrix[i, i] * vector[i]
