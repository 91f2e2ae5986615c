"""Steps of a reduced body in 2D by compiled code, many at a time; what keeps them from it, the log says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.interface import InterfaceState, conditions
from fingerslip.contact.solve.newton import solve_friction
from fingerslip.contact.solve.partition import first_partition
from fingerslip.dynamics.compact.kernel import ENERGIES, Body, Driving, Inverse, Motion, Records, take_steps
from fingerslip.dynamics.compact.supports import MovingSupports
from fingerslip.dynamics.loop import BodyIntegrator
from fingerslip.dynamics.reduced.reduction import ByModes
from fingerslip.dynamics.step.contact_step import GOAL, TOLERANCE, unsolved
from fingerslip.dynamics.step.release import remainder
from fingerslip.dynamics.step.state import State, first_state
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.system.bodies import Load
from fingerslip.dynamics.system.system import System

# What of a state stands in what is carried.
_CARRIED = ("inertia", "load", "unbalance", "unbalance_before", "moved", "contact_forces_before")
_NOT_KEPT: dict[str, Any] = dict.fromkeys(_CARRIED, np.zeros(0))
# Unknowns of contact up to which an inverse of all of them is kept.
_FEW = 900
# Contact problems of one step: releases add to each other, and are few.
_MOST_SOLUTIONS = 10


def obstacle(stepper: Stepper) -> str | None:
    """Say what keeps compiled code from taking the steps of a motion in a basis; None where it takes them."""
    unknowns = stepper.system.candidates.positions.size
    reasons = {
        "it is in 3D": stepper.system.space.dim != 2,
        "a counterface is curved or turns": stepper.compliance.frames is None,
        "what may touch moves with a support": stepper.system.relative[:, stepper.system.coordinates.moving].nnz,
        f"{unknowns} unknowns of contact are none or more than {_FEW}": not 0 < unknowns <= _FEW,
    }
    return next((reason for reason, holds in reasons.items() if holds), None)


class Compact(BodyIntegrator):
    """Motions whose steps compiled code takes; see :class:`fingerslip.dynamics.loop.BodyIntegrator`."""

    def __init__(self, steppers: Sequence[Stepper]) -> None:
        self._motions = list(map(_Steps, steppers))

    @property
    def steppers(self) -> Sequence[Stepper]:
        """What stays the same in each motion."""
        return [motion.stepper for motion in self._motions]

    def start(self) -> dict[int, State]:
        """Return the states at time zero."""
        return {number: motion.start() for number, motion in enumerate(self._motions)}

    def advance(
        self,
        states: Mapping[int, State],
        ends: Floats,
        length: float | None = None,  # noqa: ARG002
    ) -> dict[int, list[State]]:
        """Take steps to times (k,) [s]; see :meth:`fingerslip.dynamics.loop.Integrator.advance`."""
        return {number: self._motions[number].advance(state, ends) for number, state in states.items()}

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self._motions[0].steer(replace(self.steppers[0], system=system))


class _Steps:
    """The compiled steps of one motion."""

    def __init__(self, stepper: Stepper) -> None:
        assert isinstance(stepper.condensed, ByModes)
        assert stepper.compliance.frames is not None
        self.stepper = stepper
        diagonal, self._interface = stepper.condensed.diagonal, stepper.condensed.interface
        system, scheme, candidates = stepper.system, stepper.scheme, stepper.system.candidates
        stiffness = system.stiffness.diagonal()[: diagonal.size]
        compliance = stepper.compliance
        self._loads = self._loads_on_coordinates()
        self._supports = MovingSupports(stepper) if system.coordinates.moving.size else None
        self._open = first_partition(compliance.matrix, compliance.penalty)
        self._body = Body(
            stiffness=stiffness,
            damping=stepper.damping.mass + stepper.damping.stiffness * stiffness,
            effective=diagonal,
            dampers=np.zeros(0) if system.dampers is None else system.dampers[system.dampers != 0.0],
            damped=stepper.condensed.damped,
            relief=stepper.condensed.relief,
            local=np.ascontiguousarray(stepper.condensed.local[stepper.rows]),
            frames=np.ascontiguousarray(stepper.compliance.frames),
            gaps=stepper.gaps,
            counterface=candidates.counterface,
            springs=(candidates.normal_stiffness, candidates.tangential_stiffness),
            compliance=compliance.matrix,
            penalty=np.ascontiguousarray(compliance.penalty),
            scale=self._open.scale,
            factors=scheme.factors,
            prediction=np.array(scheme.prediction),
            remainder=remainder(scheme),
            dissipation=scheme.losses,
            goal=GOAL,
            tolerance=TOLERANCE,
        )
        self._has_constant_friction = all(getattr(law, "is_constant", False) for law in system.counterfaces.friction)
        self._friction: Floats | None = None

    def steer(self, stepper: Stepper) -> None:
        """Go on with a stepper whose counterfaces or loads are others from now on."""
        self.stepper = stepper
        self._loads = self._loads_on_coordinates()

    def _loads_on_coordinates(self) -> list[Load]:
        system = self.stepper.system
        return [replace(load, forces=self._on_coordinates(load.forces)) for load in (*system.loads, *system.commanded)]

    def _on_coordinates(self, forces: Floats) -> Floats:
        """Return forces (m + p,) on coordinates and interface as forces on the coordinates, (m,)."""
        size = self._interface.shape[1]
        behind = forces[size:]
        return forces[:size] + behind @ self._interface if behind.any() else forces[:size]

    def start(self) -> State:
        """Return the state at time zero."""
        state, size = first_state(self.stepper), self._interface.shape[1]
        rates = state.displacement[:size], state.velocity[:size], state.acceleration[:size]
        unbalances = map(self._on_coordinates, (state.unbalance, state.unbalance_before))
        count = len(state.moved)
        motion = Motion(
            fields=np.stack([*rates, *unbalances]),
            load=self._on_coordinates(state.load),
            forces=np.zeros((4, count, 2)),
            relative=np.stack([state.interface.relative, state.moved]),
            release=np.zeros((2, count, 2)),
            largest=np.zeros(1),
            slips=np.zeros((4, count)),
            states=state.interface.state,
            energies=np.array([getattr(state.energies, name) for name in ENERGIES]),
        )
        inverse = (getattr(self._open, name).copy() for name in Inverse._fields)
        supports = () if self._supports is None else self._supports.start(state)
        return replace(state, **_NOT_KEPT, carried=(*motion, *inverse, *supports))

    def advance(self, state: State, times: Floats) -> list[State]:
        """Take steps to times (k,) [s]; return their states, those of some steps together."""
        blocks: list[State] = []
        taken = 0
        while taken < times.size:
            # Through several steps friction coefficients stay.
            count = times.size if self._has_constant_friction else taken + 1
            state = self._advance(state, times[taken:count])
            taken += np.size(state.time)
            blocks.append(state)
        return blocks

    def _advance(self, before: State, times: Floats) -> State:
        """Take steps with the same friction coefficients; return the states of those that are solved."""
        system, count = self.stepper.system, times.size
        if self._friction is None or not self._has_constant_friction:
            limits = conditions(system.candidates, before.interface, before.step, float(times[0]))
            friction = system.counterfaces.coefficients(limits, system.candidates.counterface)
            self._friction = np.ascontiguousarray(friction)
        travel = np.zeros((count + 1, len(system.motions), 2))
        travel[0] = before.counterfaces[-1] if before.counterfaces.ndim == 3 else before.counterfaces
        for number, travels in enumerate(system.motions):
            travel[1:, number] = travels.displacement(times)
        loads = np.zeros((count, self._interface.shape[1]))
        for load in self._loads:
            loads += np.array([load.ramp.at(time) for time in times.tolist()])[:, None] * load.forces
        arrays, last = before.carried, len(Motion._fields) + len(Inverse._fields)
        supports, path = self._supports, travel
        if supports is not None:
            path, of_supports = supports.move(system, arrays[last:], times)
            loads += of_supports
        driving = Driving(travel, loads, self._friction)
        motion = Motion(*(array.copy() for array in arrays[: len(Motion._fields)]))
        # What is changed in place stays the inverse of its own states, and serves any step as well.
        inverse, records = Inverse(*arrays[len(motion) : last]), _empty_records(count, self._body)
        solved = self._take_steps(motion, inverse, driving, records, float(times[0]))
        steps: tuple[Any, ...] = tuple(values[:solved] for values in records)
        records = Records(*steps)
        # Fields with the displacement of the interface behind them; one product reads the interface once for all.
        inner = records.fields.transpose(1, 0, 2)
        behind = (inner.reshape(-1, inner.shape[2]) @ self._interface.T).reshape(3, solved, -1)
        fields = np.concatenate([inner, behind], axis=2)
        further = () if supports is None else supports.finish(fields, path, arrays[last:], motion, records)
        carried = (*motion, *inverse, *further)
        return self._states(before, times[:solved], fields, travel[1 : solved + 1], records, carried=carried)

    def _take_steps(self, motion: Motion, inverse: Inverse, driving: Driving, records: Records, end: float) -> int:
        """Take steps up to one that is not solved, at least the first, which ends at a time [s]; return how many."""
        compliance, solutions = self._body.compliance, np.zeros((0, *motion.forces.shape[1:]))
        while True:
            solved: int = take_steps(self._body, inverse, motion, driving, solutions, records)
            if solved:
                return solved
            # Where the search in partitions ends, the solver for all dimensions goes on.
            found, problem = records.forces[0, 0], records.relative[0]
            solution = solve_friction(compliance, problem, driving.friction, found, GOAL)
            is_solved = solution.residual <= TOLERANCE
            if not is_solved or len(solutions) == _MOST_SOLUTIONS:
                # Where solutions are found one after the other, what is left is that of the search in partitions.
                residual = float(records.residuals[0]) if is_solved else solution.residual
                raise unsolved(self.stepper.system.candidates, solution.worst, residual, TOLERANCE, end)
            solutions = np.concatenate([solutions, solution.forces[None]])

    def _states(
        self,
        before: State,
        times: Floats,
        fields: Floats,
        travel: Floats,
        records: Records,
        *,
        carried: tuple[NDArray[Any], ...],
    ) -> State:
        """Return the states of steps, time first in their arrays where there are several."""
        at: int | slice = 0 if times.size == 1 else slice(None)
        displacement, velocity, acceleration = fields[:, at]
        forces, slips = records.forces[at], records.slips[at]
        slip_distance, since_contact, slip, limit = (slips[..., row, :] for row in range(4))
        energies: dict[str, Any] = dict(zip(ENERGIES, records.energies[at].T, strict=True))
        return replace(
            before,
            time=times[at],  # type: ignore[arg-type]
            displacement=displacement,
            velocity=velocity,
            acceleration=acceleration,
            counterfaces=travel[at],
            contact_forces=forces[..., 1, :, :],
            interface=InterfaceState(
                forces=forces[..., 0, :, :],
                relative=records.relative[at],
                slip_distance=slip_distance,
                slip_since_contact=since_contact,
                slip=slip,
                state=records.states[at],
                limit=limit,
            ),
            energies=replace(before.energies, **energies),
            step=self.stepper.scheme.step,
            iterations=records.iterations[at],  # type: ignore[arg-type]
            residual=records.residuals[at],  # type: ignore[arg-type]
            carried=carried,
        )


def _empty_records(count: int, body: Body) -> Records:
    nodes, size = len(body.gaps), body.effective.size
    return Records(
        fields=np.empty((count, 3, size)),
        forces=np.empty((count, 2, nodes, 2)),
        relative=np.empty((count, nodes, 2)),
        slips=np.empty((count, 4, nodes)),
        states=np.empty((count, nodes), dtype=np.int8),
        energies=np.empty((count, len(ENERGIES))),
        iterations=np.empty(count, dtype=np.int64),
        residuals=np.empty(count),
    )
