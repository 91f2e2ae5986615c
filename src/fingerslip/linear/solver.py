"""What a linear solver has to offer, and which one is taken.

A sparse symmetric positive definite matrix A = L U is factorised once. Its factors give two half substitutions,
*forward* and *backward*, which make a solution one after the other. Between the halves the contact forces are found
(:mod:`fingerslip.dynamics.step.condensation`), so that a time step costs one substitution.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import Protocol

import numpy as np
from scipy import linalg, sparse

from fingerslip.arrays import Floats, Integers, Reals
from fingerslip.errors import FingerslipError
from fingerslip.linear import solvers

_MIRRORED_AT_ONCE, _COLUMNS_AT_ONCE = 512, 64


class Factor(Protocol):
    """A factorised matrix A = L U of n unknowns; all arrays have the shape (n,) or (n, k), in any unit."""

    def forward(self, right_hand_side: Floats) -> Floats:
        """Return y = L^-1 b."""

    def backward(self, halfway: Floats) -> Floats:
        """Return x = U^-1 y."""


class SchurFactor(Factor, Protocol):
    """A matrix of n unknowns factorised but for some, the kept ones.

    The forward half gives a new array that holds the right-hand side of the Schur complement at the kept unknowns. The
    backward half takes it with the solution there in its place.
    """

    @property
    def substitutions(self) -> int:
        """Full substitutions that a forward and a backward half cost together."""

    @property
    def is_single(self) -> bool:
        """Whether it is of single precision."""


class LinearSolver(Protocol):
    """A direct solver for sparse symmetric positive definite matrices (n, n).

    It raises :class:`~fingerslip.errors.FingerslipError` for a matrix that is not, and where memory runs out.
    """

    @property
    def name(self) -> str:
        """What histories and logs call it."""

    @property
    def preference(self) -> int:
        """Rank among the solvers: the available one with the highest is taken."""

    def is_available(self) -> bool:
        """Tell whether it can be used on this machine, and load it if so."""

    def series(self) -> LinearSolver:
        """Return a solver for matrices one after the other, which may keep what serves matrices of the same pattern.

        It is the solver itself where there is nothing to keep, and of a series.
        """

    def rough(self) -> LinearSolver:
        """Return a series whose factors around unknowns may be rough, as those of single precision are.

        They are for iterations and steps that correct what those before them missed. It is the solver itself where
        there are none.
        """

    def factorise(self, matrix: sparse.csr_matrix) -> Factor:
        """Factorise a matrix."""

    def factorise_around(self, matrix: sparse.csr_matrix, interface: Integers) -> tuple[SchurFactor, Reals]:
        """Factorise a matrix but for the ascending unknowns `interface` (m,); also return their Schur complement.

        The Schur complement (m, m) has the precision of the factors.
        """

    def bytes_around(self, matrix: sparse.csr_matrix, interface: Integers) -> int:
        """Return about how much memory :meth:`factorise_around` needs [bytes]."""


class InnerFactor:
    """A :class:`SchurFactor` that any solver can make: of the inner unknowns alone, so that each half is a solution.

    Arrays: interface (m,), the other unknowns, ascending.
    """

    substitutions = 2
    is_single = False

    def __init__(self, solver: LinearSolver, matrix: sparse.csr_matrix, interface: Integers) -> None:
        self._kept, self._inner = interface, np.setdiff1d(np.arange(matrix.shape[0]), interface)
        rows = sparse.csr_matrix(matrix[interface])
        self._at_interface, self._coupling = rows[:, interface].toarray(), sparse.csr_matrix(rows[:, self._inner])
        inner = sparse.csr_matrix(matrix[self._inner][:, self._inner])
        self._factor = solver.factorise(inner) if self._inner.size else None

    def forward(self, right_hand_side: Floats) -> Floats:
        """Return b with the right-hand side of the Schur complement at the interface; (n,) or (n, k)."""
        halfway = np.array(right_hand_side)
        if self._kept.size:
            halfway[self._kept] -= self._coupling @ self._solve(halfway[self._inner])
        return halfway

    def backward(self, halfway: Floats) -> Floats:
        """Return the solution from a forward half that holds the solution at the interface; (n,) or (n, k)."""
        solution = np.array(halfway)
        solution[self._inner] = self._solve(halfway[self._inner] - self._coupling.T @ halfway[self._kept])
        return solution

    def schur(self) -> Floats:
        """Return the Schur complement (m, m) on the interface, column by column: for few unknowns."""
        schur: Floats = self._at_interface.copy()
        for start in range(0, len(schur), _COLUMNS_AT_ONCE):
            some = slice(start, start + _COLUMNS_AT_ONCE)
            schur[:, some] -= self._coupling @ self._solve(self._coupling[some].T.toarray(order="F"))
        symmetric: Floats = 0.5 * (schur + schur.T)
        return symmetric

    def _solve(self, right_hand_side: Floats) -> Floats:
        factor = self._factor
        return right_hand_side if factor is None else factor.backward(factor.forward(right_hand_side))


def known_solvers() -> list[LinearSolver]:
    """Return the solvers of all modules in :mod:`fingerslip.linear.solvers`, the preferred ones first."""
    names = [module.name for module in pkgutil.iter_modules(solvers.__path__, f"{solvers.__name__}.")]
    result = [getattr(importlib.import_module(name), "SOLVER", None) for name in names]
    return sorted((solver for solver in result if solver is not None), key=lambda solver: -solver.preference)


def preferred_solver() -> LinearSolver:
    """Return the preferred solver that is available; SuperLU, which comes with SciPy, always is."""
    return next(solver for solver in known_solvers() if solver.is_available())


def factorise_around(
    matrix: sparse.csr_matrix, interface: Integers, solver: LinearSolver | None = None
) -> tuple[SchurFactor, Reals]:
    """Factorise a matrix (n, n) but for ascending unknowns `interface` (m,), and invert their Schur complement.

    The inverse (m, m) is the part of that of the matrix among these unknowns; exactly symmetric, in the precision of
    the factors. For thousands of unknowns this is many times faster than solving for its columns.
    """
    solver = solver or preferred_solver()
    if interface.size == matrix.shape[0]:
        return InnerFactor(solver, matrix, interface), _invert(matrix.toarray())
    factor, schur = solver.factorise_around(matrix, interface)
    return factor, _invert(schur) if interface.size else schur


def _invert(matrix: Reals) -> Reals:
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
