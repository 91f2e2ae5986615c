"""Steps of a reduced body with flat counterfaces in 2D, compiled.

In the coordinates z of the basis, mass is the identity and stiffness K diagonal, so that the matrix A of a step
(:mod:`fingerslip.dynamics.step.stepper`) is diagonal, too, and a step is two products with L, which holds the
displacement of the candidates per coordinate ::

    y = A^-1 b,    contact finds r from L (z~ + c_u y),    x = y + A^-1 L^T r

Dampers of rigid bodies add few rows to A and to the damping (:mod:`fingerslip.dynamics.reduced.reduction`).

Forces that a step must not count are those of :mod:`fingerslip.dynamics.step.release`.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats, Integers
from fingerslip.contact.interface import compiled_settle, contact_problem, flat_motion, in_components
from fingerslip.contact.solve.compliance import active_product
from fingerslip.contact.solve.partition import solve_partitions
from fingerslip.dynamics.step.release import dropped_forces, mark_changes
from fingerslip.linear.symmetric import weighted_rows

#: What :attr:`Motion.energies` holds: stored, and dissipated or put in since the start.
ENERGIES = ("kinetic", "strain", "contact", "friction", "damping", "numerical", "external_work")
_FADED = 1e-16


class Body(NamedTuple):
    """What stays the same from step to step, with m coordinates and n candidates."""

    stiffness: Floats  # (m,) [1/s^2]
    damping: Floats  # (m,) [1/s]
    effective: Floats  # (m,), A without dampers, D
    dampers: Floats  # (r,), what dampers add to the damping of the interface [kg/s]
    damped: Floats  # (r, m), displacement per coordinate where they act, E
    relief: Floats  # (r, m), H
    local: Floats  # (n * 2, m), displacement of the candidates per coordinate, L
    frames: Floats  # (n, 2, 2), normals and tangents of the candidates [-]
    gaps: Floats  # (n,), gaps at the start [m]
    counterface: Integers  # (n,), counterface of each candidate
    springs: tuple[Floats, Floats]  # normal and tangential penalties times area, (n,) each [N/m]
    compliance: Floats  # (n * 2, n * 2), W [m/N]
    penalty: Floats  # (n, 2), compliance of the penalties [m/N]
    scale: Floats  # (n, 2), step lengths of the projection [N/m]
    factors: tuple[float, float, float, float, float]  # c_u, c_v, c_a, w_0, w_1 of the scheme
    prediction: Floats  # (2, 3), displacement and velocity without unknown from the state at the start
    remainder: float  # s of a release [-]
    # of da.dv and da.dz, and of dz with the unbalances of three times: the energy that the scheme dissipates
    dissipation: tuple[float, float, float, float, float]
    goal: float  # relative residual of contact [-]
    tolerance: float  # the largest that is accepted [-]


class Inverse(NamedTuple):
    """The arrays of :class:`fingerslip.contact.solve.partition.Partition`, changed in place."""

    inverse: Floats
    states: NDArray[np.int8]
    slopes: Floats
    updates: Integers


class Motion(NamedTuple):
    """The state of a motion, changed in place."""

    fields: Floats  # (5, m), displacement, velocity, acceleration, unbalance now and one step before
    load: Floats  # (m,) [m/s^2]
    forces: Floats  # (4, n, 2), contact forces in frames, W times them [m], in components, and these one step before
    relative: Floats  # (2, n, 2), gap and tangential displacement in frames, and displacement in components [m]
    release: Floats  # (2, n, 2), fading and cancelled forces [N]
    largest: Floats  # (1,), the largest force that was dropped [N]; 0 where nothing is left of a release
    slips: Floats  # (4, n), slip of the whole motion, since contact, of the last step [m], friction limit [N]
    states: NDArray[np.int8]  # (n,)
    energies: Floats  # (7,), see ENERGIES [J]


class Driving(NamedTuple):
    """What drives k steps."""

    counterfaces: Floats  # (k + 1, n_counterfaces, 2), their displacement, that at the start included [m]
    loads: Floats  # (k, m), on the coordinates at the ends
    friction: Floats  # (n,), coefficients [-]


class Records(NamedTuple):
    """What steps leave, step by step, the first axis of all arrays."""

    fields: Floats  # (k, 3, m), displacement, velocity, acceleration
    forces: Floats  # (k, 2, n, 2), in frames and in components [N]
    relative: Floats  # (k, n, 2), gap and tangential displacement [m]
    slips: Floats  # (k, 4, n)
    states: NDArray[np.int8]  # (k, n)
    energies: Floats  # (k, 7) [J]
    iterations: Integers  # (k,)
    residuals: Floats  # (k,)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def take_steps(body, inverse, motion, driving, solutions, records):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Take k steps; return how many were solved to the tolerance, before the first that was not.

    Of that, the records have the contact problem that was not solved, and the forces that were found. It is taken again
    with solutions (r, n, 2) [N] of the r problems of the first step, whose releases make several.
    """
    counterfaces, loads, friction = driving
    size, count = body.effective.size, len(body.gaps)
    free, unknown, moved = np.empty((2, size)), np.empty(size), np.empty((count, 2))
    before = motion.forces.copy(), motion.relative.copy(), motion.release.copy()
    fading = _on_coordinates(body, motion, 0)
    for step, load in enumerate(loads):
        _copy(motion.forces.ravel(), before[0].ravel())
        _copy(motion.relative.ravel(), before[1].ravel())
        _copy(motion.release.ravel(), before[2].ravel())
        _free_end(body, motion, counterfaces[step + 1], load, fading, free, unknown, moved)
        known = solutions if step == 0 else solutions[:0]
        solution = _contact(body, inverse, motion, before, moved, friction, known)
        forces, product, relative, response, dropped, residual, iterations = solution
        records.iterations[step], records.residuals[step] = iterations, residual
        if not residual <= body.tolerance:
            _copy(forces.ravel(), records.forces[step, 0].ravel())
            _copy(relative.ravel(), records.relative[step].ravel())
            return step
        components, shift = in_components(body.frames, forces), in_components(body.frames, response)
        for i in range(count):
            for k in range(2):
                motion.forces[0, i, k], motion.forces[1, i, k] = forces[i, k], product[i, k]
                motion.forces[2, i, k], motion.forces[3, i, k] = components[i, k], before[0][2, i, k]
                motion.relative[0, i, k], motion.relative[1, i, k] = relative[i, k], moved[i, k] + shift[i, k]
                dropped[i, k] += body.factors[4] * components[i, k]
        pushed = weighted_rows(body.local, dropped.ravel())
        _divide(body, pushed)
        for j in range(size):
            unknown[j] += pushed[j]
        fading = _on_coordinates(body, motion, 0)
        _finish(body, motion, free, unknown, load, fading)
        _settle(body, motion, before, friction, counterfaces[step], counterfaces[step + 1])
        _record(motion, records, step)
    return len(loads)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _divide(body, forces):  # type: ignore[no-untyped-def]
    """Divide forces (m,) by A."""
    for j in range(forces.size):
        forces[j] /= body.effective[j]
    if body.dampers.size:
        eased = weighted_rows(body.relief, _times(body.damped, forces))
        for j in range(forces.size):
            forces[j] -= eased[j]


