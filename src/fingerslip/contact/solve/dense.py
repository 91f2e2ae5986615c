"""LU factors and products of dense matrices, by SciPy's LAPACK and BLAS, called so that threads run side by side.

SciPy's Python functions hold Python's lock while LAPACK works, and change the pivots during a call. Through the
addresses that SciPy gives to compiled code, motions in several threads can share a matrix without waiting for each
other.
"""

from __future__ import annotations

import ctypes
import functools
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numba
import numpy as np
from numba.extending import get_cython_function_address
from numpy.typing import NDArray

__all__ = ["DenseFactor", "factorise_dense", "solve_factorised", "symmetric_product"]

T = TypeVar("T", np.float32, np.float64)

_ARGUMENTS = {"getrf": 6, "getrs": 9, "symv": 10}
_REAL = {np.dtype(np.float32): ctypes.c_float, np.dtype(np.float64): ctypes.c_double}
_PRECISION = {np.dtype(np.float32): "s", np.dtype(np.float64): "d"}


@dataclass(frozen=True)
class DenseFactor(Generic[T]):
    """LU factors of a matrix, in single or double precision.

    Parameters
    ----------
    factors : (n, n) array
        LU factors of the transpose.
    pivots : (n,) array of int
        Rows that were swapped, in LAPACK's numbering from one.
    """

    factors: NDArray[T]
    pivots: NDArray[np.int32]

    def solve(self, vector: NDArray[T]) -> NDArray[T]:
        """Return the solution for a right-hand side (n,), same shape."""
        found = np.array(vector, dtype=self.factors.dtype)
        size, one, stride = ctypes.c_int(found.size), ctypes.c_int(1), ctypes.c_int(max(1, found.size))
        matrix, pivots, given = (array.ctypes.data for array in (self.factors, self.pivots, found))
        # LAPACK reads our rows as columns, that is, the transpose: its transposed problem is ours.
        given_as = (ctypes.c_char(b"T"), size, one, matrix, stride, pivots, given, stride, ctypes.c_int(0))
        _call("getrs", self.factors.dtype, *given_as)
        return found


def factorise_dense(matrix: NDArray[T]) -> DenseFactor[T]:
    """Factorise a matrix in its own memory.

    Parameters
    ----------
    matrix : (n, n) array
        The matrix in C order; its memory then holds the factors.
    """
    pivots = np.zeros(len(matrix), dtype=np.int32)
    size, stride = ctypes.c_int(len(matrix)), ctypes.c_int(max(1, len(matrix)))
    _call("getrf", matrix.dtype, size, size, matrix.ctypes.data, stride, pivots.ctypes.data, ctypes.c_int(0))
    # The factors precondition, or what they solve is checked: with ones for zero pivots they stay finite.
    diagonal = np.einsum("ii->i", matrix)
    diagonal[diagonal == 0.0] = 1.0
    return DenseFactor(matrix, pivots)


@numba.njit(cache=True, nogil=True, fastmath={"reassoc"})
def solve_factorised(factors, pivots, found):  # type: ignore[no-untyped-def]
    """Replace a right-hand side by the solution in compiled code, for small matrices: a call of LAPACK costs more.

    Parameters
    ----------
    factors, pivots : (n, n) array, (n,) array of int
        Those of a :class:`DenseFactor`.
    found : (n,) array
        The right-hand side, then the solution.
    """
    # The rows of the factors of the transpose are columns of its triangles: U^T from the first row on, then L^T.
    for i in range(found.size):
        total = 0.0
        for j in range(i):
            total += factors[i, j] * found[j]
        found[i] = (found[i] - total) / factors[i, i]
    for i in range(found.size - 1, -1, -1):
        total = 0.0
        for j in range(i + 1, found.size):
            total += factors[i, j] * found[j]
        found[i] -= total
    for i in range(found.size - 1, -1, -1):
        other = pivots[i] - 1
        found[i], found[other] = found[other], found[i]


def symmetric_product(matrix: NDArray[T], vector: NDArray[T]) -> NDArray[T]:
    """Return a symmetric matrix (n, n) times a vector (n,) of the same precision, for which half of it is read.

    Parameters
    ----------
    matrix : (n, n) array
        The matrix in C order; what is above its diagonal is not read.
    vector : (n,) array
        The vector.

    Examples
    --------
    >>> symmetric_product(np.array([[2.0, np.nan], [1.0, 3.0]]), np.array([1.0, 2.0])).tolist()
    [4.0, 7.0]
    """
    found, given = np.zeros(len(vector), dtype=matrix.dtype), np.ascontiguousarray(vector)
    if not found.size:
        return found
    size, one, real = ctypes.c_int(found.size), ctypes.c_int(1), _REAL[matrix.dtype]
    stride = ctypes.c_int(max(1, found.size))
    memory, read, written = (array.ctypes.data for array in (matrix, given, found))
    # BLAS reads our rows as columns: the lower triangle is its upper one.
    sides = (read, one, real(0.0), written, one)
    _call("symv", matrix.dtype, ctypes.c_char(b"U"), size, real(1.0), memory, stride, *sides)
    return found


def _call(name: str, precision: np.dtype[Any], *given: Any) -> None:
    """Call a function of LAPACK or BLAS; addresses are plain numbers, other values are passed by reference."""
    passed = [value if isinstance(value, int) else ctypes.byref(value) for value in given]
    _function(_PRECISION[precision] + name)(*passed)


@functools.cache
def _function(name: str) -> Any:
    library = "blas" if name[1:] == "symv" else "lapack"
    address = get_cython_function_address(f"scipy.linalg.cython_{library}", name)
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * _ARGUMENTS[name[1:]])(address)
