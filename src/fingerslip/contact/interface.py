"""The contact interface over a step: from motion without contact forces to forces, states, slip and energies.

The contact law of a node with tributary area A, all quantities in the node's frame::

    gap          g = distance from the counterface, negative is penetration
    pressure     p = k_n max(0, -g)
    trial        t* = t_0 - k_t (d - d_0)
    return       t = t* where |t*| <= mu p (stick), t = mu p t* / |t*| elsewhere (slip)
    slip         s = d - d_0 + (t - t_0) / k_t

with the penalties k_n and k_t [Pa/m], the tangential displacement d relative to the counterface [m], and the values d_0
and t_0 at the start of the step: penalty contact with return mapping (Simo & Laursen 1992). An open node has t_0 = 0.
Nodal forces are tractions [Pa] times A [m^2].
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.candidates import Candidates
from fingerslip.contact.friction import Conditions
from fingerslip.contact.states import OPEN, SLIP, STICK

# Of forces at the friction limit, and of slip over the elastic slip there.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class InterfaceState:
    """The contact candidates at one time."""

    forces: Floats  # (n_c, dim) [N]
    relative: Floats  # (n_c, dim), gap, and tangential displacement relative to the counterface [m]
    slip_distance: Floats  # (n_c,), slip accumulated over the whole motion [m]
    slip_since_contact: Floats  # (n_c,), slip accumulated since the node came into contact [m]
    slip: Floats  # (n_c,), slip of the last step [m]
    state: NDArray[np.int8]  # (n_c,)
    limit: Floats  # (n_c,), largest friction force that the node bears, in the direction of that which acts on it [N]


@dataclass(frozen=True)
class StepOutcome:
    """What a step did to the interface."""

    state: InterfaceState  # the interface at the end of the step
    stored: float  # energy in the penalty springs at the end [J]
    friction: float  # energy that friction dissipated in the step [J]
    numerical: float  # energy that the implicit step of the contact law lost [J]


def rest_state(candidates: Candidates, gaps: Floats) -> InterfaceState:
    """Return the interface at the start, without forces; `gaps` (n_c,) are those of the reference state [m]."""
    count, dim = len(candidates.nodes), candidates.dim
    relative = np.zeros((count, dim))
    relative[:, 0] = gaps
    none = np.zeros(count)
    return InterfaceState(np.zeros((count, dim)), relative, none, none, none, np.full(count, OPEN, dtype=np.int8), none)


def conditions(candidates: Candidates, before: InterfaceState, step: float, time: float) -> Conditions:
    """Return what the friction laws of a step may depend on, from the interface at its start.

    Units: step [s], the length of the step before, in which the last slip was, 0 for the first; time [s], the end.
    """
    rate = before.slip / step if step else np.zeros_like(before.slip)
    return Conditions(before.forces[:, 0] / candidates.area, rate, before.slip_since_contact, time)


@numba.njit(cache=True, nogil=True)
def contact_problem(free_relative, forces, relative, stiffness):  # type: ignore[no-untyped-def]
    """Return q of :mod:`fingerslip.contact.solve.newton`, shape (n_c, dim) [m].

    The normal part is the gap. The tangential part is the motion of the step, less the elastic slip at its start.

    Arrays: free_relative, relative (n_c, dim) [m]; forces (n_c, dim) [N]; stiffness (n_c,), tangential [N/m].
    """
    free = free_relative.copy()
    for i in range(len(free)):
        for k in range(1, free.shape[1]):
            free[i, k] -= forces[i, k] / stiffness[i] + relative[i, k]
    return free


@numba.njit(cache=True, nogil=True)
def flat_motion(frames, gaps, before, moved_before, moved):  # type: ignore[no-untyped-def]
    """Return gap and relative tangential displacement (n_c, dim) [m] on flat counterfaces.

    Arrays: frames (n_c, dim, dim) [-]; gaps (n_c,) [m]; before (n_c, dim) [m]; moved_before, moved (n_c, dim) [m].
    """
    motion = np.empty_like(moved)
    for i in range(len(moved)):
        for k in range(moved.shape[1]):
            motion[i, k] = before[i, k] if k else gaps[i]
            for j in range(moved.shape[1]):
                motion[i, k] += frames[i, k, j] * (moved[i, j] - moved_before[i, j] if k else moved[i, j])
    return motion


@numba.njit(cache=True, nogil=True)
def in_components(frames, forces):  # type: ignore[no-untyped-def]
    """Return forces (n, dim) in frames in global components, same shape."""
    components = np.zeros_like(forces)
    for i in range(len(forces)):
        for k in range(forces.shape[1]):
            for j in range(forces.shape[1]):
                components[i, j] += frames[i, k, j] * forces[i, k]
    return components


def settle(
    candidates: Candidates,
    before: InterfaceState,
    forces: Floats,
    relative: Floats,
    *,
    friction_coefficient: Floats,
    stretch: Floats,
    work: float,
) -> StepOutcome:
    """Update states, slip and energies with the contact forces of a step.

    Arrays: forces (n_c, dim) [N]; relative (n_c, dim) [m]; friction_coefficient (n_c,) [-]; stretch (n_c, dim - 1)
    [-]; work [J].

    Examples
    --------
    Two nodes with springs of 400 and 100 N/m, pressed in by 10 mm, are moved on by 15 and by 50 mm under mu = 0.5. The
    first sticks. The second slips, by all of its motion but the 20 mm that stretch its spring to the friction limit:

    >>> from dataclasses import replace
    >>> from fingerslip.contact.solve.newton import solve_friction
    >>> node = np.arange(2)
    >>> springs = Candidates(node, 0 * node, np.zeros((2, 2)), np.ones(2), np.full(2, 400.0), np.full(2, 100.0))
    >>> before = replace(rest_state(springs, np.full(2, -0.01)), forces=np.array([[4.0, 0.0], [4.0, 0.0]]))
    >>> relative, mu = np.array([[-0.01, 0.015], [-0.01, 0.05]]), np.full(2, 0.5)
    >>> compliance = np.diag([1 / 400, 1 / 100] * 2)
    >>> problem = contact_problem(relative, before.forces, before.relative, springs.tangential_stiffness)
    >>> forces = solve_friction(compliance, problem, mu, before.forces, 1e-12).forces
    >>> tangents = np.ones((2, 1))
    >>> after = settle(springs, before, forces, relative, friction_coefficient=mu, stretch=tangents, work=0.0).state
    >>> after.forces.round(9).tolist(), after.state.tolist(), after.slip.round(9).tolist()
    ([[4.0, -1.5], [4.0, -2.0]], [1, 2], [0.0, 0.03])
    """
    stiffnesses = candidates.normal_stiffness, candidates.tangential_stiffness
    slips = before.slip_distance, before.slip_since_contact
    (whole, since, slip, limit), state, (stored, stored_before, friction) = compiled_settle(
        before.forces, before.relative, *slips, forces, relative, friction_coefficient, stretch, *stiffnesses
    )
    after = InterfaceState(forces, relative, whole, since, slip, state, limit)
    return StepOutcome(after, stored, friction, work - (stored - stored_before) - friction)


@numba.njit(cache=True, nogil=True)
def compiled_settle(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    forces_before,
    relative_before,
    slip_distance,
    slip_since_contact,
    forces,
    relative,
    friction,
    stretch,
    normal_stiffness,
    tangential_stiffness,
):
    """Return slips and limits (4, n_c) and states; energies stored now and before, and of friction."""
    count, dim = forces.shape
    # In one array, which compiled code returns faster than four.
    numbers, states = np.zeros((4, count)), np.full(count, OPEN, dtype=np.int8)
    distances, since_contact, slips, limits = numbers[0], numbers[1], numbers[2], numbers[3]
    stored, stored_before, dissipated = 0.0, 0.0, 0.0
    for i in range(count):
        distances[i] = slip_distance[i]
        squared = tangential = tangential_before = length = 0.0
        for k in range(1, dim):
            change = (forces[i, k] - forces_before[i, k]) / tangential_stiffness[i]
            slip = relative[i, k] - relative_before[i, k] + change
            squared += (slip / stretch[i, k - 1]) ** 2
            dissipated -= forces[i, k] * slip
            tangential += forces[i, k] ** 2
            tangential_before += forces_before[i, k] ** 2
            length += (stretch[i, k - 1] * forces[i, k]) ** 2
        stored += 0.5 * (forces[i, 0] ** 2 / normal_stiffness[i] + tangential / tangential_stiffness[i])
        stored_before += 0.5 * (
            forces_before[i, 0] ** 2 / normal_stiffness[i] + tangential_before / tangential_stiffness[i]
        )
        if forces[i, 0] > 0.0:
            limit = friction[i] * forces[i, 0]
            limits[i] = limit * np.sqrt(length / tangential) if tangential > 0.0 else limit
            at_limit = np.sqrt(tangential) >= limit * (1.0 - _ROUNDING)
            # Friction is at its limit where a slide has just ended, too: what does not move, sticks.
            moves = limit == 0.0 or np.sqrt(squared) > _ROUNDING * limit / tangential_stiffness[i]
            slides = at_limit and moves
            states[i] = SLIP if slides else STICK
            # A node that lands during the step has moved freely for part of it: that is no slip.
            if slides and forces_before[i, 0] > 0.0:
                slips[i] = np.sqrt(squared)
            distances[i] += slips[i]
            since_contact[i] = slip_since_contact[i] + slips[i]
    return numbers, states, (stored, stored_before, dissipated)
