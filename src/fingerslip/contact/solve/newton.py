"""The frictional contact problem of one step, on the contact nodes alone.

The unknowns are the nodal contact forces r: for each node a normal one r_n, positive in compression, and the
tangential ones r_t. The condensed body gives the local displacement-like quantity ::

    y = W r + q

where W, symmetric positive definite, holds the body's compliance with the penalty compliances 1/k_n and
1/k_t on its diagonal, y_n is the gap and y_t the slip of the step. Unilateral contact with Coulomb friction
of coefficient mu is ::

    0 <= r_n,   y_n >= 0,   r_n y_n = 0
    |r_t| <= mu r_n,   y_t = -s r_t with s >= 0,   s (mu r_n - |r_t|) = 0

which is exactly the penalty law with return mapping (Alart & Curnier 1991). Both lines are one projection P:
with z = r - rho y, the normal force is max(0, z_n) and the tangential one is z_t projected onto the disc of
radius mu max(0, z_n). A semismooth Newton iteration with line search drives the residual r - P(z) to zero;
where the search stalls, projected Gauss-Seidel sweeps follow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.solve.compliance import active_product
from fingerslip.contact.solve.projection import (
    NEWTON_LIMIT,
    SEARCH_LIMIT,
    decreases_enough,
    derivative,
    project,
    project_node,
    step_lengths,
)

_SWEEPS = 40
_ROUNDS = 25


@dataclass(frozen=True)
class ContactSolution:
    """What the contact solver found."""

    forces: Floats  # (n_c, dim), normal and tangential nodal forces [N]
    residual: float  # largest distance from the projection, relative to the largest force [-]
    iterations: int  # newton iterations and sweeps together
    worst: int  # index of the node with the largest residual
    response: Floats | None = None  # (n_c, dim) [m]


def solve_friction(
    compliance: Floats, free: Floats, friction_coefficient: Floats, start: Floats, tolerance: float
) -> ContactSolution:
    """Find the contact forces of one step.

    Arrays: compliance (n_c * dim, n_c * dim) [m/N]; free (n_c, dim) [m]; friction_coefficient (n_c,) [-]; start (n_c,
    dim) [N]; tolerance [-].

    Examples
    --------
    A node pressed by 1 um into a penalty of 1 N/um, pulled by 0.1 um (it sticks) or by 5 um (it slips):

    >>> stuck = solve_friction(np.eye(2), np.array([[-1.0, 0.1]]), np.array([0.5]), np.zeros((1, 2)), 1e-12)
    >>> slipped = solve_friction(np.eye(2), np.array([[-1.0, 5.0]]), np.array([0.5]), np.zeros((1, 2)), 1e-12)
    >>> stuck.forces.tolist(), slipped.forces.tolist()
    ([[1.0, -0.1]], [[1.0, -0.5]])
    """
    if not free.size:
        return ContactSolution(np.zeros_like(free), 0.0, 0, 0)
    arrays = np.ascontiguousarray(compliance), np.ascontiguousarray(free)
    try:
        forces, residual, iterations, worst = compiled_solve(*arrays, friction_coefficient, start, tolerance)
    except SystemError as error:
        # A Ctrl-C that arrives inside compiled code comes out wrapped.
        if isinstance(error.__cause__, KeyboardInterrupt):
            raise KeyboardInterrupt from error
        raise
    return ContactSolution(forces, residual, iterations, worst)


@numba.njit(cache=True, nogil=True)
def _evaluate(compliance, free, friction, scale, forces):  # type: ignore[no-untyped-def]
    """Return the trial forces z and the residual r - P(z)."""
    trial = forces - scale * (active_product(compliance, forces) + free)
    return trial, forces - project(trial, friction)


@numba.njit(cache=True, nogil=True)
def _newton_step(compliance, friction, scale, forces, trial, residual):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Solve (I - G (I - rho W)) d = -residual, G the projection's derivative, on the touching nodes only."""
    dim = forces.shape[1]
    touching = np.flatnonzero(trial[:, 0] > 0.0)
    step = -residual
    if touching.size == 0:
        return step
    unknowns = (touching.reshape(-1, 1) * dim + np.arange(dim)).ravel()
    matrix, right = np.zeros((unknowns.size, unknowns.size)), step.ravel()[unknowns]
    step[touching] = 0.0
    of_open = active_product(compliance, step)
    block = np.zeros((dim, dim))
    for a in range(touching.size):
        i = touching[a]
        derivative(trial[i], friction[i], block)
        for k in range(dim):
            row = a * dim + k
            for m in range(dim):
                if block[k, m] != 0.0:
                    weight = block[k, m] * scale[i, m]
                    right[row] -= weight * of_open[i, m]
                    matrix[row] += weight * compliance[i * dim + m][unknowns]
                    matrix[row, a * dim + m] -= block[k, m]
            matrix[row, row] += 1.0
    step.ravel()[unknowns] = np.linalg.solve(matrix, right)
    return step


