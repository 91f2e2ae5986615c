"""LU factors of dense matrices, by SciPy's LAPACK, called so that threads run side by side.

SciPy's Python functions hold Python's lock while LAPACK works. Through the addresses that SciPy gives to compiled code,
motions in several threads do not wait for each other.
"""

from __future__ import annotations

import ctypes
import functools
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numba.extending import get_cython_function_address
from numpy.typing import NDArray

__all__ = ["DenseFactor", "factorise_dense", "solve_by_factors"]

Array = NDArray[np.float64]

_ARGUMENTS = 6


@dataclass(frozen=True)
class DenseFactor:
    """LU factors of a matrix.

    Parameters
    ----------
    factors : (n, n) array
        LU factors of the transpose.
    pivots : (n,) array of int
        Rows that were swapped, in LAPACK's numbering from one.
    """

    factors: Array
    pivots: NDArray[np.int32]


def factorise_dense(matrix: Array) -> DenseFactor:
    """Factorise a matrix in its own memory.

    Arrays: matrix (n, n).
    """
    pivots = np.zeros(len(matrix), dtype=np.int32)
    size, stride, failed = ctypes.c_int(len(matrix)), ctypes.c_int(max(1, len(matrix))), ctypes.c_int(0)
    numbers = (ctypes.addressof(number) for number in (size, size))
    arrays = matrix.ctypes.data, ctypes.addressof(stride), pivots.ctypes.data
    _getrf()(*numbers, *arrays, ctypes.addressof(failed))
    # With ones for zero pivots solutions stay finite; what they solve is checked.
    diagonal = np.einsum("ii->i", matrix)
    diagonal[diagonal == 0.0] = 1.0
    return DenseFactor(matrix, pivots)


@numba.njit(cache=True, nogil=True, fastmath={"reassoc"})
def solve_by_factors(factors, pivots, solution):  # type: ignore[no-untyped-def]
    """Replace a right-hand side by the solution in compiled code, for small matrices: a call of LAPACK costs more.

    Arrays: factors, pivots (n, n); found (n,).
    """
    # The rows of the factors of the transpose are columns of its triangles: U^T from the first row on, then L^T.
    for i in range(solution.size):
        total = 0.0
        for j in range(i):
            total += factors[i, j] * solution[j]
        solution[i] = (solution[i] - total) / factors[i, i]
    for i in range(solution.size - 1, -1, -1):
        total = 0.0
        for j in range(i + 1, solution.size):
            total += factors[i, j] * solution[j]
        solution[i] -= total
    for i in range(solution.size - 1, -1, -1):
        other = pivots[i] - 1
        solution[i], solution[other] = solution[other], solution[i]


@functools.cache
def _getrf() -> Any:
    address = get_cython_function_address("scipy.linalg.cython_lapack", "dgetrf")
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * _ARGUMENTS)(address)
