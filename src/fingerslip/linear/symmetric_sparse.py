"""Products of sparse symmetric matrices with vectors, whose cost is reading the matrix.

Of one or two vectors half of the matrix is read: each entry serves its row and its column. Every component is still
the sum over its row, so that where these sums cancel, as the forces of a rigid motion do, no more is left of them than
of a product with the whole matrix.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.linear.products import CompiledMatrix, compiled_parts, write_products

__all__ = ["SymmetricMatrix", "symmetric_parts", "write_symmetric_products"]

Array = NDArray[np.float64]


class SymmetricMatrix(NamedTuple):
    """A sparse symmetric matrix (n, n) for compiled code."""

    whole: CompiledMatrix  # all of it, as :func:`fingerslip.linear.products.compiled_parts` gives it
    above: CompiledMatrix  # what is above the diagonal
    diagonal: Array  # (n,), the diagonal


def symmetric_parts(matrix: sparse.csr_matrix) -> SymmetricMatrix:
    """Return a symmetric matrix (n, n) for compiled code."""
    above = sparse.csr_matrix(sparse.triu(matrix, 1))
    return SymmetricMatrix(compiled_parts(matrix), compiled_parts(above), matrix.diagonal())


@numba.njit(cache=True, nogil=True)
def write_symmetric_products(matrix, rows, found):  # type: ignore[no-untyped-def]
    """Write a symmetric matrix (n, n) times the rows of an array (k, n) into `found` (k, n), in compiled code.

    The matrix is one that :func:`symmetric_parts` gives.
    """
    starts, columns, values = matrix.above
    if len(rows) > 2:
        write_products(matrix.whole, rows, found)
        return
    for number in range(len(rows)):
        for row in range(matrix.diagonal.size):
            found[number, row] = matrix.diagonal[row] * rows[number, row]
    if len(rows) == 1:
        _add_product(starts, columns, values, rows[0], found[0])
    else:
        _add_two_products(starts, columns, values, rows[0], rows[1], found[0], found[1])


@numba.njit(cache=True, nogil=True, fastmath={"reassoc"})
def _add_product(starts, columns, values, vector, found):  # type: ignore[no-untyped-def]
    for row in range(found.size):
        total, own = 0.0, vector[row]
        for entry in range(starts[row], starts[row + 1]):
            column, value = columns[entry], values[entry]
            total += value * vector[column]
            found[column] += value * own
        found[row] += total


@numba.njit(cache=True, nogil=True, fastmath={"reassoc"})
def _add_two_products(starts, columns, values, first, second, one, other):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    for row in range(one.size):
        total, other_total, own, other_own = 0.0, 0.0, first[row], second[row]
        for entry in range(starts[row], starts[row + 1]):
            column, value = columns[entry], values[entry]
            total += value * first[column]
            other_total += value * second[column]
            one[column] += value * own
            other[column] += value * other_own
        one[row] += total
        other[row] += other_total