@numba.njit(cache=True, nogil=True)
def _sweep(compliance, free, friction, scale, forces):  # type: ignore[no-untyped-def]
    """One projected Gauss-Seidel sweep, in place."""
    count, dim = forces.shape
    trial, new = np.empty(dim), np.empty(dim)
    product = active_product(compliance, forces)
    for i in range(count):
        for k in range(dim):
            trial[k] = forces[i, k] - scale[i, k] * (product[i, k] + free[i, k])
        project_node(trial, friction[i], new)
        for k in range(dim):
            change = new[k] - forces[i, k]
            if change != 0.0:
                product += change * compliance[i * dim + k].reshape(count, dim)
                forces[i, k] = new[k]


@numba.njit(cache=True, nogil=True)
def _newton(compliance, free, friction, scale, forces, goal):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Iterate until the residual is below `goal` or the line search stalls; return forces and iterations."""
    trial, residual = _evaluate(compliance, free, friction, scale, forces)
    merit = np.sum(residual**2)
    for iteration in range(NEWTON_LIMIT):
        if np.max(np.abs(residual)) <= goal:
            return forces, iteration
        try:
            step = _newton_step(compliance, friction, scale, forces, trial, residual)
        except Exception:  # noqa: BLE001  numba knows no narrower one: the matrix is singular, sweeps must follow
            return forces, iteration + 1
        length = 1.0
        for _ in range(SEARCH_LIMIT):
            candidate = forces + length * step
            new_trial, new_residual = _evaluate(compliance, free, friction, scale, candidate)
            new_merit = np.sum(new_residual**2)
            if decreases_enough(new_merit, merit, length):
                break
            length *= 0.5
        if not new_merit < merit:
            return forces, iteration + 1
        forces, trial, residual, merit = candidate, new_trial, new_residual, new_merit
    return forces, NEWTON_LIMIT


@numba.njit(cache=True, nogil=True)
def compiled_solve(compliance, free, friction, start, tolerance):  # type: ignore[no-untyped-def]
    """Return what :func:`solve_friction` does: forces, residual, iterations and the worst node."""
    count, dim = free.shape
    scale = step_lengths(np.diag(compliance).copy().reshape(count, dim))
    forces, iterations = start.copy(), 0
    # The force that would undo the free penetration of the worst node alone sets the scale of rounding.
    reference = np.max(scale * np.abs(free))
    for attempt in range(_ROUNDS):
        goal = tolerance * max(np.max(np.abs(forces)), 1e-12 * reference)
        forces, used = _newton(compliance, free, friction, scale, forces, goal)
        iterations += used
        _, residual = _evaluate(compliance, free, friction, scale, forces)
        size = max(np.max(np.abs(forces)), 1e-12 * reference)
        if np.max(np.abs(residual)) <= tolerance * size:
            break
        for _ in range(_SWEEPS * (attempt + 1)):
            _sweep(compliance, free, friction, scale, forces)
        iterations += _SWEEPS * (attempt + 1)
    _, residual = _evaluate(compliance, free, friction, scale, forces)
    size = max(np.max(np.abs(forces)), 1e-12 * reference)
    largest = np.zeros(count)
    for i in range(count):
        largest[i] = np.max(np.abs(residual[i]))
    worst = np.argmax(largest)
    return forces, (largest[worst] / size if largest[worst] != 0.0 else 0.0), iterations, worst
