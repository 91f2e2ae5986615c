"""Condense a time step onto the contact nodes: substitutions, with the contact problem in their middle.

With the effective matrix A = L U, loads b, contact operator B (local displacements of the candidates) and
weight w of the contact forces, the acceleration of a step is a = A^-1 (b + w B^T r). Its local part without
contact forces, B A^-1 b, and the compliance B A^-1 B^T make the contact problem, which gives r.

*By columns.* Z = U^-T B^T and Y = L^-1 B^T are computed once. The local part Z^T y is known after the forward
half of the substitution, y = L^-1 b; the halfway vector becomes y + w Y r, and the backward half gives the
acceleration. With Cholesky factors Y and Z are the same and sparse, because a column fills only along its path
through the elimination tree.

*By the Schur complement.* For many contact rows these columns are larger than the factors. Then only the unknowns
that the contact does not depend on are factorised, and C, the inverse of the Schur complement on the others, is
stored: it is their part of A^-1. The forward half leaves the right-hand side c of the Schur complement; B C c is
the local part without contact forces, C (c + w B^T r) what the contact's own unknowns become, and the backward half
gives all others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import blas

from fingerslip.linear.factorisation import Factor, SchurFactor, factorise, factorise_around, schur_bytes
from fingerslip.linear.memory import require_memory

__all__ = ["ByColumns", "BySchur", "Condensed", "condense"]

Array = NDArray[np.float64]
Contact = Callable[[Array], Array]

_COLUMNS_AT_ONCE = 256
_SPARSE_BELOW = 0.25
# Size m n of the columns up to which they are quicker than the Schur complement (measured): in the plane, where
# rows of A are shorter and columns fill less, this many times larger.
_COLUMNS_UP_TO, _IN_PLANE = 6_000_000, 12
_ROW_IN_PLANE = 30
# How often the compliance is there at most: as it is, turned into frames, and what Newton's method takes of it.
_COPIES = 5


class Condensed(Protocol):
    """A factorised effective matrix, condensed onto contact rows."""

    @property
    def solver(self) -> str:
        """Name of the library that factorised."""

    @property
    def description(self) -> str:
        """How it is condensed, and what a step costs."""

    def solve(self, right_hand_side: Array, weight: float, contact: Contact) -> tuple[Array, Array]:
        """Solve A a = b + w B^T r, r being found by `contact` on the way.

        Parameters
        ----------
        right_hand_side : (n,) or (n, k) array
            b.
        weight : float
            w.
        contact : callable
            Takes the local part B A^-1 b, shape (m,) or (m, k), and returns the contact forces r of the same shape.

        Returns
        -------
        solution : (n,) or (n, k) array
            a.
        forces : (m,) or (m, k) array
            r.
        """


@dataclass(frozen=True)
class ByColumns:
    """Condensed by columns: one substitution.

    Parameters
    ----------
    factor : Factor
        The factorised matrix A, shape (n, n).
    forward_columns : (n, m) matrix
        Y = L^-1 B^T, dense or sparse.
    backward_rows : (m, n) matrix
        Z^T with Z = U^-T B^T, dense or sparse.
    """

    factor: Factor
    forward_columns: Array | sparse.csr_matrix
    backward_rows: Array | sparse.csr_matrix
    description = "columns, one substitution a step"

    @property
    def solver(self) -> str:
        """Name of the library that factorised."""
        return self.factor.name

    def solve(self, right_hand_side: Array, weight: float, contact: Contact) -> tuple[Array, Array]:
        """Solve with one substitution; see :class:`Condensed`."""
        halfway = self.factor.forward(right_hand_side)
        forces = contact(self.backward_rows @ halfway)
        if forces.any():
            halfway = halfway + weight * (self.forward_columns @ forces)
        return self.factor.backward(halfway), forces


@dataclass(frozen=True)
class BySchur:
    """Condensed by the Schur complement: one substitution, and two products with a matrix of the contact's size.

    Parameters
    ----------
    factor : SchurFactor
        Of all unknowns but those that the local displacements depend on.
    places : (p,) array
        These.
    inverse : (p, p) array
        C, symmetric.
    rows : sparse matrix, shape (m, p), or None
        B on them; None where it is the identity.
    """

    factor: SchurFactor
    places: NDArray[np.int64]
    inverse: Array
    rows: sparse.csr_matrix | None

    @property
    def solver(self) -> str:
        """Name of the library that factorised."""
        return self.factor.name

    @property
    def description(self) -> str:
        """How it is condensed, and what a step costs."""
        substitutions = "one substitution" if self.factor.substitutions == 1 else "two substitutions"
        return f"Schur complement, {substitutions} a step"

    def solve(self, right_hand_side: Array, weight: float, contact: Contact) -> tuple[Array, Array]:
        """Solve with one substitution; see :class:`Condensed`."""
        halfway = self.factor.forward(right_hand_side)
        condensed = halfway[self.places]
        solution = _symmetric_times(self.inverse, condensed)
        forces = contact(solution if self.rows is None else self.rows @ solution)
        if forces.any():
            given = forces if self.rows is None else self.rows.T @ forces
            solution = _symmetric_times(self.inverse, condensed + weight * given)
        halfway[self.places] = solution
        return self.factor.backward(halfway), forces


def _symmetric_times(matrix: Array, given: Array) -> Array:
    """Return the product of a symmetric matrix with a vector, of which half is read, or with columns."""
    product: Array = blas.dsymv(1.0, matrix.T, given) if given.ndim == 1 else matrix @ given
    return product


def condense(matrix: sparse.csr_matrix, local: sparse.csr_matrix, later: int = 0) -> tuple[Condensed, Array]:
    """Factorise and condense a matrix.

    Parameters
    ----------
    matrix : (n, n) matrix
        A, symmetric positive definite.
    local : (m, n) matrix
        B.
    later : int, optional
        Memory that the histories will take [bytes].

    Returns
    -------
    condensed : Condensed
        What solves.
    compliance : (m, m) array
        B A^-1 B^T. `condensed` may need it unchanged.

    Raises
    ------
    InputError
        Where the memory will not suffice.
    """
    largest = _COLUMNS_UP_TO * (_IN_PLANE if matrix.nnz < _ROW_IN_PLANE * matrix.shape[0] else 1)
    if local.shape[0] * matrix.shape[0] <= largest:
        return _condense_by_columns(matrix, local)
    return _condense_by_schur(matrix, local, later)


def _condense_by_columns(matrix: sparse.csr_matrix, local: sparse.csr_matrix) -> tuple[Condensed, Array]:
    factor = factorise(matrix)
    columns = sparse.csc_matrix(local.T)
    forward = _map_columns(factor.forward, columns)
    backward = _map_columns(factor.transposed_backward, columns)
    compliance = np.asarray((backward.T @ forward).todense()) if local.shape[0] else np.zeros((0, 0))
    condensed = ByColumns(factor, _denser(forward.tocsr()), _denser(backward.T.tocsr()))
    return condensed, 0.5 * (compliance + compliance.T)


def _condense_by_schur(matrix: sparse.csr_matrix, local: sparse.csr_matrix, later: int) -> tuple[Condensed, Array]:
    """Take the compliance from the Schur complement on all unknowns that the local displacements depend on."""
    places = np.unique(local.indices).astype(np.int64)
    dense = 8 * max(local.shape[0], places.size) ** 2
    require_memory({"factors": schur_bytes(matrix, places), "compliance": _COPIES * dense, "history": later})
    factor, inverse = factorise_around(matrix, places)
    rows = sparse.csr_matrix(local[:, places])
    identity = sparse.identity(places.size, format="csr")
    if rows.shape == identity.shape and (rows != identity).nnz == 0:
        return BySchur(factor, places, inverse, None), inverse
    return BySchur(factor, places, inverse, rows), np.ascontiguousarray(rows @ (rows @ inverse).T)


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
