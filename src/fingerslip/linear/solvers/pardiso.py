"""MKL PARDISO, called without copies."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import weakref
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.errors import FingerslipError

_SPD = 2
_ANALYSE, _FACTORISE, _FORWARD, _BACKWARD, _RELEASE, _RELEASE_VALUES = 11, 22, 331, 333, -1, 0
_OUT_OF_MEMORY = -2
_NOT_DEFINITE = "the matrix is not positive definite"
_SCHUR, _RETURN_SCHUR_KEEP_FACTORS = 35, 2
_PARALLEL, _TWO_LEVELS = 23, 1
_SINGLE_PRECISION = 27
# Peak memory of the analysis, and what stays of it with the factors [KiB].
_PEAK, _PERMANENT, _FACTORS = 14, 15, 16
_ARGUMENTS = 16
# Milliseconds that MKL's threads spin after their work: by default 200, longer than all else in a step takes, so that
# they would take a core from contact and from other programs throughout.
_SPIN = "KMP_BLOCKTIME", "0"
_NONE = np.zeros(0, dtype=np.int64)


class Pardiso:
    """MKL PARDISO: see :class:`fingerslip.linear.solver.LinearSolver`.

    As a series it keeps the analysis for matrices of the same pattern; `single` are factors around unknowns of single
    precision.
    """

    name: ClassVar[str] = "MKL PARDISO"
    preference: ClassVar[int] = 10

    def __init__(self, *, is_series: bool = False, single: bool = False) -> None:
        self._is_series = is_series
        self._analysis: _Analysis | None = None
        self._around = np.float32 if single else np.float64

    def is_available(self) -> bool:
        """Tell whether MKL is installed, and load it if so."""
        try:
            _mkl_pardiso()
        except (ImportError, OSError):
            return False
        return True

    def series(self) -> Pardiso:
        """Return a solver for matrices one after the other, which analyses a pattern once."""
        return self if self._is_series else Pardiso(is_series=True)

    def rough(self) -> Pardiso:
        """Return a series whose factors around unknowns are of single precision."""
        return Pardiso(is_series=True, single=True)

    def factorise(self, matrix: sparse.csr_matrix) -> PardisoFactor:
        """Factorise a matrix (n, n)."""
        return PardisoFactor(self._analyse(matrix, _NONE))

    def factorise_around(self, matrix: sparse.csr_matrix, interface: Integers) -> tuple[PardisoFactor, NDArray[Any]]:
        """Factorise a matrix (n, n) but for unknowns (m,); also return their Schur complement (m, m)."""
        # PARDISO does not check the sign of unknowns without neighbours here.
        if not (matrix.diagonal() > 0.0).all():
            raise FingerslipError(f"{self.name}: {_NOT_DEFINITE}")
        schur = np.zeros((interface.size, interface.size), self._around)
        return PardisoFactor(self._analyse(matrix, interface), schur), schur

    def bytes_around(self, matrix: sparse.csr_matrix, interface: Integers) -> int:
        """Return the memory that the factors around unknowns (m,) take, with their Schur complement [bytes]."""
        return self._analyse(matrix, interface).bytes

    def _analyse(self, matrix: sparse.csr_matrix, interface: Integers) -> _Analysis:
        """Return the analysis of a matrix: the last one, unless the pattern is another or its factors are in use."""
        upper = sparse.triu(matrix, format="csr")
        upper.sort_indices()
        if self._analysis is not None and self._analysis.takes(upper, interface):
            return self._analysis
        self._analysis = None  # there may be no memory for both
        analysis = _Analysis(upper, interface, self._around if interface.size else np.float64)
        self._analysis = analysis if self._is_series else None
        return analysis


SOLVER = Pardiso()


class PardisoFactor:
    """Cholesky factors of a matrix, of all its unknowns or of all but some, whose Schur complement is filled in."""

    substitutions = 1

    def __init__(self, analysis: _Analysis, schur: NDArray[Any] | None = None) -> None:
        self._analysis, self._call, none = analysis, analysis.call, np.zeros(analysis.call.size)
        analysis.user = weakref.ref(self)
        self.is_single = bool(analysis.call.settings[_SINGLE_PRECISION])
        # Factors that fail half-way give their memory back, too.
        weakref.finalize(self, self._call.release, _RELEASE_VALUES)
        self._call(_FACTORISE, none, schur)

    def forward(self, right_hand_side: Floats) -> Floats:
        """Return the forward half of a substitution for a right-hand side (n,) or (n, k), same shape."""
        return self._call(_FORWARD, right_hand_side).astype(np.float64, copy=False)

    def backward(self, halfway: Floats) -> Floats:
        """Return the solution from a forward half (n,) or (n, k), same shape."""
        solution = self._call(_BACKWARD, halfway).astype(np.float64, copy=False)
        # What was put in is not to be rounded to the precision of the factors.
        solution[self._analysis.interface] = halfway[self._analysis.interface]
        return solution


class _Analysis:
    """The pattern of a matrix, analysed for factors of all unknowns or all but some: for one factor at a time."""

    def __init__(self, upper: sparse.csr_matrix, interface: Integers, precision: type[np.floating[Any]]) -> None:
        self.call, self.interface = _Call(upper, precision), interface
        if interface.size:
            self.call.order = np.zeros(self.call.size, dtype=np.int32)
            self.call.order[interface] = 1
            self.call.settings[_SCHUR] = _RETURN_SCHUR_KEEP_FACTORS
            # With a Schur complement, substitutions use several threads only so (measured).
            self.call.settings[_PARALLEL] = _TWO_LEVELS
        self.user: Callable[[], PardisoFactor | None] = lambda: None
        none = np.zeros(self.call.size)
        weakref.finalize(self, self.call.release, _RELEASE)
        self.call(_ANALYSE, none)
        sizes = self.call.settings
        self.bytes = 1024 * int(max(sizes[_PEAK], sizes[_PERMANENT] + sizes[_FACTORS]))

    def takes(self, upper: sparse.csr_matrix, interface: Integers) -> bool:
        """Take the values of another upper triangle; tell whether that was possible."""
        return self.user() is None and np.array_equal(interface, self.interface) and self.call.takes(upper)


class _Call:
    """One matrix, by its upper triangle, with its handle inside MKL, and the call that takes both.

    pypardiso's own ``solve`` copies and hashes the matrix at every call; here its arrays are kept.
    """

    def __init__(self, upper: sparse.csr_matrix, precision: type[np.floating[Any]]) -> None:
        self._function, threads, self._set_threads = _mkl_pardiso()
        # Substitutions with more or fewer threads than the factors were made with give wrong numbers, without an error.
        self._threads = threads()
        self._handle, self.settings = np.zeros(64, dtype=np.int64), np.zeros(64, dtype=np.int32)
        self.order = np.zeros(0, dtype=np.int32)
        self.settings[0] = 1  # the settings that follow count
        self.settings[1] = 2  # nested dissection
        self.size, self._released = upper.shape[0], False
        self.settings[_SINGLE_PRECISION] = precision is np.float32
        self._values = np.array(upper.data, dtype=precision)
        self._rows = np.ascontiguousarray(upper.indptr + 1, dtype=np.int32)
        self._columns = np.ascontiguousarray(upper.indices + 1, dtype=np.int32)
        unity, zero, kind, size = (ctypes.byref(ctypes.c_int32(value)) for value in (1, 0, _SPD, self.size))
        # Converting an argument takes a microsecond: what stays the same is converted once.
        self._start = (self._handle.ctypes.data, unity, unity, kind)
        self._matrix = (size, *(array.ctypes.data for array in (self._values, self._rows, self._columns)))
        self._rest = (self.settings.ctypes.data, zero)

    def takes(self, upper: sparse.csr_matrix) -> bool:
        """Take the values of another upper triangle; tell whether its pattern is the same."""
        starts, columns = self._rows - 1, self._columns - 1
        if not (np.array_equal(starts, upper.indptr) and np.array_equal(columns, upper.indices)):
            return False
        self._values[:] = upper.data
        return True

    def release(self, phase: int) -> None:
        """Release the factors, or with them the analysis, after which there is nothing to release."""
        # Both may end together, in any order.
        if not self._released:
            self._released = phase == _RELEASE
            self(phase, np.zeros(self.size))

    def __call__(self, phase: int, right: Floats, out: NDArray[Any] | None = None) -> NDArray[Any]:
        right = np.asfortranarray(right, dtype=self._values.dtype)
        out = np.empty_like(right, order="F") if out is None else out
        # MKL takes no columns for too little memory.
        if not right.size:
            return out
        error, sides = ctypes.c_int32(0), 1 if right.ndim == 1 else right.shape[1]
        before = self._set_threads(self._threads)
        self._function(
            *self._start,
            ctypes.byref(ctypes.c_int32(phase)),
            *self._matrix,
            self.order.ctypes.data,
            ctypes.byref(ctypes.c_int32(sides)),
            *self._rest,
            right.ctypes.data,
            out.ctypes.data,
            ctypes.byref(error),
        )
        self._set_threads(before)
        if error.value:
            reason = "memory ran out" if error.value == _OUT_OF_MEMORY else _NOT_DEFINITE
            raise FingerslipError(f"MKL PARDISO: error {error.value} in phase {phase}; {reason}")
        return out


@functools.cache
def _mkl_pardiso() -> tuple[Any, Callable[[], int], Callable[[int], int]]:
    """Return MKL's function, whose arguments are all addresses, and what tells and sets the threads of the caller."""
    # The library's own signature takes no plain numbers as addresses, and casts leave cycles to the garbage collector.
    function = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * _ARGUMENTS)
    library = _mkl()
    return function(("pardiso", library)), library.MKL_Get_Max_Threads, library.MKL_Set_Num_Threads_Local


def _mkl() -> ctypes.CDLL:
    """Load MKL as its package lists it; pypardiso searches the whole environment for it, which takes a second."""
    os.environ.setdefault(*_SPIN)
    with contextlib.suppress(metadata.PackageNotFoundError):
        for file in metadata.files("mkl") or ():
            if "mkl_rt" in file.name and Path(file.locate()).is_file():
                return ctypes.CDLL(str(file.locate()))
    import pypardiso

    library: ctypes.CDLL = pypardiso.PyPardisoSolver(mtype=_SPD).libmkl
    return library
