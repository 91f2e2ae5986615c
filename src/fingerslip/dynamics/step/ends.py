"""The fields of several motions at the end of a step, compiled: matrices are read once for all of them."""

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
from fingerslip.linear.products import as_rows

__all__ = ["End", "ends"]

Array = NDArray[np.float64]

_NONE = np.zeros((0, 0))


@dataclass(frozen=True)
class End:
    """A motion at the end of a step.

    Parameters
    ----------
    displacement, velocity, acceleration : (n,) array
        [m], [m/s], [m/s^2].
    inertia : (n,) array
        Mass times acceleration [N].
    change : StepChange
        What the step has changed.
    kinetic, elastic : float
        Kinetic energy, and at small strain what the elastic stiffness stores, else 0 [J].
    """

    displacement: Array
    velocity: Array
    acceleration: Array
    inertia: Array
    change: StepChange
    kinetic: float
    elastic: float


def ends(
    stepper: Stepper,
    starts: Sequence[Prediction],
    unknowns: Array,
    added: Sequence[Array | None],
    *,
    is_small: bool,
) -> list[End]:
    """Return the ends of k motions that share matrices and scheme.

    Parameters
    ----------
    stepper : Stepper
        What stays the same in one of them.
    starts : sequence of Prediction
        The step of each before its substitution.
    unknowns : (k, n) array
        Its unknowns.
    added : sequence of (n,) array or None
        Forces in the equation of motion of each beside inertia and what is unbalanced, weighted [N].
    is_small : bool
        Whether strains are small, so that the elastic stiffness tells what is stored.
    """
    befores = [start.before for start in starts]
    fields, changes, energies = _ends(
        stepper.factors,
        is_small,
        stepper.compiled_mass,
        stepper.compiled_stiffness,
        as_rows([start.free.displacement for start in starts]),
        as_rows([start.free.velocity for start in starts]),
        unknowns,
        _some([start.prescribed for start in starts], unknowns),
        _some(added, unknowns),
        as_rows([before.displacement for before in befores]),
        as_rows([before.velocity for before in befores]),
        as_rows([before.inertia for before in befores]),
        as_rows([before.unbalance for before in befores]),
    )
    return list(map(_end, befores, fields, changes, zip(*energies.T.tolist(), strict=True)))


def _end(before: State, fields: Array, changes: Array, energies: tuple[float, float]) -> End:
    """Return the end of a motion from the rows of its fields and of their changes."""
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
def _ends(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    factors,
    is_small,
    mass,
    stiffness,
    free_displacement,
    free_velocity,
    unknowns,
    prescribed,
    added,
    displacement_before,
    velocity_before,
    inertia_before,
    unbalance_before,
):
    """Return fields of k motions, (k, 5, n), changes of some, (k, 3, n), and their energies, (k, 2).

    The fields are displacement, velocity, acceleration, inertia and unbalance, the changes those of displacement,
    velocity and inertia.
    """
    of_displacement, of_velocity, of_inertia, start_weight, end_weight = factors
    count, size = unknowns.shape
    # Few arrays: compiled code takes longer to return them than to fill them.
    fields, changes, energies = np.zeros((count, 5, size)), np.empty((count, 3, size)), np.zeros((count, 2))
    for i in range(count):
        displacement, velocity, acceleration = fields[i, 0], fields[i, 1], fields[i, 2]
        for j in range(size):
            displacement[j] = free_displacement[i, j] + of_displacement * unknowns[i, j]
            velocity[j] = free_velocity[i, j] + of_velocity * unknowns[i, j]
            acceleration[j] = of_inertia * unknowns[i, j]
        if prescribed.size:
            acceleration += prescribed[i]
    if of_inertia != 0.0:
        _inertia(mass, of_inertia, fields, energies)
    if is_small:
        # Nothing else in the step forms this product, so the balance of energies checks the substitutions.
        _elastic(stiffness, fields, energies)
    for i in range(count):
        inertia, unbalance = fields[i, 3], fields[i, 4]
        for j in range(size):
            force = start_weight * unbalance_before[i, j] - inertia[j]
            unbalance[j] = (force + added[i, j] if added.size else force) / end_weight
            changes[i, 0, j] = fields[i, 0, j] - displacement_before[i, j]
            changes[i, 1, j] = fields[i, 1, j] - velocity_before[i, j]
            changes[i, 2, j] = inertia[j] - inertia_before[i, j]
    return fields, changes, energies


@numba.njit(cache=True, nogil=True, fastmath={"reassoc"})
def _inertia(mass, of_inertia, fields, energies):  # type: ignore[no-untyped-def]
    """Fill in the inertia [N] and the kinetic energy [J]."""
    starts, columns, values = mass
    for row in range(fields.shape[2]):
        for i in range(fields.shape[0]):
            force = momentum = 0.0
            for entry in range(starts[row], starts[row + 1]):
                force += values[entry] * fields[i, 2, columns[entry]]
                momentum += values[entry] * fields[i, 1, columns[entry]]
            fields[i, 3, row] = force
            energies[i, 0] += 0.5 * of_inertia * fields[i, 1, row] * momentum


@numba.njit(cache=True, nogil=True, fastmath={"reassoc"})
def _elastic(stiffness, fields, energies):  # type: ignore[no-untyped-def]
    """Fill in the energy that the elastic stiffness stores [J].

    Half of a symmetric matrix would do, but its rows do not tell that a rigid motion has no force: what large motions
    then leave of the energy is rounding.
    """
    starts, columns, values = stiffness
    for row in range(fields.shape[2]):
        for i in range(fields.shape[0]):
            force = 0.0
            for entry in range(starts[row], starts[row + 1]):
                force += values[entry] * fields[i, 0, columns[entry]]
            energies[i, 1] += 0.5 * fields[i, 0, row] * force
