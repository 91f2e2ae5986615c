"""Factorise a sparse symmetric positive definite matrix once, and substitute many times.

A factorisation gives two half substitutions, *forward* and *backward*, one after the other a solve.
Between the halves the contact forces are found (see :mod:`fingerslip.dynamics.condensation`), so that a
time step costs one substitution. MKL PARDISO does this where it is installed; SuperLU, which comes with
SciPy, everywhere else.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from fingerslip.dynamics.pardiso import PardisoFactor, pardiso_available, pardiso_bytes, pardiso_schur
from fingerslip.dynamics.superlu import SuperLUFactor, superlu_bytes, superlu_schur
from fingerslip.errors import FingerslipError

__all__ = [
    "Factor",
    "PardisoFactor",
    "SuperLUFactor",
    "factor_bytes",
    "factorise",
    "inverse_block",
    "pardiso_available",
]

Array = NDArray[np.float64]

_MIRRORED_AT_ONCE = 512


class Factor(Protocol):
    """A factorised matrix A = L U with its two half substitutions; for n unknowns and k columns."""

    name: str

    def forward(self, right_hand_side: Array) -> Array:
        """Return y = L^-1 b; shapes (n,) or (n, k)."""

    def backward(self, halfway: Array) -> Array:
        """Return x = U^-1 y; shapes (n,) or (n, k)."""

    def transposed_backward(self, right_hand_side: Array) -> Array:
        """Return z = U^-T b, so that b . x = z . y; equals `forward` where U is the transpose of L."""


def factorise(matrix: sparse.csr_matrix) -> Factor:
    """Factorise with the fastest solver that is installed.

    Parameters
    ----------
    matrix : scipy.sparse.csr_matrix
        Symmetric positive definite, shape (n, n).
    """
    return PardisoFactor(matrix) if pardiso_available() else SuperLUFactor(matrix)


def inverse_block(matrix: sparse.csr_matrix, places: NDArray[np.int64]) -> Array:
    """Return the part of A^-1 among some unknowns, as the inverse of A's Schur complement on them.

    Parameters
    ----------
    matrix : scipy.sparse.csr_matrix
        A, symmetric positive definite, shape (n, n).
    places : (m,) array
        The unknowns, ascending.

    Returns
    -------
    (m, m) array
        Exactly symmetric. For thousands of unknowns this is many times quicker than solving for the columns.
    """
    schur = pardiso_schur(matrix, places) if pardiso_available() else superlu_schur(matrix, places)
    return _inverted(schur)


def factor_bytes(matrix: sparse.csr_matrix, places: NDArray[np.int64]) -> tuple[int, int]:
    """Return the memory that `factorise` and `inverse_block` need [bytes], before they take it."""
    return pardiso_bytes(matrix, places) if pardiso_available() else superlu_bytes(matrix, places)


def _inverted(matrix: Array) -> Array:
    """Invert a symmetric positive definite matrix in its own memory."""
    # LAPACK works on columns; the transpose is the same matrix in that order.
    lower, failed = linalg.lapack.dpotrf(matrix.T, lower=1, overwrite_a=1)
    if failed:
        raise FingerslipError("the Schur complement on the contact nodes is not positive definite")
    inverse: Array = linalg.lapack.dpotri(lower, lower=1, overwrite_c=1)[0]
    for start in range(0, len(inverse), _MIRRORED_AT_ONCE):
        end = start + _MIRRORED_AT_ONCE
        inverse[start:end, end:] = inverse[end:, start:end].T
        block = inverse[start:end, start:end]
        block[:] = np.tril(block) + np.tril(block, -1).T
    return inverse.T
