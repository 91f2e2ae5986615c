"""The contact problem in 2D, piece by piece.

In 2D the conditions of :mod:`fingerslip.contact.solve.newton` are linear as long as no node changes its state ::

    open     r_n = 0,  r_t = 0
    stick    y_n = 0,  y_t = 0
    slip     y_n = 0,  r_t = g r_n    with the slope g = mu or -mu

A full step of Newton's method solves the *piece* that the trial forces are in. What remains unknown are the normal
forces of the touching nodes and the tangential ones of those that stick. The matrix of a piece is factorised, and
serves as long as few nodes have another state, in later time steps too (:mod:`fingerslip.contact.solve.bordered`). A
step begins with the solution in the piece in which the last one ended: where no node changes its state, that is all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.bordered import add_borders, missing_borders, piece_matrix, solve_with_borders
from fingerslip.contact.solve.compliance import active_product
from fingerslip.contact.solve.dense import DenseFactor, factorise_dense, solve_by_factors
from fingerslip.contact.solve.line_search import NEWTON_LIMIT, SEARCH_LIMIT, decreases_enough
from fingerslip.contact.solve.newton import ContactSolution, solve_friction
from fingerslip.contact.solve.projection import step_lengths
from fingerslip.contact.states import OPEN, SLIP, STICK

__all__ = ["Piece", "solve_by_pieces"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# What comes of Newton's method: a solution, forces in a piece that is far from the base, or no step that helps.
_SOLVED, _ELSEWHERE, _STUCK = 0, 1, 2
# Components in which a piece may differ from its base; each costs a solution with the factors, once.
_MOST_BORDERS = 16


@dataclass(frozen=True)
class Base:
    """A piece whose matrix is factorised."""

    states: NDArray[np.int8]  # (n_c,), as of :class:`Piece`
    slopes: Array  # (n_c,), as of :class:`Piece`
    unknowns: Indices  # (n,), components among n_c * 2 that it leaves unknown
    places: Indices  # (n_c * 2,), the number of each component among these
    factor: DenseFactor  # factors of its matrix


@dataclass(frozen=True)
class Piece:
    """A state of every node, with what its forces are found from."""

    compliance: Array  # (n_c * 2, n_c * 2), W that its matrix is made of [m/N]
    scale: Array  # (n_c, 2), step lengths rho of the projection [N/m]
    base: Base  # A piece that is near
    states: NDArray[np.int8]  # (n_c,), :data:`~fingerslip.contact.states.OPEN`, STICK or SLIP
    slopes: Array  # (n_c,), tangential over normal force of the nodes that slip [-], else zero
    components: Indices  # (r,), components in which pieces so far have differed from the base
    borders: Array  # (2, r, n), their borders
    forces: Array  # (n_c, 2), forces of the last time step [N], and W times them [m]
    product: Array  # (n_c, 2), forces of the last time step [N], and W times them [m]

    @property
    def unknowns(self) -> Indices:
        """Components among n_c * 2 that the piece leaves unknown."""
        return np.flatnonzero(np.column_stack([self.states != OPEN, self.states == STICK]))


_NO_COMPONENTS, _NO_PIVOTS = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int32)
_NO_BORDERS = np.zeros((2, 0, 0))
_NO_BASE = (np.zeros(0, dtype=np.int8), np.zeros(0), _NO_COMPONENTS, _NO_COMPONENTS, np.zeros((0, 0)), _NO_PIVOTS)


def solve_by_pieces(
    compliance: Array,
    free: Array,
    friction_coefficient: Array,
    start: Array,
    tolerance: float,
    *,
    piece: Piece | None = None,
) -> tuple[ContactSolution, Piece | None]:
    """Find the contact forces of one step in 2D.

    Steps are halved until they bring the forces nearer to a solution. Where none does, :func:`solve_friction` takes
    over.

    Arrays: compliance (n_c * 2, n_c * 2) [m/N]; free (n_c, 2) [m]; friction_coefficient (n_c,) [-]; start (n_c, 2)
    [N]; tolerance [-].

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
    problem, near = (compliance, free, friction_coefficient, scale, tolerance, _MOST_BORDERS), _near(piece)
    result = _newton(*problem, start, product, *near, 0)
    while result[0] == _ELSEWHERE:
        _, iterations, forces, product, states, slopes, *_ = result
        base = _base(compliance, states, slopes)
        none = np.zeros((2, 0, base.unknowns.size))
        piece = Piece(compliance, scale, base, states, slopes, _NO_COMPONENTS, none, forces, product)
        result = _newton(*problem, forces, product, *_near(piece), iterations)
    outcome, iterations, forces, product, states, slopes, components, borders, residual, worst = result
    if outcome == _SOLVED:
        if piece is not None and piece.forces is not forces:
            piece = Piece(compliance, scale, piece.base, states, slopes, components, borders, forces, product)
        return ContactSolution(forces, residual, iterations, worst), piece
    solution = solve_friction(compliance, free, friction_coefficient, forces, tolerance)
    return replace(solution, iterations=iterations + solution.iterations), piece