@numba.njit(cache=True, nogil=True)
def _drag(body, velocity):  # type: ignore[no-untyped-def]
    """Return the forces (m,) of dampers at a velocity (m,)."""
    rates = _times(body.damped, velocity)
    for i in range(rates.size):
        rates[i] *= body.dampers[i]
    return weighted_rows(body.damped, rates)


@numba.njit(cache=True, nogil=True)
def _copy(source, target):  # type: ignore[no-untyped-def]
    """Copy a flat array into another."""
    for i in range(source.size):
        target[i] = source[i]


@numba.njit(cache=True, nogil=True)
def _on_coordinates(body, motion, row):  # type: ignore[no-untyped-def]
    """Return fading (row 0) or cancelled (row 1) forces of the release on the coordinates, (m,)."""
    if motion.largest[0] > 0.0:
        return weighted_rows(body.local, motion.release[row].ravel())
    return np.zeros(body.effective.size)


@numba.njit(cache=True, nogil=True)
def _record(motion, records, step):  # type: ignore[no-untyped-def]
    """Record the end of a step."""
    _copy(motion.fields[:3].ravel(), records.fields[step].ravel())
    _copy(motion.forces[0].ravel(), records.forces[step, 0].ravel())
    _copy(motion.forces[2].ravel(), records.forces[step, 1].ravel())
    _copy(motion.relative[0].ravel(), records.relative[step].ravel())
    _copy(motion.slips.ravel(), records.slips[step].ravel())
    _copy(motion.states, records.states[step])
    _copy(motion.energies, records.energies[step])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _free_end(body, motion, counterfaces, load, fading, free, halfway, moved):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Write the end of a step with no unknown (2, m), the unknown without contact (m,), and the candidates there [m].

    The end is displacement and velocity; `moved` (n, 2) is relative to the counterfaces.
    """
    of_displacement, _, _, start_weight, end_weight = body.factors
    reached = np.empty(halfway.size)
    for j in range(halfway.size):
        for row in range(2):
            weights = body.prediction[row]
            free[row, j] = weights[0] * motion.fields[0, j] + weights[1] * motion.fields[1, j]
            free[row, j] += weights[2] * motion.fields[2, j]
    drag = _drag(body, free[1])
    for j in range(halfway.size):
        resisting = body.stiffness[j] * free[0, j] + body.damping[j] * free[1, j] + drag[j]
        right = end_weight * (load[j] - resisting) + start_weight * motion.fields[3, j] + body.remainder * fading[j]
        halfway[j] = right
    _divide(body, halfway)
    for j in range(halfway.size):
        reached[j] = free[0, j] + of_displacement * halfway[j]
    candidates = _times(body.local, reached)
    for i in range(len(moved)):
        for k in range(2):
            moved[i, k] = candidates[2 * i + k] - counterfaces[body.counterface[i], k]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _contact(body, inverse, motion, before, moved, friction, solutions):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Solve the contact of a step; update the release.

    Returns forces in frames (n, 2) [N], W times them, gap and tangential displacement [m], what all forces do to the
    candidates in frames [m], dropped forces in components [N], residual and iterations; where the residual is too
    large, in place of the gap the problem.
    """
    forces_before, relative_before = before[0][0], before[1][0]
    free = flat_motion(body.frames, body.gaps, relative_before, motion.relative[1], moved)
    forces, product = forces_before.copy(), before[0][1].copy()
    added, cancelled, dropped = np.zeros_like(free), np.zeros_like(free), np.zeros_like(free)
    released = response = np.zeros_like(free)
    last, iterations, largest, rounds = np.zeros(len(free), dtype=np.int8), 0, motion.largest[0], 0
    while True:
        problem = contact_problem(free + released, forces_before, relative_before, body.springs[1])
        if rounds < len(solutions):
            forces = solutions[rounds].copy()
            product = active_product(body.compliance, forces)
        forces, product, residual, further, _ = solve_partitions(
            body.compliance,
            body.penalty,
            body.scale,
            problem,
            friction,
            body.goal,
            inverse.inverse,
            inverse.states,
            inverse.slopes,
            inverse.updates,
            forces,
            product,
            0,
            True,
        )
        iterations, rounds = iterations + further, rounds + 1
        if not residual <= body.tolerance:
            return forces, product, problem, response, dropped, residual, iterations
        response = released + product - body.penalty * forces
        relative = free + response
        if body.factors[2] == 0.0:
            break
        marks = mark_changes(forces_before, forces, relative_before, relative, body.springs[1], friction)
        if not (marks > last).any():
            break
        last = np.maximum(last, marks)
        weights = body.factors[3], body.factors[4], body.remainder
        added, cancelled = dropped_forces(last, before[0][2], before[0][3], before[2][1], body.frames, weights)
        largest = max(motion.largest[0], np.abs(added).max())
        dropped = added + cancelled
        # In frames, the displacement of the body under them, without the penalties.
        acting = _in_frames(body.frames, dropped, body.factors[4])
        released = active_product(body.compliance, acting) - body.penalty * acting
    _fade(body, motion, added, cancelled, largest)
    return forces, product, relative, response, dropped, residual, iterations


