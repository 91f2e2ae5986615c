"""The contact problem in 2D by partitions of its nodes, whose inverse is kept and updated.

Written for the displacement x = q + (W - P) r of the surface, with the penalties' compliance P, the conditions of
:mod:`fingerslip.contact.solve.newton` are linear as long as no node changes its state: r = -D x with a block for each
node ::

    open  D = 0        stick  D = [k_n, 0; 0, k_t]        slip  D = [k_n, 0; g k_n, 0],  g = mu or -mu

A full step of Newton's method solves this for the *partition* of the nodes that the trial forces are in ::

    x = (I - C D) q,    C = (I + (W - P) D)^-1 (W - P)

C is kept from step to step. A node that changes its state changes C by a matrix of rank two. Corrections by the
residual of the equations, two in most cases, bring x to rounding and allow for slopes g that differ a little from those
of C. A step begins with the solution in the partition of the last one: where no node changes its state, that is all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats, Integers
from fingerslip.contact.solve.compliance import active_product
from fingerslip.contact.solve.newton import ContactSolution, solve_friction
from fingerslip.contact.solve.projection import NEWTON_LIMIT, SEARCH_LIMIT, decreases_enough, step_lengths
from fingerslip.contact.states import OPEN, SLIP, STICK

# Updates of the inverse after which it is made anew, corrections of one solution, and what they may leave of the
# forces, relative to the tolerance. A slope that differs by less than the share needs no update.
_MOST_UPDATES, _CORRECTIONS, _LEFT, _SLOPE_SHARE = 400, 30, 0.1, 0.02


@dataclass(frozen=True)
class Partition:
    """A state of every node, with the inverse that its forces follow from."""

    compliance: Floats  # (n_c * 2, n_c * 2), W that the inverse is made of [m/N]
    scale: Floats  # (n_c, 2), step lengths rho of the projection [N/m]
    inverse: Floats  # (n_c * 2, n_c * 2), C transposed [m/N]
    states: NDArray[np.int8]  # (n_c,), those of the inverse: OPEN, STICK or SLIP
    slopes: Floats  # (n_c,), tangential over normal force of the nodes that slip [-], else zero
    updates: Integers  # (1,), updates of the inverse since it was made
    forces: Floats  # (n_c, 2), forces of the last step [N]
    product: Floats  # (n_c, 2), W times them [m]


def first_partition(compliance: Floats, penalty: Floats) -> Partition:
    """Return the partition of a compliance W (n_c * 2, n_c * 2) [m/N] in which all nodes are open.

    Arrays: penalty (n_c, 2) [m/N].
    """
    count = len(penalty)
    inverse = compliance.copy()
    inverse.flat[:: 2 * count + 1] -= penalty.ravel()
    scale = step_lengths(np.diag(compliance).reshape(penalty.shape))
    states, slopes = np.full(count, OPEN, dtype=np.int8), np.zeros(count)
    none = np.zeros((count, 2))
    return Partition(compliance, scale, inverse, states, slopes, np.zeros(1, dtype=np.int64), none, none)


def solve_in_partitions(  # noqa: PLR0917
    partition: Partition,
    penalty: Floats,
    free: Floats,
    friction_coefficient: Floats,
    start: Floats,
    tolerance: float,
) -> tuple[ContactSolution, Partition]:
    """Find the contact forces of one step in 2D, from the partition of the last one.

    Steps are halved until they bring the forces nearer to a solution. Where none does, :func:`solve_friction` takes
    over.

    Arrays: penalty (n_c, 2) [m/N]; free (n_c, 2) [m]; friction_coefficient (n_c,) [-]; start (n_c, 2) [N]; tolerance
    [-].
    """
    compliance = partition.compliance
    product = partition.product if partition.forces is start else active_product(compliance, start)
    problem = compliance, np.ascontiguousarray(penalty), partition.scale, free, friction_coefficient, tolerance
    reached = start, product, 0
    # The arrays of a partition belong to the step that made them: they are copied where a node changes its state.
    for copies in (False, True):
        if copies:
            names = "inverse", "states", "slopes", "updates"
            partition = replace(partition, **{name: getattr(partition, name).copy() for name in names})
        inverse = partition.inverse, partition.states, partition.slopes, partition.updates
        forces, product, residual, iterations, worst = solve_partitions(*problem, *inverse, *reached, copies)
        if residual <= tolerance:
            response = product - penalty * forces
            after = replace(partition, forces=forces, product=product)
            return ContactSolution(forces, residual, iterations, worst, response), after
        reached = forces, product, iterations
    solution = solve_friction(compliance, free, friction_coefficient, forces, tolerance)
    return replace(solution, iterations=iterations + solution.iterations), partition


@numba.njit(cache=True, nogil=True)
def solve_partitions(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    compliance,
    penalty,
    scale,
    free,
    friction,
    tolerance,
    inverse,
    states,
    slopes,
    updates,
    forces,
    product,
    iteration,
    may_update,
):
    """Run Newton's method from forces (n_c, 2) [N] and W times them [m]; the inverse and its states follow in place.

    Without `may_update` they stay, and the method ends where they would have to follow. Returns forces, W times them,
    the residual, iterations, and the node with the largest residual.
    """
    # As in the compiled solver for all dimensions, the force that undoes the worst penetration sets the rounding.
    least = 1e-12 * np.max(scale * np.abs(free)) if free.size else 0.0
    wanted, slope, merit, residual, worst = _examine(forces, product, free, scale, friction, least)
    # The search starts in the last partition, where the solution is nearer there than the last forces.
    is_first = iteration == 0 and states.any()
    while not residual <= tolerance and iteration < NEWTON_LIMIT:
        if is_first:
            wanted, slope = states.copy(), np.sign(slopes) * friction
        elif not may_update or not _update(compliance, penalty, inverse, states, slopes, updates, wanted, slope):
            break
        start = forces, product
        solved, moved = _solve(compliance, penalty, free, inverse, (states, slopes), (wanted, slope), start, tolerance)
        length, nearer, nearer_product, halvings = 1.0, solved, moved, 0
        trial = _examine(nearer, nearer_product, free, scale, friction, least)
        while not decreases_enough(trial[2], merit, length) and halvings < SEARCH_LIMIT and not is_first:
            length, halvings = 0.5 * length, halvings + 1
            nearer, nearer_product = forces + length * (solved - forces), product + length * (moved - product)
            trial = _examine(nearer, nearer_product, free, scale, friction, least)
        if halvings == SEARCH_LIMIT:
            break
        if is_first and not decreases_enough(trial[2], merit, 1.0):
            trial = _examine(forces, product, free, scale, friction, least)
        else:
            forces, product, iteration = nearer, nearer_product, iteration + 1
        wanted, slope, merit, residual, worst = trial
        is_first = False
    return forces, product, residual, iteration, worst


@numba.njit(cache=True, nogil=True)
def _examine(forces, product, free, scale, friction, least):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return states and slopes of the trial forces' partition; the residual squared, its largest over the force, where.

    The square is the sum over all nodes.
    """
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
    return states, slopes, merit, (largest / max(least, force) if largest > 0.0 else max(largest, 0.0)), worst


