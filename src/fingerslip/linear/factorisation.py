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

from fingerslip.errors import FingerslipError
from fingerslip.linear.pardiso import PardisoFactor, PardisoSchurFactor, pardiso_available, pardiso_schur_bytes
from fingerslip.linear.superlu import SuperLUFactor, SuperLUSchurFactor, superlu_schur_bytes

__all__ = [
    "Factor",
    "PardisoFactor",
    "PardisoSchurFactor",
    "SchurFactor",
    "SuperLUFactor",
    "SuperLUSchurFactor",
    "factorise",
    "factorise_around",
    "pardiso_available",
    "schur_bytes",
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


class SchurFactor(Protocol):
    """All unknowns factorised but those at some places; the places' own come in between the halves."""

    name: str
    substitutions: int

    def forward(self, right_hand_side: Array) -> Array:
        """Eliminate: return a vector that holds, at the places, the right-hand side of the Schur complement."""

    def backward(self, halfway: Array) -> Array:
        """Return the solution from a halfway vector that holds, at the places, the solution there."""


def factorise(matrix: sparse.csr_matrix) -> Factor:
    """Factorise with the fastest solver that is installed.

    Parameters
    ----------
    matrix : scipy.sparse.csr_matrix
        Symmetric positive definite, shape (n, n).
    """
    return PardisoFactor(matrix) if pardiso_available() else SuperLUFactor(matrix)


def factorise_around(matrix: sparse.csr_matrix, places: NDArray[np.int64]) -> tuple[SchurFactor, Array]:
    """Factorise all unknowns but some.

    Parameters
    ----------
    matrix : scipy.sparse.csr_matrix
        A, symmetric positive definite, shape (n, n).
    places : (m,) array
        The unknowns that are left, ascending.

    Returns
    -------
    factor : SchurFactor
        Eliminates the others, and substitutes what was found at the places.
    inverse : (m, m) array
        The inverse of the Schur complement, which is the part of A^-1 among the places; exactly symmetric. For
        thousands of unknowns this is many times quicker than solving for its columns.
    """
    schur = np.zeros((places.size, places.size))
    factor = (PardisoSchurFactor if pardiso_available() else SuperLUSchurFactor)(matrix, places, schur)
    return factor, _inverted(schur)


def schur_bytes(matrix: sparse.csr_matrix, places: NDArray[np.int64]) -> int:
    """Return the memory that `factorise_around` needs [bytes], before it takes it."""
    return (pardiso_schur_bytes if pardiso_available() else superlu_schur_bytes)(matrix, places)


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
