"""One quasi-static motion of a condensed body: each step is a contact problem.

A plate may be free along some axes. Along each free axis e the displacement q of the plate at the end of a step of
length h follows from its load F, the coefficient c of its damper, the stiffness s of its spring and the contact forces
f on the body::

    (c / h + s) q_1 = F_1 + (c / h) q_0 - e . sum f

so that the plate adds the same compliance, y = 1 / (c / h + s), to all its contact nodes, along e.

A body at large strain answers in each step by the tangent of that of its states which is nearest to where the step
before left its patches.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats, Integers
from fingerslip.contact.candidates import Candidates, Counterfaces, check_outsiders
from fingerslip.contact.counterfaces import rotate_compliance
from fingerslip.contact.interface import InterfaceState, rest_state, settle
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.partition import Partition
from fingerslip.contact.solve.working_set import WorkingSet
from fingerslip.contact.states import OPEN, STICK
from fingerslip.dynamics.loop import Integrator, Loop, Observer
from fingerslip.dynamics.statics.body import REPAIR, StaticBody, shear_distances
from fingerslip.dynamics.step.contact_step import solve_law
from fingerslip.dynamics.step.stepper import Stopwatch, penalty_compliance
from fingerslip.dynamics.system.bodies import Motion, counterface_motion, largest_approach
from fingerslip.errors import InputError
from fingerslip.fe.space import vector_dofs
from fingerslip.model.model import Contact
from fingerslip.model.programme import Phase, Press, phase_duration
from fingerslip.model.rigid_bodies import DIRECTIONS, Direction, RigidBody

# Share of the largest displacement that a programme may prescribe along a free axis by rounding.
_ZERO = 1e-9


def _check(where: str, plate: RigidBody, direction: Direction, motion: Motion) -> None:
    if direction not in DIRECTIONS[:3]:
        raise InputError(where, f"is {direction}", "needs x, y or z, as the plate does not turn", REPAIR)
    along = np.abs(motion.positions[:, DIRECTIONS.index(direction)]).max()
    if along > _ZERO * np.abs(motion.positions).max():
        raise InputError(where, f"is {direction}, along which the programme moves the plate", "needs an axis across it")
    if plate.velocity(direction):
        raise InputError(where, f"is {direction}, with a velocity at the start", "needs a plate at rest")
    if not (plate.stiffness(direction) or plate.damping(direction)):
        fault = f"is {direction}, along which contact alone holds the plate"
        raise InputError(where, fault, "needs a spring or a damper", REPAIR)


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
    displacement: Floats  # (n_times, n_sites, dim), displacement of the recorded sites [m]
    counterface: Floats  # (n_times, dim), displacement of the counterface [m]
    force: Floats  # (n_times, dim), force on the body, in global components [N]
    contact_area: Floats  # (n_times,), area that touches [m^2]
    stick_ratio: Floats  # (n_times,), the share of it that sticks [-]
    state: NDArray[np.int8]  # (n_times, n_nodes), whether nodes are open, stick or slip
    rows: Integers  # (n_nodes,), these nodes among those of the body
    iterations: Integers  # (n_times,), iterations of the contact problem


def static_motion(
    body: StaticBody,
    contact: Contact,
    programme: Sequence[Phase],
    step: float,
    *,
    plate: RigidBody | None = None,
    farthest: float = math.inf,
) -> StaticMotion:
    """Compute a motion of a condensed body in steps [s], until its plate has moved farthest [m].

    That of a pressed body begins where the first phase, the press, ends.
    """
    steps = _Steps(body, contact, contact.programme or programme, plate or RigidBody(1.0), step)
    count = math.ceil((steps.motion.knots[-1] - steps.begin) / step - 1e-9)
    times = steps.begin + step * np.arange(count + 1)
    records = _Records(steps)
    loop = Loop(steps, [records], [times], Stopwatch())
    while loop.steps_taken < loop.n_steps and np.linalg.norm(loop.states[0].plate) <= farthest:
        loop.step()
    loop.finish()
    return records.motion(times)


@dataclass(frozen=True)
class _State:
    """The contact nodes and the plate at one time."""

    time: float  # [s]
    step: float  # length of the last step [s]; 0 at the start
    interface: InterfaceState  # the contact nodes in their frames
    forces: Floats  # (n, dim), contact forces in global components [N]
    plate: Floats  # (k,), displacement of the plate along its free axes [m]
    shift: Floats  # (dim,), displacement of the plate [m]
    nearest: int = 0  # state of the body by whose answers it moved here
    working_set: WorkingSet | Partition | None = None  # what the contact solver keeps for the next step
    iterations: int = 0  # iterations of the contact problem


class _Steps(Integrator[_State]):
    """One motion, step by step."""

    def __init__(
        self, body: StaticBody, contact: Contact, programme: Sequence[Phase], plate: RigidBody, step: float
    ) -> None:
        plane = contact.counterface.at_start(body.skin)
        if not plane.is_flat:
            raise InputError("contact.counterface", "is curved", "needs a plane", REPAIR)
        self.body, self._step, self.motion = body, step, counterface_motion(programme, plane)
        for number, direction in enumerate(plate.free):
            _check(f"bodies.free.{number}", plate, direction, self.motion)
        # Of the free axes of the plate (k, dim) its drag c / h [N/m], and y, what a force moves it by in a step [m/N].
        self._plate = plate
        self._axes = np.reshape([np.eye(plane.dim)[DIRECTIONS.index(along)] for along in plate.free], (-1, plane.dim))
        self._drag = np.array([plate.damping(along) / step for along in plate.free])
        self._give = 1.0 / (self._drag + np.array([plate.stiffness(along) for along in plate.free]))
        reach = _NEAR * largest_approach(self.motion, plane)
        # The contact nodes among those of the body.
        self.rows = np.flatnonzero((plane.gap(body.positions) <= reach) | body.is_pressed)
        if not self.rows.size:
            fault = f"reaches {1e3 * reach:.4g} mm"
            raise InputError("programme", fault, "needs a press that touches a contact node")
        penalties = contact.normal_penalty, contact.tangential_penalty
        for kind, penalty in zip(("normal", "tangential"), penalties, strict=True):
            if penalty is None:
                raise InputError(f"contact.{kind}_penalty", "is missing", "needs a value, as no cell is looked at here")
        area, nodes, none = body.area[self.rows], body.nodes[self.rows], np.zeros(self.rows.size, dtype=np.int64)
        springs = [(penalty or 0.0) * area for penalty in penalties]
        self.candidates = Candidates(nodes, none, body.positions[self.rows], area, *springs)
        self.counterfaces = Counterfaces((plane,), (contact.friction,))
        self._frames = self.counterfaces.frames(self.candidates.positions, none)
        self._dofs = vector_dofs(self.rows, plane.dim).ravel()
        # At once, or at the end of the press that the body has behind it [s].
        self.begin = 0.0
        if body.is_pressed:
            press, depth = programme[0], float(np.linalg.norm(body.shift))
            if not isinstance(press, Press) or abs(press.depth - depth) > _ZERO * depth:
                allowed = f"needs the press of the body, by {1e3 * depth:.6g} mm"
                raise InputError("programme.0", f"is {press}", allowed)
            self.begin = phase_duration(press)
        # A motion comes near to some of many states.
        self._compliances: dict[int, Compliance] = {}

    def _compliance(self, state: int) -> Compliance:
        """Return the compliance of the contact nodes by a state of the body, with that of a free plate."""
        if state not in self._compliances:
            of_body = np.ascontiguousarray(self.body.compliance[state][np.ix_(self._dofs, self._dofs)])
            along = np.tile(self._axes, self.rows.size)
            in_frames = rotate_compliance(of_body + along.T @ (self._give[:, None] * along), self._frames)
            flexible = penalty_compliance(self.candidates)
            self._compliances[state] = Compliance(in_frames, flexible, edition=(float(state),))
        return self._compliances[state]

    def displacement(self, state: _State, rows: slice) -> Floats:
        """Return the displacement of some rows of the body's answers [m]."""
        forces = np.zeros_like(self.body.positions)
        forces[self.rows] = state.forces
        answers = self.body.answers[state.nearest, rows]
        return np.asarray(self.body.unloaded_displacement[state.nearest, rows] + answers @ forces.ravel())

    def start(self) -> dict[int, _State]:
        """Return the state at time zero, or at the end of the press."""
        nodes, body = self.candidates, self.body
        shift = self.motion.displacement(np.array([self.begin]))[0]
        forces = np.ascontiguousarray(body.forces[0, self.rows])
        moved = body.moved[0, self._dofs].reshape(forces.shape)
        # The state was pressed by an upright counterface: another one has dragged the skin by what it moved otherwise.
        relative = np.einsum("cij,cj->ci", self._frames, moved - body.shift)
        relative[:, 0] = self.counterfaces.gaps(nodes.positions + moved - shift, nodes.counterface)
        in_frames = np.einsum("cij,cj->ci", self._frames, forces)
        interface = replace(rest_state(nodes, relative[:, 0]), forces=in_frames, relative=relative)
        if body.is_pressed:
            interface = replace(interface, state=np.where(in_frames[:, 0] > 0.0, STICK, OPEN).astype(np.int8))
        return {0: _State(self.begin, 0.0, interface, forces, np.zeros(len(self._axes)), shift)}

    def advance(self, states: Mapping[int, _State], ends: Floats) -> dict[int, list[_State]]:
        """Take the next step."""
        before, time, nodes = states[0], float(ends[0]), self.candidates
        prescribed = self.motion.displacement(ends[:1])[0]
        force = np.zeros(len(self._axes))
        for load in self._plate.loads:
            force += load.ramp.at(time) * np.array([getattr(load, along) for along in self._plate.free])
        unheld = self._give * (force + self._drag * before.plate)
        nearest, interface = self._nearest(before), before.interface
        unloaded = self.body.unloaded_displacement[nearest, self._dofs].reshape(nodes.positions.shape)
        moved = unloaded - prescribed - unheld @ self._axes
        free: Floats = np.einsum("cij,cj->ci", self._frames, moved)
        free[:, 0] = self.counterfaces.gaps(nodes.positions + moved, nodes.counterface)
        # What the contact solver keeps belongs to one compliance.
        warm = interface.forces, before.working_set if nearest == before.nearest else None
        problem = self._compliance(nearest), self._frames, free, interface
        contact = solve_law((nodes, self.counterfaces), *problem, over=(before.step, time), warm=warm, few=_FEW)
        settled = settle(
            nodes,
            interface,
            contact.solution.forces,
            contact.relative,
            friction_coefficient=contact.coefficients,
            stretch=np.ones((len(free), nodes.dim - 1)),
            work=0.0,
        )
        plate: Floats = unheld - self._give * (self._axes @ contact.forces.sum(axis=0))
        shift, solved = prescribed + plate @ self._axes, (contact.working_set, contact.solution.iterations)
        return {0: [_State(time, self._step, settled.state, contact.forces, plate, shift, nearest, *solved)]}

    def _nearest(self, state: _State) -> int:
        """Return which state of the body is the nearest to where its patches are."""
        body = self.body
        if len(body.answers) == 1:
            return 0
        patches, shape = slice(body.positions.size), body.positions.shape
        moved = self.displacement(state, patches).reshape(shape)
        return int(np.argmin(shear_distances(moved, body.moved[:, patches].reshape(-1, *shape), body.forces[0])))


