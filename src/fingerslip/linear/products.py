"""Products of matrices with vectors, whose cost is reading the matrix."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

__all__ = [
    "CompiledMatrix",
    "add_columns",
    "add_rows",
    "as_rows",
    "compiled_parts",
    "long_product",
    "write_products",
]

Array = NDArray[np.float64]
#: Starts of rows, or columns, indices and values of a sparse matrix.
CompiledMatrix = tuple[NDArray[Any], NDArray[Any], Array]

_UNSIGNED = {4: np.dtype(np.uint32), 8: np.dtype(np.uint64)}
_AT_ONCE = 8


def long_product(matrix: sparse.csr_matrix, vector: Array) -> Array:
    """Return a matrix (n, m) with long rows times a vector (m,), shape (n,).

    For short rows SciPy is as fast, but where there are few of them: its calls cost more.
    """
    found = np.empty(matrix.shape[0])
    _long_product(*compiled_parts(matrix), vector, found)
    return found


def as_rows(vectors: Sequence[Array]) -> Array:
    """Return k vectors (n,) as rows, shape (k, n); of a single one it is a view."""
    return vectors[0][None] if len(vectors) == 1 else np.stack(vectors)


def add_columns(vector: Array, matrix: sparse.csc_matrix, weights: Array) -> Array:
    """Return a vector (n,) plus a matrix (n, m) times weights (m,), for which columns without weight are not read."""
    total = vector.copy()
    _add_columns(*compiled_parts(matrix), weights, total)
    return total


def add_rows(vector: Array, matrix: Array, weights: Array) -> Array:
    """Return a vector (n,) plus weights (m,) times a dense matrix (m, n), for which rows without weight are not read.

    Examples
    --------
    >>> add_rows(np.ones(2), np.array([[1.0, 2.0], [5.0, 6.0]]), np.array([10.0, 0.0])).tolist()
    [11.0, 21.0]
    """
    total = vector.copy()
    _add_rows(matrix, weights, total)
    return total


def compiled_parts(matrix: sparse.csr_matrix | sparse.csc_matrix) -> CompiledMatrix:
    """Return starts and indices of a matrix as numbers without sign, and values.

    With a sign, compiled code allows for counting from the end at every entry, and takes twice as long.
    """
    starts, indices = matrix.indptr, matrix.indices
    return starts.view(_UNSIGNED[starts.itemsize]), indices.view(_UNSIGNED[indices.itemsize]), matrix.data


@numba.njit(cache=True, nogil=True, fastmath={"reassoc"})
def _long_product(starts, columns, values, vector, found):  # type: ignore[no-untyped-def]
    for row in range(found.size):
        total = 0.0
        for entry in range(starts[row], starts[row + 1]):
            total += values[entry] * vector[columns[entry]]
        found[row] = total


@numba.njit(cache=True, nogil=True)
def write_products(matrix, rows, found):  # type: ignore[no-untyped-def]
    """Write a matrix (m, n) times the rows of an array (k, n) into `found` (k, m), in compiled code.

    The matrix, as :func:`compiled_parts` gives it, is read once for each eight vectors. The sums are SciPy's to the
    last digit.
    """
    for start in range(0, len(rows), _AT_ONCE):
        _eight_products(matrix, rows[start : start + _AT_ONCE], found[start : start + _AT_ONCE])


@numba.njit(cache=True, nogil=True)
def _eight_products(matrix, rows, found):  # type: ignore[no-untyped-def]
    """Do what :func:`write_products` does for up to eight vectors.

    They are laid side by side, so that an entry of the matrix meets eight numbers in one line of memory.
    """
    starts, columns, values = matrix
    given = np.zeros((rows.shape[1], _AT_ONCE))
    for number in range(len(rows)):
        for column in range(rows.shape[1]):
            given[column, number] = rows[number, column]
    for row in range(found.shape[1]):
        # A sum for each vector, by name: of an array, the compiler makes a loop of eight additions.
        a = b = c = d = e = f = g = h = 0.0
        for entry in range(starts[row], starts[row + 1]):
            value, line = values[entry], given[columns[entry]]
            a, b, c, d = a + value * line[0], b + value * line[1], c + value * line[2], d + value * line[3]
            e, f, g, h = e + value * line[4], f + value * line[5], g + value * line[6], h + value * line[7]
        for number, total in enumerate((a, b, c, d, e, f, g, h)):
            if number < len(found):
                found[number, row] = total


@numba.njit(cache=True, nogil=True)
def _add_columns(starts, rows, values, weights, total):  # type: ignore[no-untyped-def]
    for column in range(weights.size):
        if weights[column] != 0.0:
            weight = weights[column]
            for entry in range(starts[column], starts[column + 1]):
                total[rows[entry]] += weight * values[entry]


@numba.njit(cache=True, nogil=True)
def _add_rows(matrix, weights, total):  # type: ignore[no-untyped-def]
    for row in range(weights.size):
        if weights[row] != 0.0:
            weight = weights[row]
            for column in range(total.size):
                total[column] += weight * matrix[row, column]