@numba.njit(cache=True, nogil=True)
def _solve(compliance, penalty, free, inverse, of_inverse, partition, start, tolerance):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return the forces (n_c, 2) [N] in a partition near that of the inverse, and W times them [m].

    Both partitions are states and slopes. The search begins with forces, and W times them, near these.
    """
    states, slopes = partition
    moved = _near(penalty, free, states, start)
    solved, defect, last = _resist(penalty, states, slopes, moved, -1.0), np.empty_like(free), np.inf
    product = start[1] + active_product(compliance, solved - start[0])
    for _ in range(_CORRECTIONS):
        _miss(penalty, free, product, solved, moved, defect)
        further = active_product(inverse, _resist(penalty, of_inverse[0], of_inverse[1], defect, 1.0))
        for i in range(states.size):
            for k in range(2):
                moved[i, k] += defect[i, k] - further[i, k]
        solved = _resist(penalty, states, slopes, moved, -1.0)
        # Not by what has changed: rounding would add up from step to step.
        product = active_product(compliance, solved)
        _miss(penalty, free, product, solved, moved, defect)
        missed = _largest(_resist(penalty, states, slopes, defect, 1.0))
        # Rounding shrinks no further.
        if not missed > _LEFT * tolerance * _largest(solved) or missed > 0.5 * last:
            break
        last = missed
    return solved, product


@numba.njit(cache=True, nogil=True)
def _near(penalty, free, states, start):  # type: ignore[no-untyped-def]
    """Return displacements (n_c, 2) [m] that give forces, where the states let them, and W times them."""
    forces, product = start
    moved = np.empty_like(free)
    for i in range(states.size):
        for k in range(2):
            moved[i, k] = free[i, k] + product[i, k] - penalty[i, k] * forces[i, k]
        if states[i] != OPEN:
            moved[i, 0] = -penalty[i, 0] * forces[i, 0]
        if states[i] == STICK:
            moved[i, 1] = -penalty[i, 1] * forces[i, 1]
    return moved


@numba.njit(cache=True, nogil=True)
def _miss(penalty, free, product, forces, moved, defect):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Write what displacements (n_c, 2) [m] lack of q + (W - P) r into `defect`."""
    for i in range(len(moved)):
        for k in range(2):
            defect[i, k] = free[i, k] + product[i, k] - penalty[i, k] * forces[i, k] - moved[i, k]


