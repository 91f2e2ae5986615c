"""Factorise a sparse symmetric positive definite matrix once, and substitute many times.

A factorisation gives two half substitutions, *forward* and *backward*, one after the other a solve.
Between the halves the contact forces are found (see :mod:`fingerslip.dynamics.condensation`), so that a
time step costs one substitution. MKL PARDISO does this where it is installed; SuperLU, which comes with
SciPy, everywhere else.
"""

from __future__ import annotations

import ctypes
import functools
import weakref
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from fingerslip.errors import FingerslipError

__all__ = ["Factor", "PardisoFactor", "SuperLUFactor", "factorise", "pardiso_available"]

Array = NDArray[np.float64]

_SPD = 2
_ANALYSE_AND_FACTORISE, _FORWARD, _BACKWARD, _RELEASE = 12, 331, 333, -1
_OUT_OF_MEMORY = -2


class Factor(Protocol):
    """A factorised matrix A = L U with its two half substitutions; for n unknowns and k columns."""

    name: str

    def forward(self, right_hand_side: Array) -> Array:
        """Return y = L^-1 b; shapes (n,) or (n, k)."""

    def backward(self, halfway: Array) -> Array:
        """Return x = U^-1 y; shapes (n,) or (n, k)."""

    def transposed_backward(self, right_hand_side: Array) -> Array:
        """Return z = U^-T b, so that b . x = z . y; equals `forward` where U is the transpose of L."""


def pardiso_available() -> bool:
    """Tell whether MKL PARDISO can be used on this machine, and load it if so."""
    try:
        _mkl_pardiso()
    except (ImportError, OSError):
        return False
    return True


def factorise(matrix: sparse.csr_matrix) -> Factor:
    """Factorise with the fastest solver that is installed.

    Parameters
    ----------
    matrix : scipy.sparse.csr_matrix
        Symmetric positive definite, shape (n, n).
    """
    return PardisoFactor(matrix) if pardiso_available() else SuperLUFactor(matrix)


class PardisoFactor:
    """Cholesky factors by MKL PARDISO, called without copies."""

    name = "MKL PARDISO"

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        self._call = _PardisoCall(matrix)
        self._call(_ANALYSE_AND_FACTORISE, np.zeros(matrix.shape[0]))
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


class _PardisoCall:
    """One matrix with its handle inside MKL, and the call that takes both.

    pypardiso's own ``solve`` copies and hashes the matrix at every call; here its arrays are kept.
    """

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        upper = sparse.triu(matrix, format="csr")
        upper.sort_indices()
        self._function = _mkl_pardiso()
        self._handle, self._settings = np.zeros(64, dtype=np.int64), np.zeros(64, dtype=np.int32)
        self._order = np.zeros(0, dtype=np.int32)
        self._settings[0] = 1  # the settings that follow count
        self._settings[1] = 2  # nested dissection
        self._size = upper.shape[0]
        self._values = np.ascontiguousarray(upper.data, dtype=np.float64)
        self._rows = np.ascontiguousarray(upper.indptr + 1, dtype=np.int32)
        self._columns = np.ascontiguousarray(upper.indices + 1, dtype=np.int32)

    def __call__(self, phase: int, given: Array) -> Array:
        given = np.asfortranarray(given)
        found = np.zeros_like(given, order="F")
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
            self._order.ctypes.data_as(int32),
            _integer(1 if given.ndim == 1 else given.shape[1]),
            self._settings.ctypes.data_as(int32),
            _integer(0),
            given.ctypes.data_as(double),
            found.ctypes.data_as(double),
            ctypes.byref(error),
        )
        if error.value:
            reason = "memory ran out" if error.value == _OUT_OF_MEMORY else "the matrix is not positive definite"
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


class SuperLUFactor:
    """Triangular factors by SuperLU; its forward half is put off to the backward one, in one full solve."""

    name = "SuperLU"

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        try:
            self._factors = linalg.splu(
                sparse.csc_matrix(matrix),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise FingerslipError(f"SuperLU: {error}; the matrix is not positive definite") from error

    def forward(self, right_hand_side: Array) -> Array:
        """Return b as it is (L is the identity here)."""
        return right_hand_side

    def backward(self, halfway: Array) -> Array:
        """Return x = A^-1 y; shapes (n,) or (n, k)."""
        solution: Array = self._factors.solve(halfway)
        return solution

    def transposed_backward(self, right_hand_side: Array) -> Array:
        """Return A^-1 b, A being symmetric."""
        return self.backward(right_hand_side)
