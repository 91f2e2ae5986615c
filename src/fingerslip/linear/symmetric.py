"""Products of symmetric matrices, dense and sparse, with vectors, whose cost is reading the matrix.

A dense matrix of single precision may be multiplied with vectors of double precision. Its entries are then taken as
they are, and the product is exact but for rounding in double precision, while half as many bytes are read.

Of a sparse matrix, for one or two vectors, half is read: each entry serves its row and its column. Every component is
still the sum over its row, so that where these sums cancel, as the forces of a rigid motion do, no more is left of them
than of a product with the whole matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

_ROWS_AT_ONCE = 256


def symmetric_product(matrix: NDArray[Any], vector: NDArray[Any]) -> NDArray[Any]:
    """Return a symmetric matrix (n, n) times a vector (n,), in the precision of the vector.

    Half of the matrix is read: what is above its diagonal may be anything.

    Examples
    --------
    >>> symmetric_product(np.array([[2.0, np.nan], [1.0, 3.0]], dtype=np.float32), np.array([1.0, 2.0])).tolist()
    [4.0, 7.0]
    """
    product = np.empty_like(vector)
    write_symmetric_product(matrix, np.ascontiguousarray(vector), product)
    return product


def symmetric_products(matrix: NDArray[Any], columns: NDArray[Any]) -> NDArray[Any]:
    """Return a symmetric matrix (n, n), all of which is there, times columns (n, k), in their precision."""
    if matrix.dtype == columns.dtype:
        return np.asarray(matrix @ columns)
    starts = range(0, len(matrix), _ROWS_AT_ONCE)
    blocks = [matrix[start : start + _ROWS_AT_ONCE].astype(columns.dtype) @ columns for start in starts]
    return np.concatenate(blocks) if blocks else columns.copy()


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


Array = NDArray[np.float64]
#: Starts of rows, or columns, indices and values of a sparse matrix.
CompiledMatrix = tuple[NDArray[Any], NDArray[Any], Array]

_UNSIGNED = {4: np.dtype(np.uint32), 8: np.dtype(np.uint64)}
_AT_ONCE = 8


def long_product(matrix: sparse.csr_matrix, vector: Array) -> Array:
    """Return a matrix (n, m) with long rows times a vector (m,), shape (n,).

    For short rows SciPy is as fast, but where there are few of them: its calls cost more.
    """
    product = np.empty(matrix.shape[0])
    _long_product(*compiled_parts(matrix), vector, product)
    return product


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
def _long_product(starts, columns, values, vector, out):  # type: ignore[no-untyped-def]
    for row in range(out.size):
        total = 0.0
        for entry in range(starts[row], starts[row + 1]):
            total += values[entry] * vector[columns[entry]]
        out[row] = total


@numba.njit(cache=True, nogil=True)
def write_products(matrix, rows, out):  # type: ignore[no-untyped-def]
    """Write a matrix (m, n) times the rows of an array (k, n) into `out` (k, m), in compiled code.

    The matrix, as :func:`compiled_parts` gives it, is read once for each eight vectors. The sums are SciPy's to the
    last digit.
    """
    for start in range(0, len(rows), _AT_ONCE):
        _eight_products(matrix, rows[start : start + _AT_ONCE], out[start : start + _AT_ONCE])


@numba.njit(cache=True, nogil=True)
def _eight_products(matrix, rows, out):  # type: ignore[no-untyped-def]
    """Do what :func:`write_products` does for up to eight vectors.

    They are laid side by side, so that an entry of the matrix meets eight numbers in one line of memory.
    """
    starts, columns, values = matrix
    gathered = np.zeros((rows.shape[1], _AT_ONCE))
    for number in range(len(rows)):
        for column in range(rows.shape[1]):
            gathered[column, number] = rows[number, column]
    for row in range(out.shape[1]):
        # A sum for each vector, by name: of an array, the compiler makes a loop of eight additions.
        a = b = c = d = e = f = g = h = 0.0
        for entry in range(starts[row], starts[row + 1]):
            value, line = values[entry], gathered[columns[entry]]
            a, b, c, d = a + value * line[0], b + value * line[1], c + value * line[2], d + value * line[3]
            e, f, g, h = e + value * line[4], f + value * line[5], g + value * line[6], h + value * line[7]
        for number, total in enumerate((a, b, c, d, e, f, g, h)):
            if number < len(out):
                out[number, row] = total


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


class SymmetricMatrix(NamedTuple):
    """A sparse symmetric matrix (n, n) for compiled code."""

    whole: CompiledMatrix
    above: CompiledMatrix  # what is above the diagonal
    diagonal: Array  # (n,)


def symmetric_parts(matrix: sparse.csr_matrix) -> SymmetricMatrix:
    """Return a symmetric matrix (n, n) for compiled code."""
    above = sparse.csr_matrix(sparse.triu(matrix, 1))
    return SymmetricMatrix(compiled_parts(matrix), compiled_parts(above), matrix.diagonal())


def row_products(matrix: SymmetricMatrix, rows: Array) -> Array:
    """Return a symmetric matrix (n, n) times the rows of an array (k, n), shape (k, n)."""
    rows, products = np.ascontiguousarray(rows), np.empty_like(rows, order="C")
    if len(rows) > 2:
        write_products(matrix.whole, rows, products)
        return products
    np.multiply(matrix.diagonal, rows, out=products)
    if len(rows) == 1:
        _add_product(*matrix.above, rows[0], products[0])
    elif len(rows):
        _add_two_products(*matrix.above, *rows, *products)
    return products


@numba.njit(cache=True, nogil=True, fastmath={"reassoc"})
def _add_product(starts, columns, values, vector, out):  # type: ignore[no-untyped-def]
    for row in range(out.size):
        total, element = 0.0, vector[row]
        for entry in range(starts[row], starts[row + 1]):
            column, value = columns[entry], values[entry]
            total += value * vector[column]
            out[column] += value * element
        out[row] += total


@numba.njit(cache=True, nogil=True, fastmath={"reassoc"})
def _add_two_products(starts, columns, values, first, second, first_out, second_out):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    for row in range(first_out.size):
        first_total, second_total, first_element, second_element = 0.0, 0.0, first[row], second[row]
        for entry in range(starts[row], starts[row + 1]):
            column, value = columns[entry], values[entry]
            first_total += value * first[column]
            second_total += value * second[column]
            first_out[column] += value * first_element
            second_out[column] += value * second_element
        first_out[row] += first_total
        second_out[row] += second_total
