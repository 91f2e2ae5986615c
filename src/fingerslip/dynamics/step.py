"""One time step: state in, state out."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.interface import InterfaceState, StepOutcome, contact_problem, rest_state, settle
from fingerslip.contact.solver import ContactSolution, solve_friction
from fingerslip.dynamics.condensation import Condensed, condense, condensed_solve
from fingerslip.dynamics.energy import Energies, integration_dissipation
from fingerslip.dynamics.factor import factorise
from fingerslip.dynamics.scheme import HHT, Predictor, hht, predict
from fingerslip.dynamics.system import System
from fingerslip.errors import ConvergenceError
from fingerslip.materials import RayleighDamping
from fingerslip.model import TimeStepping

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
    scheme : HHT
        Time integration.
    damping : RayleighDamping
        Material damping.
    condensed : Condensed
        The effective matrix, factorised and condensed.
    compliance : (m, m) array
        Compliance of a step on the candidates with that of the penalties on its diagonal [m/N].
    """

    system: System
    scheme: HHT
    damping: RayleighDamping
    condensed: Condensed
    compliance: Array

    @property
    def force_weight(self) -> float:
        """Weight 1 + alpha of the forces at the end of a step."""
        return 1.0 + self.scheme.alpha

    @property
    def bare_compliance_factor(self) -> float:
        """Local displacement at the end of a step per local acceleration and force weight [s^2]."""
        return self.force_weight * self.scheme.displacement_factor


@dataclass(frozen=True)
class State:
    """The motion at one time, on the free degrees of freedom.

    Parameters
    ----------
    time : float
        [s].
    displacement, velocity, acceleration : (n,) array
        [m], [m/s], [m/s^2].
    inertia : (n,) array
        Mass times acceleration [N].
    unbalance, unbalance_before : (n,) array
        Unbalanced force C v + K u - f now and one step earlier [N].
    bodies : (n_bodies, dim) array
        Displacement of the rigid bodies [m].
    interface : InterfaceState
        The contact candidates.
    energies : Energies
        The balance so far.
    iterations : int
        Iterations of the contact solver in the last step.
    residual : float
        Its relative residual.
    """

    time: float
    displacement: Array
    velocity: Array
    acceleration: Array
    inertia: Array
    unbalance: Array
    unbalance_before: Array
    bodies: Array
    interface: InterfaceState
    energies: Energies
    iterations: int = 0
    residual: float = 0.0


def build_stepper(system: System, time: TimeStepping, damping: RayleighDamping) -> Stepper:
    """Factorise and condense for a fixed step."""
    scheme = hht(time.step, time.alpha)
    weight = 1.0 + scheme.alpha
    stiffness_part = scheme.displacement_factor + scheme.velocity_factor * damping.stiffness
    mass_part = 1.0 + weight * scheme.velocity_factor * damping.mass
    effective = mass_part * system.mass + weight * stiffness_part * system.stiffness
    condensed = condense(sparse.csr_matrix(effective), system.local)
    penalties = np.column_stack(
        [system.candidates.normal_stiffness] + [system.candidates.tangential_stiffness] * (system.space.dim - 1)
    )
    compliance = weight * scheme.displacement_factor * condensed.compliance + np.diag(1.0 / penalties.ravel())
    return Stepper(system, scheme, damping, condensed, np.ascontiguousarray(compliance))


def first_state(stepper: Stepper) -> State:
    """Return the state at rest at time zero, with the acceleration that the loads give it."""
    system = stepper.system
    rest = np.zeros(len(system.free))
    load = system.load
    factor = factorise(system.mass) if load.any() else None
    acceleration = factor.backward(factor.forward(load)) if factor else rest
    return State(
        time=0.0,
        displacement=rest,
        velocity=rest,
        acceleration=acceleration,
        inertia=load,
        unbalance=-load,
        unbalance_before=-load,
        bodies=np.zeros((len(system.motions), system.space.dim)),
        interface=rest_state(system.candidates),
        energies=Energies(),
    )


