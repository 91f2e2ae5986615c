"""The fields of several motions at the end of a step, in compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.step.prediction import Prediction
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.system.scheme import StepChange
from fingerslip.linear.symmetric import as_rows, write_symmetric_products

__all__ = ["End", "ends"]

Array = NDArray[np.float64]

_NONE = np.zeros((0, 0))


@dataclass(frozen=True)
class End:
    """A motion at the end of a step."""

    displacement: Array  # (n,), [m], [m/s], [m/s^2]
    velocity: Array  # (n,), [m], [m/s], [m/s^2]
    acceleration: Array  # (n,), [m], [m/s], [m/s^2]
    inertia: Array  # (n,), mass times acceleration [N]
    change: StepChange  # what the step has changed
    kinetic: float  # kinetic energy, and at small strain what the elastic stiffness stores, else 0 [J]
    elastic: float  # kinetic energy, and at small strain what the elastic stiffness stores, else 0 [J]


def ends(
    stepper: Stepper,
    starts: Sequence[Prediction],
    unknowns: Array,
    added: Sequence[Array | None],
    *,
    is_small: bool,
) -> list[End]:
    """Return the ends of k motions that share matrices and scheme.

    Arrays: unknowns (k, n); added (n,) [N].
    """
    befores, factors = [start.before for start in starts], stepper.factors
    free = (as_rows([start.free.displacement for start in starts]), as_rows([start.free.velocity for start in starts]))
    fields = _fields(factors, *free, unknowns, _some([start.prescribed for start in starts], unknowns))
    matrices = stepper.compiled_mass, stepper.compiled_stiffness
    before = (
        as_rows([before.displacement for before in befores]),
        as_rows([before.velocity for before in befores]),
        as_rows([before.inertia for before in befores]),
        as_rows([before.unbalance for before in befores]),
    )
    changes, energies = _finish(factors, matrices, is_small, _some(added, unknowns), before, fields)
    return list(map(_end, befores, fields.transpose(1, 0, 2), changes.transpose(1, 0, 2), energies.tolist()))


def _end(before: State, fields: Array, changes: Array, energies: Sequence[float]) -> End:
    """Return the end of a motion from its fields and from what has changed."""
    displacement, velocity, acceleration, inertia, unbalance = fields
    moved, faster, pushed = changes
    change = StepChange(moved, faster, pushed, (before.unbalance_before, before.unbalance, unbalance))
    return End(displacement, velocity, acceleration, inertia, change, *energies)


def _some(vectors: Sequence[Array | None], like: Array) -> Array:
    """Return vectors (n,) as rows (k, n), those that are missing as zeros; no rows where all are missing."""
    if all(vector is None for vector in vectors):
        return _NONE
    return np.stack([np.zeros_like(like[0]) if vector is None else vector for vector in vectors])


@numba.njit(cache=True, nogil=True)
def _fields(factors, free_displacement, free_velocity, unknowns, prescribed):  # type: ignore[no-untyped-def]
    """Return displacement, velocity and acceleration of k motions, with place for two more fields, shape (5, k, n)."""
    of_displacement, of_velocity, of_inertia, _, _ = factors
    count, size = unknowns.shape
    # One array: compiled code takes longer to return several than to fill them.
    fields = np.empty((5, count, size))
    for i in range(count):
        for j in range(size):
            fields[0, i, j] = free_displacement[i, j] + of_displacement * unknowns[i, j]
            fields[1, i, j] = free_velocity[i, j] + of_velocity * unknowns[i, j]
            fields[2, i, j] = of_inertia * unknowns[i, j]
    if prescribed.size:
        fields[2] += prescribed
    return fields


@numba.njit(cache=True, nogil=True)
def _finish(factors, matrices, is_small, added, before, fields):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Fill in inertia and unbalance of k motions, (5, k, n); return changes, (3, k, n), and energies, (k, 2) [J].

    The changes are those of displacement, velocity and inertia, the energies the kinetic and the elastic one.
    """
    _, _, of_inertia, start_weight, end_weight = factors
    _, count, size = fields.shape
    changes, energies = np.empty((3, count, size)), np.zeros((count, 2))
    if of_inertia != 0.0:
        _inertia(matrices[0], of_inertia, fields, energies)
    else:
        fields[3] = 0.0
    if is_small:
        # Nothing else in the step forms this product, so the balance of energies checks the substitutions.
        _elastic(matrices[1], fields, energies)
    displacement_before, velocity_before, inertia_before, unbalance_before = before
    for i in range(count):
        inertia, unbalance = fields[3, i], fields[4, i]
        for j in range(size):
            force = start_weight * unbalance_before[i, j] - inertia[j]
            unbalance[j] = (force + added[i, j] if added.size else force) / end_weight
            changes[0, i, j] = fields[0, i, j] - displacement_before[i, j]
            changes[1, i, j] = fields[1, i, j] - velocity_before[i, j]
            changes[2, i, j] = inertia[j] - inertia_before[i, j]
    return changes, energies


@numba.njit(cache=True, nogil=True)
def _inertia(mass, of_inertia, fields, energies):  # type: ignore[no-untyped-def]
    """Fill in the inertia [N] and the kinetic energy [J]."""
    count, size = fields.shape[1:]
    # The mass is read once for velocities and accelerations.
    products = np.empty((2 * count, size))
    write_symmetric_products(mass, fields[1:3].reshape(2 * count, size), products)
    fields[3] = products[count:]
    for i in range(count):
        total = 0.0
        for j in range(size):
            total += fields[1, i, j] * products[i, j]
        energies[i, 0] = 0.5 * of_inertia * total


@numba.njit(cache=True, nogil=True)
def _elastic(stiffness, fields, energies):  # type: ignore[no-untyped-def]
    """Fill in the energy that the elastic stiffness stores [J]."""
    forces = np.empty(fields.shape[1:])
    write_symmetric_products(stiffness, fields[0], forces)
    for i in range(len(forces)):
        total = 0.0
        for j in range(forces.shape[1]):
            total += fields[0, i, j] * forces[i, j]
        energies[i, 1] = 0.5 * total