class _Records(Observer[_State]):
    """Forces and states of all steps."""

    def __init__(self, steps: _Steps) -> None:
        self._steps = steps
        self._rows: list[tuple[Floats, NDArray[np.int8], int, Floats, Floats]] = []

    def record(self, state: _State) -> None:
        """Record the next state; of every few, look at it."""
        number, self._last = len(self._rows), state
        sites = self._steps.displacement(state, self._steps.body.site_rows)
        self._rows.append((state.forces, state.interface.state, state.iterations, state.shift, sites))
        if number and number % _LOOK_EVERY == 0:
            self.finish()

    def finish(self) -> None:
        """Refuse a last state in which a node that must not touch does."""
        steps, watched = self._steps, self._steps.body.watched
        moved = steps.displacement(self._last, steps.body.watched_rows).reshape(watched.shape)
        plane = steps.counterfaces.shapes[0]
        gaps = plane.gap(watched + moved - self._last.shift)
        nodes = np.arange(len(gaps))
        check_outsiders(gaps, nodes, watched, self._last.time, shape=plane, number=0, searched=None)

    def motion(self, times: Floats) -> StaticMotion:
        """Return what the steps that were taken came to."""
        forces, states, iterations, shifts, sites = map(np.array, zip(*self._rows, strict=True))
        count, area = len(states), self._steps.candidates.area
        whole, sticking = (states != OPEN) @ area, (states == STICK) @ area
        return StaticMotion(
            time=times[:count],
            displacement=sites.reshape(count, -1, self._steps.candidates.dim),
            counterface=shifts,
            force=forces.sum(axis=1),
            contact_area=whole,
            stick_ratio=np.divide(sticking, whole, out=np.full(count, np.nan), where=whole > 0.0),
            state=states,
            rows=self._steps.rows,
            iterations=iterations,
        )
