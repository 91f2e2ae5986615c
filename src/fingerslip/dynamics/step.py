"""One time step: state in, state out."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.active import solve_contact
from fingerslip.contact.compliance import Compliance
from fingerslip.contact.interface import InterfaceState, StepOutcome, contact_problem, rest_state, settle
from fingerslip.contact.krylov import WorkSet
from fingerslip.contact.solver import ContactSolution
from fingerslip.dynamics.condensation import Condensed, condense
from fingerslip.dynamics.energy import Energies, integration_dissipation
from fingerslip.dynamics.factor import factorise
from fingerslip.dynamics.scheme import Predictor, Scheme, Static, hht, predict
from fingerslip.dynamics.system import System
from fingerslip.errors import ConvergenceError
from fingerslip.materials import RayleighDamping
from fingerslip.model import QuasiStatic, TimeStepping

__all__ = ["State", "Stepper", "Stopwatch", "advance", "build_stepper", "first_state"]

Array = NDArray[np.float64]

# Relative to the largest contact force. The solver reaches 1e-12 and better; a hundredfold of that is still
# a thousand times finer than any quantity that is reported.
_TOLERANCE = 1e-10


@dataclass
class Stopwatch:
    """Seconds spent in each part of the work."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Add the time that the block takes to `name`."""
        start = clock.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + clock.perf_counter() - start


