"""One quasi-static motion of a condensed body: each step is a contact problem.

A plate may be free along some axes. Along each free axis e the displacement q of the plate at the end of a step of
length h follows from its load F, the coefficient c of its damper, the stiffness s of its spring and the contact forces
f on the body::

    (c / h + s) q_1 = F_1 + (c / h) q_0 - e . sum f

so that the plate adds the same compliance, y = 1 / (c / h + s), to all its contact nodes, along e.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.candidates import Candidates, Counterfaces, check_outsiders
from fingerslip.contact.interface import InterfaceState, conditions, contact_problem, rest_state, settle
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.forces import solve_contact
from fingerslip.contact.solve.newton import ContactSolution, solve_friction
from fingerslip.contact.solve.partition import Partition
from fingerslip.contact.solve.working_set import WorkingSet
from fingerslip.contact.states import OPEN, STICK
from fingerslip.dynamics.statics.body import StaticBody
from fingerslip.dynamics.step.contact_step import GOAL, TOLERANCE
from fingerslip.dynamics.system.bodies import Motion, counterface_motion, largest_approach
from fingerslip.errors import ConvergenceError, InputError
from fingerslip.model.model import Contact
from fingerslip.model.programme import Phase, Ramp
from fingerslip.model.rigid_bodies import DIRECTIONS, Direction, RigidBody

__all__ = ["PRESCRIBED", "FreePlate", "StaticMotion", "free_plate", "static_motion"]

Floats = NDArray[np.float64]

_REPAIR = "simulate the model step by step"
# Share of the largest displacement that a programme may prescribe along a free axis by rounding.
_ZERO = 1e-9


@dataclass(frozen=True)
class FreePlate:
    """The free axes of a plate, for steps of one length."""

    axes: Floats  # (k, 3), unit vectors [-]
    compliance: Floats  # (k,), y, what a force on the plate moves it by in a step [m/N]
    drag: Floats  # (k,), c / h [N/m]
    loads: tuple[tuple[tuple[float, Ramp], ...], ...]  # forces along each axis [N] with their factors

    def unheld(self, time: float, before: Floats) -> Floats:
        """Return the displacements (k,) at the end of a step [m] if there were no contact.

        Arrays: time [s]; before (k,) [m].
        """
        force = [sum(value * ramp.at(time) for value, ramp in load) for load in self.loads]
        displacement: Floats = self.compliance * (np.array(force) + self.drag * before)
        return displacement

    def held(self, unheld: Floats, force: Floats) -> Floats:
        """Return the displacements (k,) [m] with a contact force (3,) on the body [N]."""
        displacement: Floats = unheld - self.compliance * (self.axes @ force)
        return displacement

    def shift(self, displacements: Floats) -> Floats:
        """Return the displacement of the plate (3,) [m] for those along its axes (k,)."""
        result: Floats = displacements @ self.axes
        return result

    def added(self, compliance: Floats) -> Floats:
        """Return the compliance of contact nodes (n_c * 3, n_c * 3) with that of the plate [m/N]."""
        along = np.tile(self.axes, len(compliance) // 3)
        return compliance + along.T @ (self.compliance[:, None] * along)


#: A plate that is free along no axis.
PRESCRIBED = FreePlate(np.zeros((0, 3)), np.zeros(0), np.zeros(0), ())


def free_plate(plate: RigidBody, motion: Motion, step: float) -> FreePlate:
    """Return the free axes of a plate.

    Units: step [s].
    """
    for number, direction in enumerate(plate.free):
        _check(f"bodies.free.{number}", plate, direction, motion)
    drag = np.array([plate.damping(direction) / step for direction in plate.free])
    stiffness = np.array([plate.stiffness(direction) for direction in plate.free])
    return FreePlate(
        np.eye(3)[[DIRECTIONS.index(direction) for direction in plate.free]].reshape(-1, 3),
        1.0 / (drag + stiffness),
        drag,
        tuple(tuple((getattr(load, direction), load.ramp) for load in plate.loads) for direction in plate.free),
    )


def _check(where: str, plate: RigidBody, direction: Direction, motion: Motion) -> None:
    if direction not in DIRECTIONS[:3]:
        raise InputError(where, f"is {direction}", "needs x, y or z, as the plate does not turn", _REPAIR)
    along = np.abs(motion.positions[:, DIRECTIONS.index(direction)]).max()
    if along > _ZERO * np.abs(motion.positions).max():
        raise InputError(where, f"is {direction}, along which the programme moves the plate", "needs an axis across it")
    if plate.velocity(direction):
        raise InputError(where, f"is {direction}, with a velocity at the start", "needs a plate at rest")
    if not (plate.stiffness(direction) or plate.damping(direction)):
        fault = f"is {direction}, along which contact alone holds the plate"
        raise InputError(where, fault, "needs a spring or a damper", _REPAIR)


Integers = NDArray[np.int64]

# Candidates are within this many times the approach of the counterface.
_NEAR = 1.25
# Unknowns up to which compiled code on all patches is faster; few of them touch, other than where contact is fine.
_FEW = 2000
# Steps between two looks at the nodes that must not touch.
_LOOK_EVERY = 8


@dataclass(frozen=True)
class StaticMotion:
    """What a motion came to."""

    time: Floats  # (n_times,), times of the steps, the start included [s]
    displacement: Floats  # (n_times, n_sites, 3), displacement of the recorded sites [m]
    counterface: Floats  # (n_times, 3), displacement of the counterface [m]
    force: Floats  # (n_times, 3), force on the body, in global components [N]
    contact_area: Floats  # (n_times,), area that touches [m^2], and the share of it that sticks [-]
    stick_ratio: Floats  # (n_times,), area that touches [m^2], and the share of it that sticks [-]
    state: NDArray[np.int8]  # (n_times, n_nodes), whether nodes are open, stick or slip
    rows: Integers  # (n_nodes,), these nodes among those of the body
    iterations: Integers  # (n_times,), iterations of the contact problem


@dataclass(frozen=True)
class _Setting:
    """What stays the same from step to step; `rows` are the contact nodes among those of the body.

    `compliance` has that of the plate where it is free.
    """

    rows: Integers
    candidates: Candidates
    counterfaces: Counterfaces
    motion: Motion
    frames: Floats
    compliance: Compliance
    plate: FreePlate


def static_motion(
    body: StaticBody,
    contact: Contact,
    programme: Sequence[Phase],
    step: float,
    *,
    plate: RigidBody | None = None,
    farthest: float = math.inf,
) -> StaticMotion:
    """Compute a motion of a condensed body.

    Units: step [s]; farthest [m].
    """
    setting = _setting(body, contact, contact.programme or programme, plate, step)
    times = _times(setting.motion, step)
    shifts, records = setting.motion.displacement(times), _Records(body, setting, times.size)
    gaps = setting.counterfaces.gaps(setting.candidates.positions, setting.candidates.counterface)
    state, working_set = rest_state(setting.candidates, gaps), None
    fallen, last = np.zeros(len(setting.plate.axes)), times.size - 1
    for number in range(1, times.size):
        time = float(times[number])
        unheld = setting.plate.unheld(time, fallen)
        free = _free_motion(setting, shifts[number] + setting.plate.shift(unheld))
        state, working_set, iterations = _step(setting, state, working_set, free, (step if number > 1 else 0.0, time))
        fallen = setting.plate.held(unheld, records.take(number, state, iterations))
        shifts[number] += setting.plate.shift(fallen)
        if np.linalg.norm(fallen) > farthest:
            last = number
        if number % _LOOK_EVERY == 0 or number == last:
            records.look(number, shifts[number], time)
        if number == last:
            break
    return records.motion(times[: last + 1], shifts[: last + 1])


def _times(motion: Motion, step: float) -> Floats:
    """Return whole steps until the end of a motion is reached [s]."""
    times: Floats = step * np.arange(math.ceil(motion.knots[-1] / step - 1e-9) + 1)
    return times


def _setting(
    body: StaticBody, contact: Contact, programme: Sequence[Phase], plate: RigidBody | None, step: float
) -> _Setting:
    """Return the contact nodes that a motion needs, and what stays the same in it."""
    plane = contact.counterface.at_start(np.vstack([body.positions, body.watched]))
    if not plane.is_flat:
        raise InputError("contact.counterface", "is curved", "needs a plane", "simulate the model step by step")
    motion = counterface_motion(programme, plane)
    free = PRESCRIBED if plate is None else free_plate(plate, motion, step)
    reach = _NEAR * largest_approach(motion, plane)
    rows = np.flatnonzero(plane.gap(body.positions) <= reach)
    if not rows.size:
        raise InputError("programme", f"reaches {1e3 * reach:.4g} mm", "needs a press that touches a contact node")
    candidates = _candidates(body, contact, rows)
    counterfaces = Counterfaces((plane,), (contact.friction,))
    frames = counterfaces.frames(candidates.positions, candidates.counterface)
    stiffness = [candidates.normal_stiffness, *[candidates.tangential_stiffness] * 2]
    element = free.added(np.ascontiguousarray(body.compliance[np.ix_(_dofs(rows), _dofs(rows))]))
    compliance = Compliance(element, 1.0 / np.stack(stiffness, 1), frames)
    return _Setting(rows, candidates, counterfaces, motion, frames, compliance, free)


def _candidates(body: StaticBody, contact: Contact, rows: Integers) -> Candidates:
    stiffness = []
    for kind in ("normal", "tangential"):
        penalty = getattr(contact, f"{kind}_penalty")
        if penalty is None:
            raise InputError(f"contact.{kind}_penalty", "is missing", "needs a value, as no cell is looked at here")
        stiffness.append(penalty * body.area[rows])
    none = np.zeros(rows.size, dtype=np.int64)
    return Candidates(body.nodes[rows], none, body.positions[rows], body.area[rows], *stiffness)


def _dofs(rows: Integers) -> Integers:
    dofs: Integers = (3 * rows[:, None] + np.arange(3)).ravel()
    return dofs


def _free_motion(setting: _Setting, shift: Floats) -> Floats:
    """Return gap and tangential displacement of the nodes (n, 3), relative to the plane, without contact forces [m]."""
    free: Floats = np.einsum("cij,j->ci", setting.frames, -shift)
    free[:, 0] = setting.counterfaces.gaps(setting.candidates.positions - shift, setting.candidates.counterface)
    return free


def _step(
    setting: _Setting,
    before: InterfaceState,
    working_set: WorkingSet | Partition | None,
    free: Floats,
    over: tuple[float, float],
) -> tuple[InterfaceState, WorkingSet | Partition | None, int]:
    """Return the interface after a step, what the next one starts from, and the iterations it took.

    `over` is the length of the step before, 0 where there is none, and the time at the end of this one [s].
    """
    candidates, compliance = setting.candidates, setting.compliance
    limits = conditions(candidates, before, *over)
    friction = setting.counterfaces.coefficients(limits, candidates.counterface)
    problem = contact_problem(candidates, before, free)
    solution, working_set = _contact(compliance, problem, friction, before, working_set)
    if not solution.residual <= TOLERANCE:
        node = int(candidates.nodes[solution.worst])
        raise ConvergenceError(over[1], node, solution.residual, TOLERANCE, "try another time step, or less friction")
    response = compliance.response(solution.forces) if solution.response is None else solution.response
    stretch = np.ones((len(free), 2))
    after = settle(
        candidates, before, solution.forces, free + response, friction_coefficient=friction, stretch=stretch, work=0.0
    )
    return after.state, working_set, solution.iterations


def _contact(
    compliance: Compliance,
    problem: Floats,
    friction: Floats,
    before: InterfaceState,
    working_set: WorkingSet | Partition | None,
) -> tuple[ContactSolution, WorkingSet | Partition | None]:
    """Return the contact forces of a step, and what the next one starts from."""
    if problem.size > _FEW:
        return solve_contact(compliance, problem, friction, before.forces, GOAL, working_set=working_set)
    return solve_friction(compliance.matrix, problem, friction, before.forces, GOAL), None


class _Records:
    """Forces and states of all steps, filled one by one."""

    def __init__(self, body: StaticBody, setting: _Setting, count: int) -> None:
        self._body, self._setting = body, setting
        size, dofs = setting.rows.size, _dofs(setting.rows)
        self._forces, self._states = np.zeros((count, size, 3)), np.zeros((count, size), dtype=np.int8)
        self._iterations = np.zeros(count, dtype=np.int64)
        self._at_sites, self._at_watched = body.at_sites[:, dofs], body.at_watched[:, dofs]

    def take(self, number: int, state: InterfaceState, iterations: int) -> Floats:
        """Take the interface after a step; return the force on the body (3,) [N]."""
        self._forces[number] = np.einsum("cij,ci->cj", self._setting.frames, state.forces)
        self._states[number], self._iterations[number] = state.state, iterations
        force: Floats = self._forces[number].sum(axis=0)
        return force

    def look(self, number: int, shift: Floats, time: float) -> None:
        """Refuse a step in which a node that must not touch does."""
        watched = self._body.watched
        moved = (self._at_watched @ self._forces[number].ravel()).reshape(watched.shape)
        gaps = self._setting.counterfaces.shapes[0].gap(watched + moved - shift)
        check_outsiders(gaps, np.arange(len(gaps)), watched, time)

    def motion(self, times: Floats, shifts: Floats) -> StaticMotion:
        """Return what the steps until the last of the given times came to."""
        area, count = self._setting.candidates.area, times.size
        forces, states, iterations = self._forces[:count], self._states[:count], self._iterations[:count]
        whole, sticking = (states != OPEN) @ area, (states == STICK) @ area
        ratio = np.divide(sticking, whole, out=np.full(count, np.nan), where=whole > 0.0)
        moved = (forces.reshape(count, -1) @ self._at_sites.T).reshape(count, -1, 3)
        return StaticMotion(
            times, moved, shifts, forces.sum(axis=1), whole, ratio, states, self._setting.rows, iterations
        )
