"""Factorise with the preferred solver, and invert Schur complements."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from fingerslip.errors import FingerslipError
from fingerslip.linear.solver import Factor, LinearSolver, SchurFactor, preferred_solver

__all__ = ["factorise", "factorise_around"]

Reals = NDArray[np.floating[Any]]

_MIRRORED_AT_ONCE = 512


def factorise(matrix: sparse.csr_matrix, solver: LinearSolver | None = None) -> Factor:
    """Factorise a matrix.

    Parameters
    ----------
    matrix : scipy.sparse.csr_matrix
        Symmetric positive definite, shape (n, n), of any unit.
    solver : LinearSolver, optional
        The solver; without it the preferred one that is available.
    """
    return (solver or preferred_solver()).factorise(matrix)


def factorise_around(
    matrix: sparse.csr_matrix, kept: NDArray[np.int64], solver: LinearSolver | None = None
) -> tuple[SchurFactor, Reals]:
    """Factorise a matrix but for some unknowns, and invert their Schur complement.

    Parameters
    ----------
    matrix : scipy.sparse.csr_matrix
        A, symmetric positive definite, shape (n, n), of any unit.
    kept : (m,) array
        The unknowns that are not factorised, ascending.
    solver : LinearSolver, optional
        The solver; without it the preferred one that is available.

    Returns
    -------
    factor : SchurFactor
        Factors of the others.
    inverse : (m, m) array
        The inverse of the Schur complement, which is the part of A^-1 among the kept unknowns; exactly symmetric, in
        the precision of the factors. For thousands of unknowns this is many times faster than solving for its columns.

    Raises
    ------
    FingerslipError
        For a matrix that is not positive definite.
    """
    factor, schur = (solver or preferred_solver()).factorise_around(matrix, kept)
    return factor, _inverted(schur)


def _inverted(matrix: Reals) -> Reals:
    """Invert a symmetric positive definite matrix (m, m) in its own memory."""
    # LAPACK works on columns; the transpose is the same matrix in that order.
    factorise, invert = linalg.get_lapack_funcs(("potrf", "potri"), (matrix,))
    lower, failed = factorise(matrix.T, lower=1, overwrite_a=1)
    if failed:
        raise FingerslipError("the Schur complement on the contact nodes is not positive definite")
    inverse: Reals = invert(lower, lower=1, overwrite_c=1)[0]
    for start in range(0, len(inverse), _MIRRORED_AT_ONCE):
        end = start + _MIRRORED_AT_ONCE
        inverse[start:end, end:] = inverse[end:, start:end].T
        block = inverse[start:end, start:end]
        block[:] = np.tril(block) + np.tril(block, -1).T
    return inverse.T
