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
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.compliance import active_product
from fingerslip.contact.solve.dense import DenseFactor, factorise_dense, solve_factorised
from fingerslip.contact.solve.line_search import NEWTON_LIMIT, SEARCH_LIMIT, decreases_enough
from fingerslip.contact.solve.newton import ContactSolution, solve_friction
from fingerslip.contact.solve.projection import step_lengths
from fingerslip.contact.states import OPEN, SLIP, STICK

__all__ = ["Piece", "solve_by_pieces"]

Array = NDArray[np.float64]

# What comes of Newton's method in a piece: a solution, forces in another piece, or no step that helps.
_SOLVED, _ELSEWHERE, _STUCK = 0, 1, 2
_NO_PIECE = (
    np.zeros(0, dtype=np.int8),
    np.zeros(0),
    np.zeros(0, dtype=np.int64),
    np.zeros((0, 0)),
    np.zeros(0, dtype=np.int32),
)


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
    factor: DenseFactor
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
    scale = step_lengths(np.diag(compliance).reshape(free.shape)) if piece is None else piece.scale
    # After a step, W times its forces is known.
    product = piece.product if piece is not None and piece.forces is start else active_product(compliance, start)
    problem, factors = (compliance, free, friction_coefficient, scale, tolerance), _factors(piece)
    found = _newton(*problem, start, product, *factors, 0)
    while found[0] == _ELSEWHERE:
        _, iterations, forces, product, states, slopes, _, _ = found
        matrix, unknowns = _matrix(compliance, states, slopes)
        piece = Piece(compliance, scale, states, slopes, unknowns, factorise_dense(matrix), forces, product)
        found = _newton(*problem, forces, product, *_factors(piece), iterations)
    outcome, iterations, forces, product, _, _, residual, worst = found
    if outcome == _SOLVED:
        if piece is not None and piece.forces is not forces:
            known = piece.states, piece.slopes, piece.unknowns, piece.factor
            piece = Piece(compliance, scale, *known, forces, product)
        return ContactSolution(forces, residual, iterations, worst), piece
    solution = solve_friction(compliance, free, friction_coefficient, forces, tolerance)
    return replace(solution, iterations=iterations + solution.iterations), piece


def _factors(piece: Piece | None) -> tuple[Any, Any, Any, Any, Any]:
    """Return the arrays of a piece that its solution needs."""
    if piece is None:
        return _NO_PIECE
    return piece.states, piece.slopes, piece.unknowns, piece.factor.factors, piece.factor.pivots


@numba.njit(cache=True, nogil=True)
def _newton(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    compliance,
    free,
    friction,
    scale,
    tolerance,
    forces,
    product,
    of_states,
    of_slopes,
    unknowns,
    factors,
    pivots,
    taken,
):
    """Run Newton's method as long as it stays in a piece, from given forces (n_c, 2) [N] and W times them [m].

    Returns what came of it, the iterations, the forces, W times them, the piece that their trial forces are in, their
    residual and its worst node.
    """
    # As in the compiled solver, the force that would undo the worst free penetration alone sets the scale of rounding.
    least = 1e-12 * np.max(scale * np.abs(free))
    iteration = taken
    states, slopes, merit, residual, worst = _examine(forces, product, free, scale, friction, least)
    if taken == 0 and of_states.size and not residual <= tolerance:
        # Where the solution in the last step's piece is nearer to a solution than its forces, the search begins there.
        solved, moved = _solve_piece(compliance, free, of_slopes, unknowns, factors, pivots)
        look = _examine(solved, moved, free, scale, friction, least)
        if decreases_enough(look[2], merit, 1.0):
            forces, product, iteration = solved, moved, 1
            states, slopes, merit, residual, worst = look
    while not residual <= tolerance and iteration < NEWTON_LIMIT:
        if not _are_same(states, slopes, of_states, of_slopes):
            return _ELSEWHERE, iteration, forces, product, states, slopes, residual, worst
        solved, moved = _solve_piece(compliance, free, of_slopes, unknowns, factors, pivots)
        length, nearer, nearer_product = 1.0, solved, moved
        look = _examine(nearer, nearer_product, free, scale, friction, least)
        halvings = 0
        while not decreases_enough(look[2], merit, length) and halvings < SEARCH_LIMIT:
            length, halvings = 0.5 * length, halvings + 1
            nearer = forces + length * (solved - forces)
            nearer_product = product + length * (moved - product)
            look = _examine(nearer, nearer_product, free, scale, friction, least)
        if halvings == SEARCH_LIMIT:
            break
        forces, product, iteration = nearer, nearer_product, iteration + 1
        states, slopes, merit, residual, worst = look
    outcome = _SOLVED if residual <= tolerance else _STUCK
    return outcome, iteration, forces, product, states, slopes, residual, worst


@numba.njit(cache=True, nogil=True)
def _are_same(states, slopes, of_states, of_slopes):  # type: ignore[no-untyped-def]
    """Tell whether a piece is another one; none is like any."""
    same = of_states.size == states.size
    for i in range(of_states.size):
        same = same and states[i] == of_states[i] and slopes[i] == of_slopes[i]
    return same


@numba.njit(cache=True, nogil=True)
def _solve_piece(compliance, free, slopes, unknowns, factors, pivots):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return the solution of a piece, forces (n_c, 2) [N], and W times it [m]."""
    wanted = np.empty(unknowns.size)
    for k in range(unknowns.size):
        wanted[k] = -free[unknowns[k] // 2, unknowns[k] % 2]
    solve_factorised(factors, pivots, wanted)
    forces = np.zeros_like(free)
    for k in range(unknowns.size):
        forces[unknowns[k] // 2, unknowns[k] % 2] = wanted[k]
    for i in range(len(forces)):
        forces[i, 1] += slopes[i] * forces[i, 0]
    return forces, active_product(compliance, forces)


@numba.njit(cache=True, nogil=True)
def _examine(forces, product, free, scale, friction, least):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return states and slopes of the trial forces' piece; the residual's square, its largest over the force, where."""
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
    if np.isnan(merit):
        largest = merit
    return states, slopes, merit, (largest / max(least, force) if largest > 0.0 else largest), worst


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
