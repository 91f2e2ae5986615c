"""Condense a time step onto the contact nodes: a substitution with the contact problem in its middle.

With the effective matrix A = L U, loads b, the contact operator B (local displacements of the candidates) and the
weighted contact forces r, the unknown of a step is x = A^-1 (b + B^T r). Its local part without contact forces,
B A^-1 b, and the compliance B A^-1 B^T make the contact problem, which gives r.

Only the unknowns on which the contact does not depend are factorised; the others are kept, with C, the inverse of their
Schur complement, which is their part of A^-1. The forward half leaves the right-hand side c of the Schur complement.
B C c is the local part without contact forces, C (c + B^T r) the solution at the kept unknowns, and the backward half
gives all others.

These factors may be of single precision, and C with them. The right-hand side at the kept unknowns, against which
contact forces nearly cancel, does not go through the factors. C serves contact and solution alike, entry by entry, and
multiplies in double precision: so the contact law holds to double precision, and what is rounded is as small as what a
step changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats, Integers, Reals
from fingerslip.linear.resources import require_memory, single_dense_thread
from fingerslip.linear.solver import LinearSolver, SchurFactor, factorise_around
from fingerslip.linear.symmetric import symmetric_product

# Contact rows times unknowns up to which the memory is not asked.
_SMALL = 6_000_000
# Sizes of the compliance that exist at once: itself, on the contact rows, and the working sets in single precision.
_COPIES = 3


@dataclass(frozen=True)
class Halfway:
    """A substitution between its halves; k right-hand sides are columns."""

    vector: Floats  # (n,), the forward half
    local: Floats  # (m,), local part of the solution without contact forces, B A^-1 b
    kept: Floats | None = None  # (p,), the solution at the kept unknowns without contact forces, where there are any


class Condensed(Protocol):
    """A factorised effective matrix, condensed onto contact rows."""

    @property
    def description(self) -> str:
        """How it is condensed, and what a step costs."""

    def forward(self, right_hand_side: Floats) -> Halfway:
        """Take the forward half for a right-hand side b, shape (n,) or (n, k) [N]."""

    def backward(self, halfway: Halfway, forces: Floats, moved: Floats | None = None) -> Floats:
        """Return x of A x = b + B^T r from the forward half; a known `moved`, B A^-1 B^T r, saves a product."""


@dataclass(frozen=True)
class BySchur:
    """Condensed by the Schur complement: two products with a matrix of the contact's size beside the substitution."""

    factor: SchurFactor  # factors of all unknowns but the kept ones
    kept: Integers  # (p,), the unknowns that the local displacements depend on
    inverse: Reals  # (p, p), C, symmetric, in the precision of the factors
    rows: sparse.csr_matrix | None  # B on the kept unknowns

    @property
    def description(self) -> str:
        """How it is condensed, and what a step costs."""
        substitutions = "one substitution" if self.factor.substitutions == 1 else "two substitutions"
        precision = " in single precision" if self.factor.is_single else ""
        return f"Schur complement, {substitutions} a step{precision}"

    def forward(self, right_hand_side: Floats) -> Halfway:
        """Take the forward half for b, shape (n,) or (n, k) [N]; see :class:`Condensed`."""
        vector_copy = right_hand_side.copy(order="K")
        vector_copy[self.kept] = 0.0
        # Nothing comes from forces on the kept unknowns alone.
        vector = self.factor.forward(vector_copy) if vector_copy.any() else vector_copy
        vector[self.kept] += right_hand_side[self.kept]
        interface = symmetric_product(self.inverse, vector[self.kept])
        return Halfway(vector, interface if self.rows is None else self.rows @ interface, interface)

    def backward(self, halfway: Halfway, forces: Floats, moved: Floats | None = None) -> Floats:
        """Return x for contact forces r, shape (m,) or (m, k) [N]; see :class:`Condensed`."""
        vector = halfway.vector.copy(order="K")
        if moved is not None and self.rows is None:
            vector[self.kept] = halfway.local + moved
        elif forces.any():
            added = forces if self.rows is None else self.rows.T @ forces
            vector[self.kept] = symmetric_product(self.inverse, vector[self.kept] + added)
        else:
            vector[self.kept] = halfway.kept
        return self.factor.backward(vector)


def condense(
    matrix: sparse.csr_matrix, local: sparse.csr_matrix, solver: LinearSolver, reserved_bytes: int = 0
) -> tuple[BySchur, Reals]:
    """Factorise and condense a matrix (n, n) for local displacements (m, n); also return their compliance (m, m)."""
    interface = np.unique(local.indices).astype(np.int64)
    if local.shape[0] * matrix.shape[0] > _SMALL:
        dense = 8 * max(local.shape[0], interface.size) ** 2
        # One analysis tells the memory and serves the factors.
        solver = solver.series()
        factors = solver.bytes_around(matrix, interface)
        require_memory({"factors": factors, "compliance": _COPIES * dense, "history": reserved_bytes})
    # Threads of OpenBLAS spin while they wait: beside other work two take up to ten times the CPU time of one.
    with single_dense_thread():
        factor, inverse = factorise_around(matrix, interface, solver)
    rows = sparse.csr_matrix(local[:, interface])
    identity = sparse.identity(interface.size, format="csr")
    if rows.shape == identity.shape and (rows != identity).nnz == 0:
        return BySchur(factor, interface, inverse, None), inverse
    return BySchur(factor, interface, inverse, rows), np.ascontiguousarray(rows @ (rows @ inverse).T)
