"""Condense a time step onto the contact nodes: one substitution, with the contact problem in its middle.

With the effective matrix A = L U, loads b, contact operator B (local displacements of the candidates) and
weight w of the contact forces, the acceleration of a step is a = A^-1 (b + w B^T r). Its local part without
contact forces, B A^-1 b = Z^T y with y = L^-1 b and Z = U^-T B^T, is known after the forward half of the
substitution. The contact problem then gives r, the halfway vector becomes y + w Y r with Y = L^-1 B^T, and
the backward half gives the acceleration. Z and Y are computed once; with Cholesky factors they are the same
and sparse, because a column fills only along its path through the elimination tree.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.dynamics.factor import Factor, factorise

__all__ = ["Condensed", "condense", "condensed_solve"]

Array = NDArray[np.float64]

_COLUMNS_AT_ONCE = 256
_SPARSE_BELOW = 0.25


@dataclass(frozen=True)
class Condensed:
    """A factorised effective matrix, condensed onto contact rows.

    Parameters
    ----------
    factor : Factor
        The factorised matrix A, shape (n, n).
    forward_columns : (n, m) matrix
        Y = L^-1 B^T, dense or sparse.
    backward_rows : (m, n) matrix
        Z^T with Z = U^-T B^T, dense or sparse.
    compliance : (m, m) array
        B A^-1 B^T.
    """

    factor: Factor
    forward_columns: Array | sparse.csr_matrix
    backward_rows: Array | sparse.csr_matrix
    compliance: Array


def condense(matrix: sparse.csr_matrix, local: sparse.csr_matrix) -> Condensed:
    """Factorise `matrix` (n, n), symmetric positive definite, and condense it onto the rows of `local` (m, n)."""
    factor = factorise(matrix)
    columns = sparse.csc_matrix(local.T)
    forward = _map_columns(factor.forward, columns)
    backward = _map_columns(factor.transposed_backward, columns)
    compliance = np.asarray((backward.T @ forward).todense()) if local.shape[0] else np.zeros((0, 0))
    return Condensed(
        factor=factor,
        forward_columns=_denser(forward.tocsr()),
        backward_rows=_denser(backward.T.tocsr()),
        compliance=0.5 * (compliance + compliance.T),
    )


def condensed_solve(
    condensed: Condensed, right_hand_side: Array, weight: float, contact: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Solve A a = b + w B^T r with one substitution, r being found by `contact` in between.

    Parameters
    ----------
    condensed : Condensed
        The factorised matrix.
    right_hand_side : (n,) array
        b.
    weight : float
        w.
    contact : callable
        Takes the local part B A^-1 b, shape (m,), and returns the contact forces r, shape (m,).

    Returns
    -------
    solution : (n,) array
        a.
    forces : (m,) array
        r.
    """
    halfway = condensed.factor.forward(right_hand_side)
    forces = contact(condensed.backward_rows @ halfway)
    if forces.any():
        halfway = halfway + weight * (condensed.forward_columns @ forces)
    return condensed.factor.backward(halfway), forces


def _map_columns(function: Callable[[Array], Array], columns: sparse.csc_matrix) -> sparse.csc_matrix:
    """Apply a half substitution to sparse columns, some at a time so that memory stays small."""
    parts = [
        sparse.csc_matrix(function(np.asfortranarray(columns[:, start : start + _COLUMNS_AT_ONCE].toarray())))
        for start in range(0, columns.shape[1], _COLUMNS_AT_ONCE)
    ]
    return sparse.hstack(parts, format="csc") if parts else columns


def _denser(matrix: sparse.csr_matrix) -> Array | sparse.csr_matrix:
    """Store a matrix densely where it is not sparse enough to gain by it."""
    size = matrix.shape[0] * matrix.shape[1]
    if size and matrix.nnz > _SPARSE_BELOW * size:
        return np.ascontiguousarray(matrix.toarray())
    return matrix
