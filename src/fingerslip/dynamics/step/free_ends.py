"""Steps of several motions without forces at their ends, in compiled code.

A scheme is linear, and the same for every unknown: what it makes of the state at the start of a step is a matrix
``prediction`` (2, 3), from displacement, velocity and acceleration there to displacement and velocity at the end.
Factors and weights are those of :attr:`fingerslip.dynamics.step.stepper.Stepper.factors`.
"""

from __future__ import annotations

import numba
import numpy as np

from fingerslip.linear.products import write_products

__all__ = ["fill_right_hand_sides", "free_ends"]


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
def fill_right_hand_sides(factors, resistance, moving, ends, unbalance, loads, found, first, last):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Fill in the right-hand sides of steps with no unknown, from one row to before another.

    Parameters
    ----------
    factors, moving
        As of :func:`free_ends`.
    resistance : tuple
        What resists a motion; see :attr:`fingerslip.dynamics.step.stepper.Stepper.resistance`.
    ends : (k, 2 or 3, n) array
        What :func:`free_ends` returns.
    unbalance : (k, n) array
        Unbalanced forces at the start [N].
    loads : (k, n) array
        Loads at the end, with what materials remember [N].
    found : (k, n) array
        Gets the right-hand sides [N].
    first, last : int
        The rows.
    """
    _, _, _, start_weight, end_weight = factors
    stiffness, elastic, mass, dampers, (of_stiffness, of_elastic, of_mass) = resistance
    found[:, first:last] = 0.0
    _resist(stiffness, ends, 1.0, of_stiffness, found, first, last)
    if of_elastic != 0.0:
        _resist(elastic, ends, 0.0, of_elastic, found, first, last)
    if of_mass != 0.0:
        _resist(mass, ends, 0.0, of_mass, found, first, last)
    for i in range(len(found)):
        for j in range(first, last):
            force = found[i, j] + dampers[j] * ends[i, 1, j] if dampers.size else found[i, j]
            found[i, j] = end_weight * (loads[i, j] - force) + start_weight * unbalance[i, j]
    if moving.size:
        _hold(mass, ends, moving, found, first, last)


@numba.njit(cache=True, nogil=True)
def _resist(matrix, ends, of_displacement, of_velocity, forces, first, last):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Add some rows of a matrix times so much of displacement and velocity to forces (k, n)."""
    count, size = len(ends), ends.shape[2]
    given, products = np.empty((count, size)), np.empty(forces.shape)
    for i in range(count):
        for j in range(size):
            given[i, j] = of_displacement * ends[i, 0, j]
            if of_velocity != 0.0:
                given[i, j] += of_velocity * ends[i, 1, j]
    write_products(matrix, given, products, first, last)
    for i in range(count):
        for j in range(first, last):
            forces[i, j] += products[i, j]


@numba.njit(cache=True, nogil=True)
def _hold(mass, ends, moving, total, first, last):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Take the inertia of moving supports off right-hand sides (k, n); their own equations are empty."""
    starts, columns, values = mass
    for row in range(first, last):
        for i in range(len(total)):
            inertia = 0.0
            for entry in range(starts[row], starts[row + 1]):
                inertia += values[entry] * ends[i, 2, columns[entry]]
            total[i, row] -= inertia
    for j in moving:
        if first <= j < last:
            total[:, j] = 0.0