@dataclass(frozen=True)
class Stepper:
    """All that stays the same from step to step.

    Parameters
    ----------
    system : System
        Matrices and candidates.
    scheme : HHT or Static
        Time integration.
    damping : RayleighDamping
        Material damping.
    condensed : Condensed
        The effective matrix, factorised and condensed.
    compliance : Compliance
        Compliance of a step on the candidates.
    flat_frames : (n_c, dim, dim) array or None
        Frames of the candidates where all bodies are planes, so that they never turn; `compliance` is in them then.
    """

    system: System
    scheme: Scheme
    damping: RayleighDamping
    condensed: Condensed
    compliance: Compliance
    flat_frames: Array | None

    @property
    def force_weight(self) -> float:
        """Weight 1 + alpha of the forces at the end of a step."""
        return 1.0 + self.scheme.alpha


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
    bodies : (n_bodies, dim) array
        Prescribed displacement of the rigid bodies [m].
    moved : (n_c, dim) array
        Displacement of the candidates relative to their bodies [m].
    contact_forces : (n_c, dim) array
        Forces of the rigid bodies on the candidates in global components [N].
    interface : InterfaceState
        The contact candidates in their frames.
    energies : Energies
        The balance so far.
    iterations : int
        Iterations of the contact solver in the last step.
    residual : float
        Its relative residual.
    work : WorkSet or None
        What it keeps for the next step.
    """

    time: float
    displacement: Array
    velocity: Array
    acceleration: Array
    inertia: Array
    load: Array
    unbalance: Array
    unbalance_before: Array
    bodies: Array
    moved: Array
    contact_forces: Array
    interface: InterfaceState
    energies: Energies
    iterations: int = 0
    residual: float = 0.0
    work: WorkSet | None = None


@dataclass(frozen=True)
class _ContactStep:
    """What the contact problem of a step is, and what came of it."""

    frames: Array
    coefficients: Array
    relative: Array
    solution: ContactSolution
    work: WorkSet | None


def build_stepper(system: System, time: TimeStepping | QuasiStatic, damping: RayleighDamping) -> Stepper:
    """Factorise and condense for a fixed step."""
    scheme = Static(time.step) if isinstance(time, QuasiStatic) else hht(time.step, time.alpha)
    weight = 1.0 + scheme.alpha
    stiffness_part = scheme.displacement_factor + scheme.velocity_factor * damping.stiffness
    mass_part = scheme.inertia_factor + weight * scheme.velocity_factor * damping.mass
    effective = mass_part * system.mass + weight * stiffness_part * system.stiffness
    condensed, of_body = condense(sparse.csr_matrix(effective), system.relative)
    candidates = system.candidates
    stiffness = [candidates.normal_stiffness] + [candidates.tangential_stiffness] * (system.space.dim - 1)
    # A force at the end of the step has the weight 1 + alpha, a unit of the unknown the displacement factor.
    compliance = Compliance(
        weight * scheme.displacement_factor * of_body, 1.0 / np.column_stack(stiffness)
    )
    frames = None
    if system.surfaces.flat:
        frames = system.surfaces.frames(candidates.positions, candidates.body)
        compliance = compliance.turned(frames)
    return Stepper(system, scheme, damping, condensed, compliance, frames)


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
        bodies=np.zeros((len(system.motions), system.space.dim)),
        moved=none,
        contact_forces=none,
        interface=rest_state(candidates, system.surfaces.gaps(candidates.positions, candidates.body)),
        energies=Energies(kinetic=_kinetic(stepper, velocity), initial=_kinetic(stepper, velocity)),
    )


def advance(stepper: Stepper, state: State, time: float, bodies: Array, watch: Stopwatch) -> State:
    """Take one step with frictional contact.

    Parameters
    ----------
    stepper : Stepper
        What stays the same.
    state : State
        State at the start of the step.
    time : float
        Time at its end [s].
    bodies : (n_bodies, dim) array
        Prescribed displacement of the rigid bodies at its end [m].
    watch : Stopwatch
        Takes the times of substitution, contact and energies.

    Raises
    ------
    ConvergenceError
        Where the contact problem was not solved.
    """
    system, scheme = stepper.system, stepper.scheme
    predicted = predict(scheme, state.displacement, state.velocity, state.acceleration)
    load = system.load(time)
    right_hand_side = _right_hand_side(stepper, state, predicted, load)
    moved = _moved(system, predicted.displacement, bodies)
    steps: list[_ContactStep] = []

    def contact(unknown: Array) -> Array:
        with watch.part("contact"):
            free = moved + scheme.displacement_factor * unknown.reshape(moved.shape)
            steps.append(_solve_contact(stepper, state, moved, free, time))
            forces: Array = np.einsum("cij,ci->cj", steps[-1].frames, steps[-1].solution.forces)
            return forces.ravel()

    with watch.part("solve"):
        unknown, forces = stepper.condensed.solve(right_hand_side, stepper.force_weight, contact)
    displacement = predicted.displacement + scheme.displacement_factor * unknown
    acceleration = scheme.inertia_factor * unknown
    inertia = system.mass @ acceleration
    after = replace(
        state,
        time=time,
        displacement=displacement,
        velocity=predicted.velocity + scheme.velocity_factor * unknown,
        acceleration=acceleration,
        inertia=inertia,
        load=load,
        unbalance=(scheme.alpha * state.unbalance - inertia) / stepper.force_weight,
        unbalance_before=state.unbalance,
        bodies=bodies,
        moved=_moved(system, displacement, bodies),
        contact_forces=forces.reshape(moved.shape),
        iterations=steps[0].solution.iterations,
        residual=steps[0].solution.residual,
        work=steps[0].work,
    )
    with watch.part("recording"):
        return _settled(stepper, state, after, steps[0])


def _moved(system: System, displacement: Array, bodies: Array) -> Array:
    """Return the displacement of the candidates relative to their bodies, shape (n_c, dim) [m]."""
    moved: Array = (system.relative @ displacement).reshape(-1, system.space.dim)
    return moved - bodies[system.candidates.body] if bodies.size else moved


def _right_hand_side(stepper: Stepper, state: State, predicted: Predictor, load: Array) -> Array:
    system, damping = stepper.system, stepper.damping
    force = system.stiffness @ (predicted.displacement + damping.stiffness * predicted.velocity)
    if damping.mass:
        force = force + damping.mass * (system.mass @ predicted.velocity)
    total: Array = stepper.force_weight * (load - force) + stepper.scheme.alpha * state.unbalance
    return total


def _solve_contact(stepper: Stepper, state: State, moved: Array, free: Array, time: float) -> _ContactStep:
    """Find the contact forces of a step.

    The frames of curved bodies are those at the predicted motion `moved`, about which the gap is linear; `free`
    is the motion without contact forces. Both are relative to the bodies, shape (n_c, dim) [m].
    """
    system, candidates, before = stepper.system, stepper.system.candidates, state.interface
    points = candidates.positions + moved
    frames = stepper.flat_frames
    if frames is None:
        frames = system.surfaces.frames(points, candidates.body)
    beyond = np.einsum("cij,cj->ci", frames, free - moved)
    relative = before.relative + np.einsum("cij,cj->ci", frames, free - state.moved)
    relative[:, 0] = system.surfaces.gaps(points, candidates.body) + beyond[:, 0]
    compliance = stepper.compliance if stepper.flat_frames is not None else replace(stepper.compliance, frames=frames)
    coefficients = system.surfaces.coefficients(
        before.forces[:, 0] / candidates.area, before.slip / stepper.scheme.step, candidates.body
    )
    problem = contact_problem(candidates, before, relative)
    solution, work = solve_contact(compliance, problem, coefficients, before.forces, _TOLERANCE, state.work)
    if not solution.residual <= _TOLERANCE:
        raise ConvergenceError(
            time,
            int(candidates.nodes[solution.worst]) if candidates.nodes.size else -1,
            solution.residual,
            _TOLERANCE,
            "try a smaller time step, softer contact penalties or less friction",
        )
    return _ContactStep(frames, coefficients, relative + compliance.response(solution.forces), solution, work)


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
    numerical = integration_dissipation(
        stepper.scheme,
        displacement_change=change,
        velocity_change=after.velocity - before.velocity,
        inertia_change=after.inertia - before.inertia,
        unbalance=(before.unbalance_before, before.unbalance, after.unbalance),
    )
    work = 0.5 * float((before.load + after.load) @ change)
    if after.bodies.size:
        work += float(np.sum(mean_forces * (after.bodies - before.bodies)[system.candidates.body]))
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