def _base(compliance: Array, states: NDArray[np.int8], slopes: Array) -> Base:
    """Factorise the matrix of a piece."""
    matrix, unknowns, places = piece_matrix(compliance, states, slopes)
    return Base(states, slopes, unknowns, places, factorise_dense(matrix))


def _near(piece: Piece | None) -> tuple[Any, Any, Any, Any, Any]:
    """Return the arrays of a piece that Newton's method begins with: base, states, slopes, components and borders."""
    if piece is None:
        return _NO_BASE, _NO_BASE[0], _NO_BASE[1], _NO_COMPONENTS, _NO_BORDERS
    base = piece.base
    base_piece = base.states, base.slopes, base.unknowns, base.places, base.factor.factors, base.factor.pivots
    return base_piece, piece.states, piece.slopes, piece.components, piece.borders


@numba.njit(cache=True, nogil=True)
def _newton(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    compliance,
    free,
    friction,
    scale,
    tolerance,
    most_borders,
    forces,
    product,
    base,
    of_states,
    of_slopes,
    components,
    borders,
    count,
):
    """Run Newton's method as long as it stays near a base, from given forces (n_c, 2) [N] and W times them [m].

    Returns what came of it, the iterations, the forces, W times them, the piece that was solved, or the one that their
    trial forces are in where it is far, its borders, and the residual and its worst node.
    """
    # As in the compiled solver, the force that would undo the worst free penetration alone sets the scale of rounding.
    least = 1e-12 * np.max(scale * np.abs(free))
    iteration, has_base = count, base[0].size == len(forces)
    start = np.zeros(0)
    states, slopes, merit, residual, worst = _examine(forces, product, free, scale, friction, least)
    if has_base and not residual <= tolerance:
        start = _start(free, base)
    if count == 0 and has_base and not residual <= tolerance:
        # Where the solution in the last step's piece is nearer to a solution than its forces, the search begins there.
        solved = solve_with_borders(compliance, free, base, start, components, borders, of_states, of_slopes)
        moved = active_product(compliance, solved)
        look = _examine(solved, moved, free, scale, friction, least)
        if decreases_enough(look[2], merit, 1.0):
            forces, product, iteration = solved, moved, 1
            states, slopes, merit, residual, worst = look
    while not residual <= tolerance and iteration < NEWTON_LIMIT:
        # A piece whose solution is not exact enough needs factors of its own.
        again = iteration > count and components.size > 0 and _are_same(states, slopes, of_states, of_slopes)
        if not has_base or again:
            return _ELSEWHERE, iteration, forces, product, states, slopes, components, borders, residual, worst
        missing = missing_borders(base[0], base[1], components, states, slopes)
        if components.size + missing.size > most_borders:
            return _ELSEWHERE, iteration, forces, product, states, slopes, components, borders, residual, worst
        if missing.size:
            components, borders = add_borders(compliance, base, components, borders, missing)
        of_states, of_slopes = states, slopes
        solved = solve_with_borders(compliance, free, base, start, components, borders, of_states, of_slopes)
        moved = active_product(compliance, solved)
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
    return outcome, iteration, forces, product, of_states, of_slopes, components, borders, residual, worst


@numba.njit(cache=True, nogil=True)
def _start(free, base):  # type: ignore[no-untyped-def]
    """Return the unknowns of a base (n,) [N], if nothing differs from it."""
    _, _, unknowns, _, factors, pivots = base
    result = np.empty(unknowns.size)
    for k in range(unknowns.size):
        result[k] = -free[unknowns[k] // 2, unknowns[k] % 2]
    solve_by_factors(factors, pivots, result)
    return result


@numba.njit(cache=True, nogil=True)
def _are_same(states, slopes, of_states, of_slopes):  # type: ignore[no-untyped-def]
    """Tell whether a piece is another one; none is like any."""
    same = of_states.size == states.size
    for i in range(of_states.size):
        same = same and states[i] == of_states[i] and slopes[i] == of_slopes[i]
    return same


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
