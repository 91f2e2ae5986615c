"""LU factors of dense matrices in single precision, by SciPy's LAPACK, called so that threads run side by side.

SciPy's Python functions hold Python's lock while LAPACK works, and change the pivots during a call. Through the
addresses that SciPy gives to compiled code, motions in several threads can share a factor without waiting for each
other.
"""

from __future__ import annotations

import ctypes
import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba.extending import get_cython_function_address
from numpy.typing import NDArray

__all__ = ["DenseFactor", "factorise_dense"]

Single = NDArray[np.float32]

_ARGUMENTS = {"sgetrf": 6, "sgetrs": 9}


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

    factors: Single
    pivots: NDArray[np.int32]

    def solve(self, vector: Single) -> Single:
        """Return the solution for a right-hand side (n,), same shape."""
        found = np.array(vector, dtype=np.float32)
        size, one = ctypes.c_int(found.size), ctypes.c_int(1)
        arrays = (self.factors.ctypes, self.pivots.ctypes, found.ctypes)
        matrix, pivots, given = (array.data_as(ctypes.c_void_p) for array in arrays)
        # LAPACK reads our rows as columns, that is, the transpose: its transposed problem is ours.
        _call("sgetrs", ctypes.c_char(b"T"), size, one, matrix, size, pivots, given, size)
        return found


def factorise_dense(matrix: Single) -> DenseFactor:
    """Factorise a matrix in its own memory.

    Parameters
    ----------
    matrix : (n, n) array
        The matrix in C order; its memory then holds the factors.
    """
    pivots = np.zeros(len(matrix), dtype=np.int32)
    size = ctypes.c_int(len(matrix))
    memory, swapped = (array.ctypes.data_as(ctypes.c_void_p) for array in (matrix, pivots))
    _call("sgetrf", size, size, memory, size, swapped)
    # The factors only precondition: with ones for zero pivots they stay finite.
    diagonal = np.einsum("ii->i", matrix)
    diagonal[diagonal == 0.0] = 1.0
    return DenseFactor(matrix, pivots)


def _call(name: str, *given: Any) -> None:
    """Call a function of LAPACK; values that are not addresses are passed by reference."""
    passed = [value if isinstance(value, ctypes.c_void_p) else ctypes.byref(value) for value in given]
    _lapack(name)(*passed, ctypes.byref(ctypes.c_int(0)))


@functools.cache
def _lapack(name: str) -> Any:
    address = get_cython_function_address("scipy.linalg.cython_lapack", name)
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * _ARGUMENTS[name])(address)
