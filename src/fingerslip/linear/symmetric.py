"""Products of matrices with vectors, whose cost is reading the matrix.

A dense matrix of single precision may be multiplied with vectors of double precision. Its entries are then taken as
they are, and the product is exact but for rounding in double precision, while half as many bytes are read.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.arrays import Floats

_ROWS_AT_ONCE = 256


def symmetric_product(matrix: NDArray[Any], vector: NDArray[Any]) -> NDArray[Any]:
    """Return a symmetric matrix (n, n) times a vector (n,) or columns (n, k), in their precision.

    For a vector half of the matrix is read: what is above its diagonal may be anything.
    """
    if vector.ndim == 1:
        product = np.empty_like(vector)
        write_symmetric_product(matrix, np.ascontiguousarray(vector), product)
        return product
    if matrix.dtype == vector.dtype:
        return np.asarray(matrix @ vector)
    starts = range(0, len(matrix), _ROWS_AT_ONCE)
    blocks = [matrix[start : start + _ROWS_AT_ONCE].astype(vector.dtype) @ vector for start in starts]
    return np.concatenate(blocks) if blocks else vector.copy()


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def write_symmetric_product(matrix, vector, out):  # type: ignore[no-untyped-def]
    """Write a symmetric matrix (m, m), m >= n, times a vector (n,) into `out` (n,), of the vector's precision."""
    size, zero = vector.size, vector.dtype.type(0)
    out.fill(zero)
    whole = size - size % 4
    # Four rows at a time: each entry serves its row and its column, and found is read and written once for all four.
    for i in range(0, whole, 4):
        first, second, third, fourth = matrix[i], matrix[i + 1], matrix[i + 2], matrix[i + 3]
        a, b, c, d = vector[i], vector[i + 1], vector[i + 2], vector[i + 3]
        of_a, of_b, of_c, of_d = zero, zero, zero, zero
        for j in range(i):
            entry = vector[j]
            of_a += first[j] * entry
            of_b += second[j] * entry
            of_c += third[j] * entry
            of_d += fourth[j] * entry
            out[j] += first[j] * a + second[j] * b + third[j] * c + fourth[j] * d
        out[i] += of_a
        out[i + 1] += of_b
        out[i + 2] += of_c
        out[i + 3] += of_d
        _add_corner(matrix, vector, out, i, i + 4)
    for i in range(whole, size):
        for j in range(whole):
            out[i] += matrix[i, j] * vector[j]
            out[j] += matrix[i, j] * vector[i]
    _add_corner(matrix, vector, out, whole, size)


@numba.njit(cache=True, nogil=True)
def _add_corner(matrix, vector, out, start, end):  # type: ignore[no-untyped-def]
    """Add what the diagonal block from `start` to `end` contributes."""
    for i in range(start, end):
        for j in range(start, i):
            out[i] += matrix[i, j] * vector[j]
            out[j] += matrix[i, j] * vector[i]
        out[i] += matrix[i, i] * vector[i]


def row_products(matrix: sparse.csr_matrix, rows: Floats) -> Floats:
    """Return a symmetric sparse matrix (n, n) times the rows of an array (k, n), shape (k, n)."""
    if len(rows) == 1:
        return np.asarray((matrix @ rows[0])[None])
    return np.ascontiguousarray((matrix @ rows.T).T)


@numba.njit(cache=True, nogil=True)
def weighted_rows(matrix, weights):  # type: ignore[no-untyped-def]
    """Return weights (m,) times a dense matrix (m, n), for which rows without weight are not read."""
    total, rows = np.zeros(matrix.shape[1]), np.flatnonzero(weights)
    whole = rows.size - rows.size % 4
    # Four rows at a time, in their order: the sum is read and written once for all four.
    for i in range(0, whole, 4):
        first, second, third, fourth = matrix[rows[i]], matrix[rows[i + 1]], matrix[rows[i + 2]], matrix[rows[i + 3]]
        a, b, c, d = weights[rows[i]], weights[rows[i + 1]], weights[rows[i + 2]], weights[rows[i + 3]]
        for j in range(total.size):
            total[j] = total[j] + a * first[j] + b * second[j] + c * third[j] + d * fourth[j]
    for i in rows[whole:]:
        weight, row = weights[i], matrix[i]
        # Compiled code would make an array of the product of both first.
        for j in range(total.size):
            total[j] += weight * row[j]
    return total
