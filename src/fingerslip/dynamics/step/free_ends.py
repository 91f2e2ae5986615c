"""Steps of several motions without forces at their ends, compiled: matrices are read once for all motions.

A scheme is linear, and the same for every unknown: what it makes of the state at the start of a step is a matrix
``prediction`` (2, 3), from displacement, velocity and acceleration there to displacement and velocity at the end.
Factors and weights are those of :attr:`fingerslip.dynamics.step.stepper.Stepper.factors`.
"""

from __future__ import annotations

import numba
import numpy as np

__all__ = ["free_ends", "free_steps"]


@numba.njit(cache=True, nogil=True)
def free_ends(prediction, factors, moving, prescribed, displacement, velocity, acceleration):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return the ends of steps with no unknown.

    Unknowns of moving supports follow from the prescribed displacement: they move by the scheme like all others.

    Parameters
    ----------
    prediction : (2, 3) array
        What the scheme makes of the start.
    factors : tuple of float
        Factors and weights of the scheme.
    moving, prescribed : (m,) array
        The unknowns of moving supports, and their displacement at the end [m].
    displacement, velocity, acceleration : (k, n) array
        The motions at the start [m], [m/s], [m/s^2].

    Returns
    -------
    (k, 2, n) array
        Displacement [m] and velocity [m/s]; where supports move (k, 3, n), with their acceleration [m/s^2], else zero.
    """
    of_displacement, of_velocity, of_inertia, _, _ = factors
    count, size = displacement.shape
    ends = np.zeros((count, 3 if moving.size else 2, size))
    for i in range(count):
        for row in range(2):
            of_start = prediction[row]
            for j in range(size):
                moved = of_start[0] * displacement[i, j] + of_start[1] * velocity[i, j]
                ends[i, row, j] = moved + of_start[2] * acceleration[i, j]
        for m in range(moving.size):
            j = moving[m]
            unknown = (prescribed[m] - ends[i, 0, j]) / of_displacement
            ends[i, 0, j] += of_displacement * unknown
            ends[i, 1, j] += of_velocity * unknown
            ends[i, 2, j] = of_inertia * unknown
    return ends


@numba.njit(cache=True, nogil=True)
def free_steps(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    prediction,
    factors,
    resistance,
    moving,
    prescribed,
    displacement,
    velocity,
    acceleration,
    unbalance,
    loads,
):
    """Return the ends of steps with no unknown, as :func:`free_ends` does, and the right-hand sides, (k, n) [N].

    Parameters
    ----------
    prediction, factors, moving, prescribed, displacement, velocity, acceleration
        As of :func:`free_ends`.
    resistance : tuple
        What resists a motion; see :attr:`fingerslip.dynamics.step.stepper.Stepper.resistance`.
    unbalance : (k, n) array
        Unbalanced forces at the start [N].
    loads : (k, n) array
        Loads at the end, with what materials remember [N].
    """
    _, _, _, start_weight, end_weight = factors
    ends = free_ends(prediction, factors, moving, prescribed, displacement, velocity, acceleration)
    stiffness, elastic, mass, dampers, (of_stiffness, of_elastic, of_mass) = resistance
    forces = np.zeros_like(loads)
    _resist(stiffness, ends, 1.0, of_stiffness, forces)
    if of_elastic != 0.0:
        _resist(elastic, ends, 0.0, of_elastic, forces)
    if of_mass != 0.0:
        _resist(mass, ends, 0.0, of_mass, forces)
    for i in range(loads.shape[0]):
        for j in range(loads.shape[1]):
            force = forces[i, j] + dampers[j] * ends[i, 1, j] if dampers.size else forces[i, j]
            forces[i, j] = end_weight * (loads[i, j] - force) + start_weight * unbalance[i, j]
    if moving.size:
        _hold(mass, ends, moving, forces)
    return ends, forces


@numba.njit(cache=True, nogil=True, fastmath={"reassoc"})
def _resist(matrix, ends, of_displacement, of_velocity, forces):  # type: ignore[no-untyped-def]
    """Add a matrix times so much of displacement and velocity to forces (k, n)."""
    starts, columns, values = matrix
    count, size = forces.shape
    given = np.empty((count, size))
    for i in range(count):
        for j in range(size):
            given[i, j] = of_displacement * ends[i, 0, j]
            if of_velocity != 0.0:
                given[i, j] += of_velocity * ends[i, 1, j]
    for row in range(size):
        for i in range(count):
            force = 0.0
            for entry in range(starts[row], starts[row + 1]):
                force += values[entry] * given[i, columns[entry]]
            forces[i, row] += force


@numba.njit(cache=True, nogil=True)
def _hold(mass, ends, moving, total):  # type: ignore[no-untyped-def]
    """Take the inertia of moving supports off right-hand sides (k, n); their own equations are empty."""
    starts, columns, values = mass
    for row in range(total.shape[1]):
        for i in range(total.shape[0]):
            inertia = 0.0
            for entry in range(starts[row], starts[row + 1]):
                inertia += values[entry] * ends[i, 2, columns[entry]]
            total[i, row] -= inertia
    for i in range(total.shape[0]):
        for j in moving:
            total[i, j] = 0.0
