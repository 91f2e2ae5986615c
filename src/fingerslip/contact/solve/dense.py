"""LU factors of dense matrices, by SciPy's LAPACK, called so that threads run side by side.

SciPy's Python functions hold Python's lock while LAPACK works, and change the pivots during a call. Through the
addresses that SciPy gives to compiled code, motions in several threads can share a factor without waiting for each
other.
"""

from __future__ import annotations

import ctypes
import functools
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numba.extending import get_cython_function_address
from numpy.typing import NDArray

__all__ = ["DenseFactor", "factorise_dense"]

T = TypeVar("T", np.float32, np.float64)

_ARGUMENTS = {"getrf": 6, "getrs": 9}
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
        arrays = (self.factors.ctypes, self.pivots.ctypes, found.ctypes)
        matrix, pivots, given = (array.data_as(ctypes.c_void_p) for array in arrays)
        # LAPACK reads our rows as columns, that is, the transpose: its transposed problem is ours.
        _call("getrs", self.factors.dtype, ctypes.c_char(b"T"), size, one, matrix, stride, pivots, given, stride)
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
    memory, swapped = (array.ctypes.data_as(ctypes.c_void_p) for array in (matrix, pivots))
    _call("getrf", matrix.dtype, size, size, memory, stride, swapped)
    # The factors precondition, or what they solve is checked: with ones for zero pivots they stay finite.
    diagonal = np.einsum("ii->i", matrix)
    diagonal[diagonal == 0.0] = 1.0
    return DenseFactor(matrix, pivots)


def _call(name: str, precision: np.dtype[Any], *given: Any) -> None:
    """Call a function of LAPACK; values that are not addresses are passed by reference."""
    passed = [value if isinstance(value, ctypes.c_void_p) else ctypes.byref(value) for value in given]
    _lapack(_PRECISION[precision] + name)(*passed, ctypes.byref(ctypes.c_int(0)))


@functools.cache
def _lapack(name: str) -> Any:
    address = get_cython_function_address("scipy.linalg.cython_lapack", name)
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * _ARGUMENTS[name[1:]])(address)