def advance(stepper: Stepper, state: State, time: float, bodies: Array, watch: Stopwatch) -> State:
    """Take one step of the HHT-alpha scheme with frictional contact.

    Parameters
    ----------
    stepper : Stepper
        What stays the same.
    state : State
        State at the start of the step.
    time : float
        Time at its end [s].
    bodies : (n_bodies, dim) array
        Displacement of the rigid bodies at its end [m].
    watch : Stopwatch
        Takes the times of substitution, contact and energies.

    Raises
    ------
    ConvergenceError
        Where the contact problem was not solved.
    """
    system, scheme = stepper.system, stepper.scheme
    predicted = predict(scheme, state.displacement, state.velocity, state.acceleration)
    predicted_relative = _relative(system, predicted.displacement, bodies)
    right_hand_side = _right_hand_side(stepper, state, predicted)
    outcome: list[tuple[StepOutcome, ContactSolution]] = []

    def contact(local_acceleration: Array) -> Array:
        with watch.part("contact"):
            free = predicted_relative + scheme.displacement_factor * local_acceleration.reshape(-1, system.space.dim)
            outcome.append(_solve_contact(stepper, state.interface, free, time))
        return outcome[-1][1].forces.ravel()

    with watch.part("solve"):
        acceleration, _ = condensed_solve(stepper.condensed, right_hand_side, stepper.force_weight, contact)
    settled, solution = outcome[0]
    inertia = system.mass @ acceleration
    after = State(
        time=time,
        displacement=predicted.displacement + scheme.displacement_factor * acceleration,
        velocity=predicted.velocity + scheme.velocity_factor * acceleration,
        acceleration=acceleration,
        inertia=inertia,
        unbalance=(scheme.alpha * state.unbalance - inertia) / stepper.force_weight,
        unbalance_before=state.unbalance,
        bodies=bodies,
        interface=settled.state,
        energies=state.energies,
        iterations=solution.iterations,
        residual=solution.residual,
    )
    with watch.part("recording"):
        return _with_energies(stepper, state, after, settled)


def _relative(system: System, displacement: Array, bodies: Array) -> Array:
    """Return gap and relative tangential displacement of the candidates, shape (n_c, dim) [m]."""
    candidates = system.candidates
    relative: Array = (system.local @ displacement).reshape(-1, system.space.dim)
    if bodies.size:
        relative = relative - np.einsum("cij,cj->ci", candidates.frames, bodies[candidates.body])
        relative[:, 0] += candidates.gap
    return relative


def _right_hand_side(stepper: Stepper, state: State, predicted: Predictor) -> Array:
    system, damping = stepper.system, stepper.damping
    force = system.stiffness @ (predicted.displacement + damping.stiffness * predicted.velocity)
    if damping.mass:
        force = force + damping.mass * (system.mass @ predicted.velocity)
    total: Array = stepper.force_weight * (system.load - force) + stepper.scheme.alpha * state.unbalance
    return total


def _solve_contact(
    stepper: Stepper, before: InterfaceState, free_relative: Array, time: float
) -> tuple[StepOutcome, ContactSolution]:
    candidates = stepper.system.candidates
    free = contact_problem(candidates, before, free_relative)
    solution = solve_friction(stepper.compliance, free, candidates.friction_coefficient, before.forces, _TOLERANCE)
    if not solution.residual <= _TOLERANCE:
        raise ConvergenceError(
            time,
            int(candidates.nodes[solution.worst]) if candidates.nodes.size else -1,
            solution.residual,
            _TOLERANCE,
            "try a smaller time step, softer contact penalties or less friction",
        )
    bare = stepper.bare_compliance_factor * (stepper.condensed.compliance @ solution.forces.ravel())
    relative = free_relative + bare.reshape(free_relative.shape)
    return settle(candidates, before, solution.forces, relative), solution


def _with_energies(stepper: Stepper, before: State, after: State, settled: StepOutcome) -> State:
    """Complete the energy balance of a step."""
    system, damping = stepper.system, stepper.damping
    change = after.displacement - before.displacement
    momentum = system.mass @ after.velocity
    elastic = system.stiffness @ after.displacement
    damped = 0.0
    if damping.mass or damping.stiffness:
        mean = 0.5 * (before.velocity + after.velocity)
        damped = float(change @ (damping.mass * (system.mass @ mean) + damping.stiffness * (system.stiffness @ mean)))
    numerical = integration_dissipation(
        stepper.scheme,
        displacement_change=change,
        velocity_change=after.velocity - before.velocity,
        inertia_change=after.inertia - before.inertia,
        unbalance_change=after.unbalance - before.unbalance_before,
    )
    energies = before.energies.after(
        kinetic=0.5 * float(after.velocity @ momentum),
        strain=0.5 * float(after.displacement @ elastic),
        contact=settled.stored,
        friction=settled.friction,
        damping=damped,
        numerical=numerical + settled.numerical,
        work=_external_work(system, before, after, change),
    )
    return _replace_energies(after, energies)


def _external_work(system: System, before: State, after: State, change: Array) -> float:
    """Return the work of the tractions and of whoever moves the rigid bodies [J]."""
    work = float(system.load @ change)
    if after.bodies.size:
        moved = (after.bodies - before.bodies)[system.candidates.body]
        local = np.einsum("cij,cj->ci", system.candidates.frames, moved)
        work += 0.5 * float(np.sum((before.interface.forces + after.interface.forces) * local))
    return work


def _replace_energies(state: State, energies: Energies) -> State:
    return State(**{**vars(state), "energies": energies})
