"""Steps of several motions without forces at their ends, in compiled code.

A scheme is linear, and the same for every unknown: what it makes of the state at the start of a step is a matrix
``prediction`` (2, 3), from displacement, velocity and acceleration there to displacement and velocity at the end.
Factors and weights are those of :attr:`fingerslip.dynamics.step.stepper.Stepper.factors`.
"""

from __future__ import annotations

import numba
import numpy as np

from fingerslip.linear.symmetric import write_symmetric_products

__all__ = ["free_ends", "right_hand_sides"]


@numba.njit(cache=True, nogil=True)
def free_ends(prediction, factors, moving, prescribed, displacement, velocity, acceleration):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return the ends of steps with no unknown.

    Unknowns of moving supports follow from the prescribed displacement: they move by the scheme like all others.

    Arrays: prediction (2, 3); moving, prescribed (m,) [m]; displacement, velocity, acceleration (k, n) [m]; returns
    (k, 2, n) [m].
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
def right_hand_sides(factors, resistance, moving, ends, unbalance, loads):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return the right-hand sides of steps with no unknown, (k, n) [N].

    Arrays: ends (k, 2 or 3, n); unbalance (k, n) [N]; loads (k, n) [N].
    """
    _, _, _, start_weight, end_weight = factors
    stiffness, elastic, mass, dampers, (of_stiffness, of_elastic, of_mass) = resistance
    right = _resisting(stiffness, ends, 1.0, of_stiffness)
    if of_elastic != 0.0:
        right += _resisting(elastic, ends, 0.0, of_elastic)
    if of_mass != 0.0:
        right += _resisting(mass, ends, 0.0, of_mass)
    for i in range(right.shape[0]):
        for j in range(right.shape[1]):
            force = right[i, j] + dampers[j] * ends[i, 1, j] if dampers.size else right[i, j]
            right[i, j] = end_weight * (loads[i, j] - force) + start_weight * unbalance[i, j]
    if moving.size:
        # The inertia of moving supports is known; their own equations are empty.
        right -= _products(mass, ends[:, 2].copy())
        for j in moving:
            right[:, j] = 0.0
    return right


@numba.njit(cache=True, nogil=True)
def _resisting(matrix, ends, of_displacement, of_velocity):  # type: ignore[no-untyped-def]
    """Return a matrix times so much of displacement and velocity, (k, n)."""
    count, size = len(ends), ends.shape[2]
    forces = np.empty((count, size))
    for i in range(count):
        for j in range(size):
            forces[i, j] = of_displacement * ends[i, 0, j]
            if of_velocity != 0.0:
                forces[i, j] += of_velocity * ends[i, 1, j]
    return _products(matrix, forces)


@numba.njit(cache=True, nogil=True)
def _products(matrix, vectors):  # type: ignore[no-untyped-def]
    products = np.empty_like(vectors)
    write_symmetric_products(matrix, vectors, products)
    return products
