"""The contact problem in the plane, piece by piece.

In the plane the conditions of :mod:`fingerslip.contact.solve.newton` are linear as long as no node changes its state ::

    open     r_n = 0,  r_t = 0
    stick    y_n = 0,  y_t = 0
    slip     y_n = 0,  r_t = g r_n    with the slope g = mu or -mu

A full step of Newton's method solves the *piece* that the trial forces are in. What remains unknown are the normal
forces of the touching nodes and the tangential ones of those that stick. The matrix of a piece is factorised once, and
serves until a node changes its state, in later time steps too. A step begins with the solution in the piece in which
the last one ended: where no node changes its state, that is all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.compliance import active_product
from fingerslip.contact.solve.dense import DenseFactor, factorise_dense
from fingerslip.contact.solve.line_search import NEWTON_LIMIT, SEARCH_LIMIT, decreases_enough
from fingerslip.contact.solve.newton import ContactSolution, solve_friction
from fingerslip.contact.solve.projection import step_lengths
from fingerslip.contact.states import OPEN, SLIP, STICK

__all__ = ["Piece", "solve_by_pieces"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Piece:
    """A state of every node, with the factors of its matrix.

    Parameters
    ----------
    compliance : (n_c * 2, n_c * 2) array
        W that the matrix is made of [m/N].
    scale : (n_c, 2) array
        Step lengths rho of the projection [N/m].
    states : (n_c,) array of int
        :data:`~fingerslip.contact.states.OPEN`, STICK or SLIP.
    slopes : (n_c,) array
        Tangential over normal force of the nodes that slip [-], else zero.
    unknowns : (k,) array
        Components among n_c * 2 that the piece leaves unknown.
    factor : DenseFactor
        Factors of its matrix.
    forces, product : (n_c, 2) array
        Forces of the last time step [N], and W times them [m].
    """

    compliance: Array
    scale: Array
    states: NDArray[np.int8]
    slopes: Array
    unknowns: NDArray[np.int64]
    factor: DenseFactor[np.float64]
    forces: Array
    product: Array


def solve_by_pieces(
    compliance: Array,
    free: Array,
    friction_coefficient: Array,
    start: Array,
    tolerance: float,
    *,
    piece: Piece | None = None,
) -> tuple[ContactSolution, Piece | None]:
    """Find the contact forces of one step in the plane.

    Steps are halved until they bring the forces nearer to a solution. Where none does, :func:`solve_friction` takes
    over.

    Parameters
    ----------
    compliance : (n_c * 2, n_c * 2) array
        W, symmetric positive definite, node by node with the normal first [m/N].
    free : (n_c, 2) array
        q, the gap and slip without contact forces [m].
    friction_coefficient : (n_c,) array
        Friction coefficients [-].
    start : (n_c, 2) array
        First guess of the forces, best those of the last step [N].
    tolerance : float
        Relative residual at which to stop [-].
    piece : Piece, optional
        The piece in which the last step ended.

    Returns
    -------
    solution : ContactSolution
        The best forces found; the caller compares `residual` with the tolerance.
    piece : Piece or None
        The last piece that was solved, for the next step.

    Examples
    --------
    A node pressed by 1 um into a penalty of 1 N/um slips when it is pulled by 5 um; pulled on, it stays in this piece:

    >>> given = np.eye(2), np.array([[-1.0, 5.0]]), np.array([0.5]), np.zeros((1, 2)), 1e-12
    >>> slipped, piece = solve_by_pieces(*given)
    >>> further, same = solve_by_pieces(np.eye(2), np.array([[-1.0, 6.0]]), *given[2:4], 1e-12, piece=piece)
    >>> slipped.forces.tolist(), further.forces.tolist(), piece.slopes.tolist()
    ([[1.0, -0.5]], [[1.0, -0.5]], [-0.5])
    """
    if not free.size:
        return solve_friction(compliance, free, friction_coefficient, start, tolerance), None
    piece = piece if piece is not None and piece.compliance is compliance else None
    problem = _problem(compliance, free, friction_coefficient, piece)
    found, begun = _first(problem, start, piece, tolerance)
    for iteration in range(begun, NEWTON_LIMIT):
        if found.relative_residual <= tolerance:
            return found.solution(iteration), piece and replace(piece, forces=found.forces, product=found.product)
        piece = piece if piece is not None and found.is_in(piece) else _factorised(problem, found)
        nearer = _search(problem, found, *_solve_piece(problem, piece))
        if nearer is None:
            break
        found = nearer
    solution = solve_friction(compliance, free, friction_coefficient, found.forces, tolerance)
    return replace(solution, iterations=iteration + solution.iterations), piece


@dataclass(frozen=True)
class _Problem:
    """The contact problem, with the step lengths of its projection and the scale of rounding [N]."""

    compliance: Array
    free: Array
    friction: Array
    scale: Array
    least: float


@dataclass(frozen=True)
class _Look:
    """Forces, the piece that their trial forces are in, and their residual: its sum of squares, its largest node."""

    forces: Array
    product: Array
    states: NDArray[np.int8]
    slopes: Array
    merit: float
    relative_residual: float
    worst: int

    def is_in(self, piece: Piece) -> bool:
        same = self.states.tobytes() == piece.states.tobytes()
        return same and self.slopes.tobytes() == piece.slopes.tobytes()

    def solution(self, iterations: int) -> ContactSolution:
        return ContactSolution(self.forces, self.relative_residual, iterations, self.worst)


def _problem(compliance: Array, free: Array, friction: Array, piece: Piece | None) -> _Problem:
    scale = step_lengths(np.diag(compliance).reshape(free.shape)) if piece is None else piece.scale
    # As in the compiled solver, the force that would undo the worst free penetration alone sets the scale of rounding.
    return _Problem(compliance, free, friction, scale, 1e-12 * float(np.max(scale * np.abs(free))))


def _first(problem: _Problem, start: Array, piece: Piece | None, tolerance: float) -> tuple[_Look, int]:
    """Return the forces to begin with, and the iterations that they took.

    These are the last step's, or the solution in the last step's piece where that is nearer to a solution.
    """
    found = _look(problem, start, _product(problem, start, piece))
    if piece is None or found.relative_residual <= tolerance:
        return found, 0
    solved = _look(problem, *_solve_piece(problem, piece))
    return (solved, 1) if decreases_enough(solved.merit, found.merit, 1.0) else (found, 0)


def _product(problem: _Problem, forces: Array, piece: Piece | None) -> Array:
    """Return W times the forces (n_c, 2) [m]; after a step it is known."""
    if piece is not None and piece.forces is forces:
        return piece.product
    product: Array = active_product(problem.compliance, forces)
    return product


def _look(problem: _Problem, forces: Array, product: Array) -> _Look:
    given = problem.free, problem.scale, problem.friction
    states, slopes, merit, largest, worst, force = _examine(forces, product, *given)
    size = max(problem.least, force)
    return _Look(forces, product, states, slopes, merit, largest / size if largest > 0.0 else largest, worst)


def _factorised(problem: _Problem, found: _Look) -> Piece:
    matrix, unknowns = _matrix(problem.compliance, found.states, found.slopes)
    states, slopes, factor = found.states, found.slopes, factorise_dense(matrix)
    return Piece(problem.compliance, problem.scale, states, slopes, unknowns, factor, found.forces, found.product)


def _solve_piece(problem: _Problem, piece: Piece) -> tuple[Array, Array]:
    """Return the solution of a piece, forces (n_c, 2) [N], and W times it [m]."""
    forces = np.zeros_like(problem.free)
    forces.reshape(-1)[piece.unknowns] = piece.factor.solve(-problem.free.reshape(-1)[piece.unknowns])
    forces[:, 1] += piece.slopes * forces[:, 0]
    return forces, active_product(problem.compliance, forces)


def _search(problem: _Problem, found: _Look, solved: Array, product: Array) -> _Look | None:
    """Return forces on the way to the solution (n_c, 2) [N] of a piece that are nearer to a solution; None without."""
    length, nearer = 1.0, _look(problem, solved, product)
    for _ in range(SEARCH_LIMIT):
        if decreases_enough(nearer.merit, found.merit, length):
            return nearer
        length *= 0.5
        forces = found.forces + length * (solved - found.forces)
        nearer = _look(problem, forces, found.product + length * (product - found.product))
    return None


@numba.njit(cache=True, nogil=True)
def _examine(forces, product, free, scale, friction):  # type: ignore[no-untyped-def]
    """Return states and slopes of the trial forces' piece; the residual's square, its largest, where; largest force."""
    count = len(forces)
    states, slopes = np.zeros(count, dtype=np.int8), np.zeros(count)
    merit, largest, worst, force = 0.0, -1.0, 0, 0.0
    for i in range(count):
        normal = forces[i, 0] - scale[i, 0] * (product[i, 0] + free[i, 0])
        tangential = forces[i, 1] - scale[i, 1] * (product[i, 1] + free[i, 1])
        if normal <= 0.0:
            normal = tangential = 0.0
        elif np.abs(tangential) <= friction[i] * normal:
            states[i] = STICK
        else:
            states[i], slopes[i] = SLIP, np.copysign(friction[i], tangential)
            tangential = slopes[i] * normal
        force = max(force, np.abs(forces[i, 0]), np.abs(forces[i, 1]))
        distance = max(np.abs(forces[i, 0] - normal), np.abs(forces[i, 1] - tangential))
        merit += (forces[i, 0] - normal) ** 2 + (forces[i, 1] - tangential) ** 2
        if distance > largest:
            largest, worst = distance, i
    # A sum that is no number is a residual that is none.
    return states, slopes, merit, (merit if np.isnan(merit) else largest), worst, force


@numba.njit(cache=True, nogil=True)
def _matrix(compliance, states, slopes):  # type: ignore[no-untyped-def]
    """Return the matrix of a piece [m/N], and its unknowns among the components of all nodes."""
    unknowns = np.empty(2 * states.size, dtype=np.int64)
    size = 0
    for i in range(states.size):
        for k in range(2 if states[i] == STICK else 1 if states[i] != OPEN else 0):
            unknowns[size] = 2 * i + k
            size += 1
    unknowns = unknowns[:size].copy()
    matrix = np.empty((size, size))
    for a in range(size):
        row = compliance[unknowns[a]]
        for b in range(size):
            matrix[a, b] = row[unknowns[b]]
            # Columns of nodes that slip: their tangential forces follow their normal ones.
            if slopes[unknowns[b] // 2] != 0.0:
                matrix[a, b] += slopes[unknowns[b] // 2] * row[unknowns[b] + 1]
    return matrix, unknowns