@numba.njit(cache=True, nogil=True)
def _largest(values):  # type: ignore[no-untyped-def]
    """Return the largest absolute value of an array (n, 2)."""
    largest = 0.0
    for i in range(len(values)):
        largest = max(largest, np.abs(values[i, 0]), np.abs(values[i, 1]))
    return largest


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _resist(penalty, states, slopes, moved, sign):  # type: ignore[no-untyped-def]
    """Return D x (n_c, 2) [N] of displacements (n_c, 2) [m], with a sign."""
    forces = np.zeros_like(moved)
    for i in range(len(moved)):
        if states[i] != OPEN:
            forces[i, 0] = sign * moved[i, 0] / penalty[i, 0]
            forces[i, 1] = sign * moved[i, 1] / penalty[i, 1] if states[i] == STICK else slopes[i] * forces[i, 0]
    return forces


@numba.njit(cache=True, nogil=True)
def _update(compliance, penalty, inverse, states, slopes, updates, wanted, slope):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Bring the inverse to a partition near a wanted one; tell whether that went well."""
    if updates[0] > _MOST_UPDATES:
        for i in range(len(inverse)):
            for j in range(len(inverse)):
                inverse[i, j] = compliance[i, j]
            inverse[i, i] -= penalty[i // 2, i % 2]
        for i in range(states.size):
            states[i], slopes[i] = OPEN, 0.0
        updates[0] = 0
    for i in range(states.size):
        turned = np.abs(slope[i] - slopes[i]) > _SLOPE_SHARE * np.abs(slope[i])
        if states[i] != wanted[i] or turned:
            if not _change(penalty, inverse, i, (states[i], slopes[i]), (wanted[i], slope[i])):
                return False
            states[i], slopes[i], updates[0] = wanted[i], slope[i], updates[0] + 1
    return True


@numba.njit(cache=True, nogil=True)
def _block(penalty, node, state, slope):  # type: ignore[no-untyped-def]
    """Return the entries D_nn, D_tn, D_tt of a node's block [N/m]."""
    if state == OPEN:
        return 0.0, 0.0, 0.0
    normal = 1.0 / penalty[node, 0]
    return normal, slope * normal, (1.0 / penalty[node, 1] if state == STICK else 0.0)


@numba.njit(cache=True, nogil=True)
def _change(penalty, inverse, node, before, after):  # type: ignore[no-untyped-def]
    """Change the inverse by the state and slope of a node; tell whether the new one exists."""
    old, new = _block(penalty, node, *before), _block(penalty, node, *after)
    # The change of D is [a, 0; b, d]; the update is C - C_(:,i) X C_(i,:) with X = dD (1 + C_ii dD)^-1.
    a, b, d = new[0] - old[0], new[1] - old[1], new[2] - old[2]
    first, second = 2 * node, 2 * node + 1
    c00, c10, c01, c11 = inverse[first, first], inverse[first, second], inverse[second, first], inverse[second, second]
    m00, m01 = 1.0 + c00 * a + c01 * b, c01 * d
    m10, m11 = c10 * a + c11 * b, 1.0 + c11 * d
    determinant = m00 * m11 - m01 * m10
    if not np.abs(determinant) > 1e-12:
        return False
    x00, x01 = a * m11 / determinant, -a * m01 / determinant
    x10, x11 = (b * m11 - d * m10) / determinant, (d * m00 - b * m01) / determinant
    size = len(inverse)
    left, right = np.empty(size), np.empty(size)
    for p in range(size):
        left[p] = inverse[first, p] * x00 + inverse[second, p] * x10
        right[p] = inverse[first, p] * x01 + inverse[second, p] * x11
    for j in range(size):
        row, of_first, of_second = inverse[j], inverse[j, first], inverse[j, second]
        for p in range(size):
            row[p] -= of_first * left[p] + of_second * right[p]
    return True
