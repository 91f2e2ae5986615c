"""MKL PARDISO, called without copies."""

from __future__ import annotations

import ctypes
import functools
import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.errors import FingerslipError

__all__ = ["PardisoFactor", "PardisoSchurFactor", "pardiso_available", "pardiso_schur_bytes"]

Array = NDArray[np.float64]

_SPD = 2
_ANALYSE, _FACTORISE, _FORWARD, _BACKWARD, _RELEASE = 11, 22, 331, 333, -1
_OUT_OF_MEMORY = -2
_NOT_DEFINITE = "the matrix is not positive definite"
_SCHUR, _RETURN_SCHUR_KEEP_FACTORS = 35, 2
_PARALLEL, _TWO_LEVELS = 23, 1


def pardiso_available() -> bool:
    """Tell whether MKL PARDISO can be used on this machine, and load it if so."""
    try:
        _mkl_pardiso()
    except (ImportError, OSError):
        return False
    return True


def pardiso_schur_bytes(matrix: sparse.csr_matrix, places: NDArray[np.int64]) -> int:
    """Return the memory that factors around some unknowns take, with their Schur complement [bytes]."""
    call, none = _schur_call(matrix, places), np.zeros(matrix.shape[0])
    try:
        call(_ANALYSE, none)
        return 1024 * int(max(call.settings[14], call.settings[15] + call.settings[16]))
    finally:
        call(_RELEASE, none)


def _schur_call(matrix: sparse.csr_matrix, places: NDArray[np.int64]) -> _PardisoCall:
    call = _PardisoCall(matrix)
    call.order = np.zeros(matrix.shape[0], dtype=np.int32)
    call.order[places] = 1
    call.settings[_SCHUR] = _RETURN_SCHUR_KEEP_FACTORS
    # With a Schur complement, substitutions use several threads only so (measured).
    call.settings[_PARALLEL] = _TWO_LEVELS
    return call


class PardisoFactor:
    """Cholesky factors by MKL PARDISO, called without copies."""

    name = "MKL PARDISO"

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        self._call = _PardisoCall(matrix)
        for phase in (_ANALYSE, _FACTORISE):
            self._call(phase, np.zeros(matrix.shape[0]))
        weakref.finalize(self, self._call, _RELEASE, np.zeros(matrix.shape[0]))

    def forward(self, right_hand_side: Array) -> Array:
        """Return y = L^-1 b; shapes (n,) or (n, k)."""
        return self._call(_FORWARD, right_hand_side)

    def backward(self, halfway: Array) -> Array:
        """Return x = L^-T y; shapes (n,) or (n, k)."""
        return self._call(_BACKWARD, halfway)

    def transposed_backward(self, right_hand_side: Array) -> Array:
        """Return L^-1 b: the factors are each other's transposes."""
        return self.forward(right_hand_side)


class PardisoSchurFactor:
    """Factors of all unknowns but some, and the Schur complement on these, by one factorisation.

    Parameters
    ----------
    matrix : scipy.sparse.csr_matrix
        Symmetric positive definite, shape (n, n).
    places : (m,) array
        The unknowns that are left, ascending.
    schur : (m, m) array
        Takes the Schur complement.
    """

    name = "MKL PARDISO"
    substitutions = 1

    def __init__(self, matrix: sparse.csr_matrix, places: NDArray[np.int64], schur: Array) -> None:
        # Of unknowns without neighbours, PARDISO does not look at the sign here.
        if not (matrix.diagonal() > 0.0).all():
            raise FingerslipError(f"MKL PARDISO: {_NOT_DEFINITE}")
        self._call, none = _schur_call(matrix, places), np.zeros(matrix.shape[0])
        self._call(_ANALYSE, none)
        self._call(_FACTORISE, none, schur)
        weakref.finalize(self, self._call, _RELEASE, none)

    def forward(self, right_hand_side: Array) -> Array:
        """Eliminate: return a vector that holds, at the places, the right-hand side of the Schur complement."""
        return self._call(_FORWARD, right_hand_side)

    def backward(self, halfway: Array) -> Array:
        """Return the solution from a halfway vector that holds, at the places, the solution there."""
        return self._call(_BACKWARD, halfway)


class _PardisoCall:
    """One matrix with its handle inside MKL, and the call that takes both.

    pypardiso's own ``solve`` copies and hashes the matrix at every call; here its arrays are kept.
    """

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        upper = sparse.triu(matrix, format="csr")
        upper.sort_indices()
        self._function = _mkl_pardiso()
        self._handle, self.settings = np.zeros(64, dtype=np.int64), np.zeros(64, dtype=np.int32)
        self.order = np.zeros(0, dtype=np.int32)
        self.settings[0] = 1  # the settings that follow count
        self.settings[1] = 2  # nested dissection
        self._size = upper.shape[0]
        self._values = np.ascontiguousarray(upper.data, dtype=np.float64)
        self._rows = np.ascontiguousarray(upper.indptr + 1, dtype=np.int32)
        self._columns = np.ascontiguousarray(upper.indices + 1, dtype=np.int32)

    def __call__(self, phase: int, given: Array, found: Array | None = None) -> Array:
        given = np.asfortranarray(given)
        found = np.zeros_like(given, order="F") if found is None else found
        int32, double = ctypes.POINTER(ctypes.c_int32), ctypes.POINTER(ctypes.c_double)
        error = ctypes.c_int32(0)
        self._function(
            self._handle.ctypes.data_as(ctypes.POINTER(ctypes.c_int64)),
            _integer(1),
            _integer(1),
            _integer(_SPD),
            _integer(phase),
            _integer(self._size),
            self._values.ctypes.data_as(double),
            self._rows.ctypes.data_as(int32),
            self._columns.ctypes.data_as(int32),
            self.order.ctypes.data_as(int32),
            _integer(1 if given.ndim == 1 else given.shape[1]),
            self.settings.ctypes.data_as(int32),
            _integer(0),
            given.ctypes.data_as(double),
            found.ctypes.data_as(double),
            ctypes.byref(error),
        )
        if error.value:
            reason = "memory ran out" if error.value == _OUT_OF_MEMORY else _NOT_DEFINITE
            raise FingerslipError(f"MKL PARDISO: error {error.value} in phase {phase}; {reason}")
        return found


@functools.cache
def _mkl_pardiso() -> Any:
    """Return MKL's function, which pypardiso finds by searching the whole environment once."""
    import pypardiso

    # The library offers no public way to a single phase.
    return pypardiso.PyPardisoSolver(mtype=_SPD)._mkl_pardiso  # noqa: SLF001


def _integer(value: int) -> Any:
    return ctypes.byref(ctypes.c_int32(value))