@numba.njit(cache=True, nogil=True)
def _fade(body, motion, added, cancelled, largest):  # type: ignore[no-untyped-def]
    """Update the release by what a step leaves (n, 2) and cancels (n, 2) [N]; it ends where nothing is left of it."""
    left = 0.0
    for i in range(len(added)):
        for k in range(2):
            motion.release[0, i, k] = body.remainder * motion.release[0, i, k] + added[i, k]
            motion.release[1, i, k] = cancelled[i, k]
            left = max(left, np.abs(motion.release[0, i, k]), np.abs(cancelled[i, k]))
    motion.largest[0] = largest if left > _FADED * largest else 0.0
    for i in range(len(added)):
        for k in range(2):
            if motion.largest[0] == 0.0:
                motion.release[0, i, k] = 0.0


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _finish(body, motion, free, unknown, load, fading):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Take the fields to the end of a step, and account for the energies of the body."""
    of_displacement, of_velocity, of_inertia, start_weight, end_weight = body.factors
    cancelled = _on_coordinates(body, motion, 1)
    of_rates, of_moves, earliest, first, last = body.dissipation
    kinetic = strain = work = damping = numerical = 0.0
    rates = np.empty(unknown.size)
    for j in range(unknown.size):
        rates[j] = motion.fields[1, j] + (free[1, j] + of_velocity * unknown[j])
    drag = _drag(body, rates)
    for j in range(unknown.size):
        displacement, velocity, acceleration = motion.fields[0, j], motion.fields[1, j], motion.fields[2, j]
        unbalance, unbalance_before = motion.fields[3, j], motion.fields[4, j]
        end, rate = free[0, j] + of_displacement * unknown[j], free[1, j] + of_velocity * unknown[j]
        inertia = of_inertia * unknown[j]
        left = (start_weight * unbalance - inertia + (fading[j] + cancelled[j])) / end_weight
        moved, pushed = end - displacement, inertia - acceleration
        kinetic += 0.5 * of_inertia * rate**2
        strain += 0.5 * body.stiffness[j] * end**2
        work += 0.5 * (motion.load[j] + load[j]) * moved
        damping += 0.5 * moved * (body.damping[j] * rates[j] + drag[j])
        numerical += of_rates * pushed * (rate - velocity) + of_moves * pushed * moved
        numerical += moved * (earliest * unbalance_before + first * unbalance + last * left)
        motion.fields[0, j], motion.fields[1, j], motion.fields[2, j] = end, rate, inertia
        motion.fields[3, j], motion.fields[4, j] = left, unbalance
        motion.load[j] = load[j]
    energies = motion.energies
    energies[0], energies[1] = kinetic, strain
    energies[4] += damping
    energies[5] += numerical
    energies[6] += work


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _settle(body, motion, before, friction, counterfaces_before, counterfaces):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Update slips and states, and account for the energies of the interface."""
    forces, relative, release = before
    inward = outward = 0.0
    for i in range(len(motion.states)):
        face = body.counterface[i]
        for k in range(2):
            acting = 0.5 * (forces[2, i, k] + motion.forces[2, i, k])
            acting += 0.5 * (release[0, i, k] + release[1, i, k] + motion.release[0, i, k] + motion.release[1, i, k])
            inward -= acting * (motion.relative[1, i, k] - relative[1, i, k])
            outward += acting * (counterfaces[face, k] - counterfaces_before[face, k])
    slips, states, (stored, stored_before, dissipated) = compiled_settle(
        forces[0],
        relative[0],
        motion.slips[0].copy(),
        motion.slips[1].copy(),
        motion.forces[0],
        motion.relative[0],
        friction,
        np.ones((len(friction), 1)),
        body.springs[0],
        body.springs[1],
    )
    _copy(slips.ravel(), motion.slips.ravel())
    _copy(states, motion.states)
    energies = motion.energies
    energies[2] = stored
    energies[3] += dissipated
    energies[5] += inward - (stored - stored_before) - dissipated
    energies[6] += outward


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _in_frames(frames, vectors, divisor):  # type: ignore[no-untyped-def]
    """Return vectors (n, 2) in the frames over a number, same shape."""
    result = np.empty_like(vectors)
    for i in range(len(vectors)):
        for k in range(2):
            result[i, k] = (frames[i, k, 0] * vectors[i, 0] + frames[i, k, 1] * vectors[i, 1]) / divisor
    return result


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def _times(matrix, vector):  # type: ignore[no-untyped-def]
    """Return a matrix (n, m) times a vector (m,)."""
    result = np.empty(len(matrix))
    for i in range(len(matrix)):
        row, total = matrix[i], 0.0
        for j in range(vector.size):
            total += row[j] * vector[j]
        result[i] = total
    return result
