"""One time step of one motion or of several that share a matrix: states in, states out."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.interface import InterfaceState, StepOutcome, conditions, contact_problem, rest_state, settle
from fingerslip.contact.solve.forces import solve_contact
from fingerslip.contact.solve.newton import ContactSolution
from fingerslip.contact.solve.working_set import WorkingSet
from fingerslip.dynamics.energy import Energies
from fingerslip.dynamics.scheme import Predictor, StepChange
from fingerslip.dynamics.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system import System
from fingerslip.errors import ConvergenceError
from fingerslip.linear.factorisation import factorise
from fingerslip.linear.threads import allowed_threads

__all__ = ["State", "advance", "first_state"]

Array = NDArray[np.float64]

# Relative to the largest contact force. Light nodes answer a residual force with accelerations a hundredfold as
# large, relative to the largest: at the goal these are those of the full system to 1e-9 also where slip turns in
# space. Where rounding keeps a step from the goal, up to the tolerance it is still far finer than what is reported.
_GOAL = 1e-12
_TOLERANCE = 1e-10


@dataclass(frozen=True)
class State:
    """The motion at one time, on the system's unknowns.

    Parameters
    ----------
    time : float
        [s].
    displacement, velocity, acceleration : (n,) array
        [m], [m/s], [m/s^2].
    inertia : (n,) array
        Mass times acceleration [N].
    load : (n,) array
        Forces of loads and drives [N].
    unbalance, unbalance_before : (n,) array
        Unbalanced force C v + K u - f now and one step earlier [N].
    counterfaces : (n_bodies, dim) array
        Prescribed displacement of the counterfaces [m].
    moved : (n_c, dim) array
        Displacement of the candidates relative to their counterfaces [m].
    contact_forces : (n_c, dim) array
        Forces of the counterfaces on the candidates in global components [N].
    interface : InterfaceState
        The contact candidates in their frames.
    energies : Energies
        The balance so far.
    iterations : int
        Iterations of the contact solver in the last step.
    residual : float
        Its relative residual.
    working_set : WorkingSet or None
        What the contact solver keeps for the next step.
    """

    time: float
    displacement: Array
    velocity: Array
    acceleration: Array
    inertia: Array
    load: Array
    unbalance: Array
    unbalance_before: Array
    counterfaces: Array
    moved: Array
    contact_forces: Array
    interface: InterfaceState
    energies: Energies
    iterations: int = 0
    residual: float = 0.0
    working_set: WorkingSet | None = None


@dataclass(frozen=True)
class _Begun:
    """A step before its substitution: where it starts, and where it goes without forces at its end."""

    state: State
    time: float
    counterfaces: Array
    load: Array
    predicted: Predictor
    moved: Array
    right_hand_side: Array


@dataclass(frozen=True)
class _ContactStep:
    """What the contact problem of a step is, and what came of it."""

    frames: Array
    coefficients: Array
    relative: Array
    solution: ContactSolution
    working_set: WorkingSet | None


def first_state(stepper: Stepper) -> State:
    """Return the state at time zero, with the acceleration that loads and damping give it."""
    system, damping, candidates = stepper.system, stepper.damping, stepper.system.candidates
    velocity, load = system.initial_velocity, system.load(0.0)
    damped = damping.mass * (system.mass @ velocity) + damping.stiffness * (system.stiffness @ velocity)
    inertia = (load - damped) * stepper.scheme.inertia_factor
    factor = factorise(system.mass) if inertia.any() else None
    none = np.zeros((len(candidates.nodes), system.space.dim))
    return State(
        time=0.0,
        displacement=np.zeros_like(velocity),
        velocity=velocity,
        acceleration=factor.backward(factor.forward(inertia)) if factor else np.zeros_like(velocity),
        inertia=inertia,
        load=load,
        unbalance=damped - load,
        unbalance_before=damped - load,
        counterfaces=np.zeros((len(system.motions), system.space.dim)),
        moved=none,
        contact_forces=none,
        interface=rest_state(candidates, system.counterfaces.gaps(candidates.positions, candidates.counterface)),
        energies=Energies(kinetic=_kinetic(stepper, velocity), initial=_kinetic(stepper, velocity)),
    )


def advance(
    steppers: Sequence[Stepper], states: Sequence[State], time: float, counterfaces: Sequence[Array], watch: Stopwatch
) -> list[State]:
    """Take one step of several motions with one factorised matrix.

    Parameters
    ----------
    steppers : sequence of Stepper
        What stays the same in each motion; made together by :func:`fingerslip.dynamics.stepper.build_steppers`.
    states : sequence of State
        Their states at the start of the step.
    time : float
        Time at its end [s].
    counterfaces : sequence of (n_bodies, dim) array
        Prescribed displacement of their counterfaces at its end [m].
    watch : Stopwatch
        Takes the times of substitution, contact and energies.

    Raises
    ------
    ConvergenceError
        Where the contact problem was not solved.
    """
    begun = [
        _begin(stepper, state, time, shift)
        for stepper, state, shift in zip(steppers, states, counterfaces, strict=True)
    ]
    condensed, weight = steppers[0].condensed, steppers[0].scheme.end_weight
    steps: list[_ContactStep] = []

    def contact(given: Array) -> Array:
        with watch.part("contact"):
            unknown = given.reshape(len(given), len(begun))
            steps.extend(_solve_contacts(steppers, begun, unknown))
            forces = np.zeros_like(unknown)
            for number, (stepper, step) in enumerate(zip(steppers, steps, strict=True)):
                forces[stepper.rows, number] = np.einsum("cij,ci->cj", step.frames, step.solution.forces).ravel()
        return forces.reshape(given.shape)

    with watch.part("solve"):
        sides = [start.right_hand_side for start in begun]
        # A single vector is quicker than a matrix with one column.
        unknowns, _ = condensed.solve(sides[0] if len(sides) == 1 else np.stack(sides).T, weight, contact)
    with watch.part("recording"):
        return [
            _finish(stepper, start, np.ascontiguousarray(unknown), step)
            for stepper, start, unknown, step in zip(
                steppers, begun, unknowns.reshape(-1, len(begun)).T, steps, strict=True
            )
        ]


def _begin(stepper: Stepper, state: State, time: float, counterfaces: Array) -> _Begun:
    """Carry a state to the end of a step as if nothing forced it there."""
    predicted = stepper.scheme.predict(state.displacement, state.velocity, state.acceleration)
    load = stepper.system.load(time)
    return _Begun(
        state=state,
        time=time,
        counterfaces=counterfaces,
        load=load,
        predicted=predicted,
        moved=_moved(stepper.system, predicted.displacement, counterfaces),
        right_hand_side=_right_hand_side(stepper, state, predicted, load),
    )


def _finish(stepper: Stepper, start: _Begun, unknown: Array, step: _ContactStep) -> State:
    """Return the state at the end of a step."""
    system, scheme, state, predicted = stepper.system, stepper.scheme, start.state, start.predicted
    displacement = predicted.displacement + scheme.displacement_factor * unknown
    acceleration = scheme.inertia_factor * unknown
    inertia = system.mass @ acceleration
    after = replace(
        state,
        time=start.time,
        displacement=displacement,
        velocity=predicted.velocity + scheme.velocity_factor * unknown,
        acceleration=acceleration,
        inertia=inertia,
        load=start.load,
        unbalance=(scheme.start_weight * state.unbalance - inertia) / scheme.end_weight,
        unbalance_before=state.unbalance,
        counterfaces=start.counterfaces,
        moved=_moved(system, displacement, start.counterfaces),
        contact_forces=np.einsum("cij,ci->cj", step.frames, step.solution.forces),
        iterations=step.solution.iterations,
        residual=step.solution.residual,
        working_set=step.working_set,
    )
    return _settled(stepper, state, after, step)


def _moved(system: System, displacement: Array, counterfaces: Array) -> Array:
    """Return the displacement of the candidates relative to their counterfaces, shape (n_c, dim) [m]."""
    moved: Array = (system.relative @ displacement).reshape(-1, system.space.dim)
    return moved - counterfaces[system.candidates.counterface] if counterfaces.size else moved


def _right_hand_side(stepper: Stepper, state: State, predicted: Predictor, load: Array) -> Array:
    system, damping = stepper.system, stepper.damping
    force = system.stiffness @ (predicted.displacement + damping.stiffness * predicted.velocity)
    if damping.mass:
        force = force + damping.mass * (system.mass @ predicted.velocity)
    total: Array = stepper.scheme.end_weight * (load - force) + stepper.scheme.start_weight * state.unbalance
    return total


def _solve_contacts(steppers: Sequence[Stepper], begun: Sequence[_Begun], unknown: Array) -> list[_ContactStep]:
    """Find the contact forces of all motions, side by side where they are several: most of it is compiled."""
    tasks = [
        (stepper, start, unknown[stepper.rows, number].reshape(start.moved.shape))
        for number, (stepper, start) in enumerate(zip(steppers, begun, strict=True))
    ]
    threads = min(len(tasks), allowed_threads())
    if threads == 1:
        return [_solve_contact(*task) for task in tasks]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(lambda task: _solve_contact(*task), tasks))


def _solve_contact(stepper: Stepper, start: _Begun, unknown: Array) -> _ContactStep:
    """Find the contact forces of a step.

    The frames of curved counterfaces are those at the predicted motion, about which the gap is linear; `unknown`
    (n_c, dim) is the candidates' part of the unknowns without contact forces.
    """
    system, candidates = stepper.system, stepper.system.candidates
    state, before, moved = start.state, start.state.interface, start.moved
    free = moved + stepper.scheme.displacement_factor * unknown
    points = candidates.positions + moved
    frames = stepper.flat_frames
    if frames is None:
        frames = system.counterfaces.frames(points, candidates.counterface)
    beyond = np.einsum("cij,cj->ci", frames, free - moved)
    relative = before.relative + np.einsum("cij,cj->ci", frames, free - state.moved)
    relative[:, 0] = system.counterfaces.gaps(points, candidates.counterface) + beyond[:, 0]
    compliance = stepper.compliance if stepper.flat_frames is not None else replace(stepper.compliance, frames=frames)
    coefficients = system.counterfaces.coefficients(
        conditions(candidates, before, stepper.scheme.step, start.time), candidates.counterface
    )
    problem = contact_problem(candidates, before, relative)
    solution, working_set = solve_contact(
        compliance, problem, coefficients, before.forces, _GOAL, working_set=state.working_set
    )
    if not solution.residual <= _TOLERANCE:
        raise ConvergenceError(
            start.time,
            int(candidates.nodes[solution.worst]) if candidates.nodes.size else -1,
            solution.residual,
            _TOLERANCE,
            "try a smaller time step, softer contact penalties or less friction",
        )
    response = compliance.response(solution.forces) if solution.response is None else solution.response
    return _ContactStep(frames, coefficients, relative + response, solution, working_set)


def _settled(stepper: Stepper, before: State, after: State, step: _ContactStep) -> State:
    """Complete a step with what it did to the interface and to the energies."""
    mean_forces = 0.5 * (before.contact_forces + after.contact_forces)
    settled = settle(
        stepper.system.candidates,
        before.interface,
        step.solution.forces,
        step.relative,
        friction_coefficient=step.coefficients,
        stretch=np.linalg.norm(step.frames[:, 1:], axis=2),
        work=-float(np.sum(mean_forces * (after.moved - before.moved))),
    )
    return replace(after, interface=settled.state, energies=_energies(stepper, before, after, settled, mean_forces))


def _energies(stepper: Stepper, before: State, after: State, settled: StepOutcome, mean_forces: Array) -> Energies:
    """Complete the energy balance of a step."""
    system, damping = stepper.system, stepper.damping
    change = after.displacement - before.displacement
    damped = 0.0
    if damping.mass or damping.stiffness:
        mean = 0.5 * (before.velocity + after.velocity)
        damped = float(change @ (damping.mass * (system.mass @ mean) + damping.stiffness * (system.stiffness @ mean)))
    numerical = stepper.scheme.dissipation(
        StepChange(
            displacement=change,
            velocity=after.velocity - before.velocity,
            inertia=after.inertia - before.inertia,
            unbalance=(before.unbalance_before, before.unbalance, after.unbalance),
        )
    )
    work = 0.5 * float((before.load + after.load) @ change)
    if after.counterfaces.size:
        work += float(np.sum(mean_forces * (after.counterfaces - before.counterfaces)[system.candidates.counterface]))
    return before.energies.after(
        kinetic=_kinetic(stepper, after.velocity),
        strain=0.5 * float(after.displacement @ (system.stiffness @ after.displacement)),
        contact=settled.stored,
        friction=settled.friction,
        damping=damped,
        numerical=numerical + settled.numerical,
        work=work,
    )


def _kinetic(stepper: Stepper, velocity: Array) -> float:
    """Return the kinetic energy [J]; none where nothing has inertia."""
    return 0.5 * stepper.scheme.inertia_factor * float(velocity @ (stepper.system.mass @ velocity))
