"""A motion of a reduced body in 2D, taken many steps at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.interface import InterfaceState, conditions
from fingerslip.contact.solve.compliance import active_product
from fingerslip.contact.solve.partition import Partition, first_partition
from fingerslip.dynamics.compact.kernel import ENERGIES, Body, Inverse, Motion, Records, take_steps
from fingerslip.dynamics.integrator import BodyIntegrator
from fingerslip.dynamics.reduced.reduction import ByModes
from fingerslip.dynamics.step.contact_step import GOAL, TOLERANCE
from fingerslip.dynamics.step.mesh import advance
from fingerslip.dynamics.step.prediction import first_state
from fingerslip.dynamics.step.release import Release, remainder
from fingerslip.dynamics.step.state import Energies, State
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.system import System

__all__ = ["Compact", "is_compact"]

Array = NDArray[np.float64]

# What a block of steps holds as states do, time first.
_RECORDED = ("time", "displacement", "velocity", "acceleration", "counterfaces", "iterations", "residual")
# Unknowns of contact up to which an inverse of all of them is kept.
_FEW = 900


def is_compact(stepper: Stepper) -> bool:
    """Tell whether compiled code takes the steps of a motion: in a basis, in 2D, on flat counterfaces."""
    unknowns = stepper.system.candidates.positions.size
    return (
        isinstance(stepper.condensed, ByModes)
        and stepper.system.space.dim == 2
        and stepper.constant_frames is not None
        and 0 < unknowns <= _FEW
    )


class Compact(BodyIntegrator):
    """Motions whose steps compiled code takes; see :class:`fingerslip.dynamics.integrator.BodyIntegrator`."""

    def __init__(self, steppers: Sequence[Stepper]) -> None:
        self._motions = list(map(_Steps, steppers))

    @property
    def steppers(self) -> Sequence[Stepper]:
        """What stays the same in each motion."""
        return [motion.stepper for motion in self._motions]

    def start(self) -> dict[int, State]:
        """Return the states at time zero."""
        return dict(enumerate(map(first_state, self.steppers)))

    def advance(
        self,
        states: Mapping[int, State],
        ends: Array,
        length: float | None = None,  # noqa: ARG002
    ) -> dict[int, tuple[State, list[State]]]:
        """Take steps to times (k,) [s]; see :meth:`fingerslip.dynamics.integrator.Integrator.advance`."""
        return {number: self._motions[number].advance(state, ends) for number, state in states.items()}

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self._motions[0].steer(replace(self.steppers[0], system=system))


class _Steps:
    """The compiled steps of one motion."""

    def __init__(self, stepper: Stepper) -> None:
        assert isinstance(stepper.condensed, ByModes)
        assert stepper.constant_frames is not None
        self.stepper = stepper
        factor = stepper.condensed.factor
        diagonal, self._interface = factor.diagonal, factor.interface
        system, scheme, candidates = stepper.system, stepper.scheme, stepper.system.candidates
        stiffness = system.stiffness.diagonal()[: diagonal.size]
        compliance = stepper.compliance
        first = first_partition(compliance.matrix, compliance.penalty)
        self._body = Body(
            stiffness=stiffness,
            damping=stepper.damping.mass + stepper.damping.stiffness * stiffness,
            effective=diagonal,
            local=np.ascontiguousarray(stepper.condensed.local[stepper.rows]),
            loads=self._loads(),
            frames=np.ascontiguousarray(stepper.constant_frames),
            gaps=stepper.gaps,
            counterface=candidates.counterface,
            springs=(candidates.normal_stiffness, candidates.tangential_stiffness),
            compliance=compliance.matrix,
            penalty=np.ascontiguousarray(compliance.penalty),
            scale=first.scale,
            factors=scheme.factors,
            prediction=np.array(scheme.prediction),
            remainder=remainder(scheme),
            dissipation=scheme.losses,
            goal=GOAL,
        )
        # The last state, and the arrays of compiled code that are at it.
        self._latest: tuple[State | None, Any] = None, None
        self._has_constant_friction = all(getattr(law, "is_constant", False) for law in system.counterfaces.friction)
        self._friction: Array | None = None

    def steer(self, stepper: Stepper) -> None:
        """Go on with a stepper whose counterfaces or loads are others from now on."""
        self.stepper = stepper
        self._friction = None
        self._body = self._body._replace(loads=self._loads())

    def _loads(self) -> Array:
        """Return the loads on the coordinates at factor one, (k, m)."""
        system, size = self.stepper.system, self._interface.shape[1]
        loads = [load.forces[:size] + load.forces[size:] @ self._interface for load in _loads_of(self.stepper)]
        return np.array(loads).reshape(len(system.loads) + len(system.commanded), size)

    def advance(self, state: State, times: Array) -> tuple[State, list[State]]:
        """Take steps to times (k,) [s]; return the state at the last, and what is recorded of all, some at a time."""
        blocks: list[State] = []
        taken = 0
        while taken < times.size:
            # Through several steps friction coefficients stay.
            count = times.size if self._has_constant_friction else taken + 1
            state, block = self._advance(state, times[taken:count])
            taken += np.size(block.time)
            blocks.append(block)
        return state, blocks

    def _advance(self, state: State, times: Array) -> tuple[State, State]:
        """Take steps with the same friction coefficients, all of them or as many as compiled code solves, at least one.

        A step whose contact Newton's method does not solve in partitions is taken as on a mesh.
        """
        system, body = self.stepper.system, self._body
        count = times.size
        if self._friction is None or not self._has_constant_friction:
            limits = conditions(system.candidates, state.interface, state.step, float(times[0]))
            friction = system.counterfaces.coefficients(limits, system.candidates.counterface)
            self._friction = np.ascontiguousarray(friction)
        travel = np.zeros((count + 1, len(system.motions), 2))
        travel[0] = state.counterfaces
        for number, travels in enumerate(system.motions):
            travel[1:, number] = travels.displacement(times)
        factors = np.array([[load.ramp.at(time) for load in _loads_of(self.stepper)] for time in times.tolist()])
        partition, records = self._partition(state), _empty_records(count, body)
        # What is changed in place stays the inverse of its own states, and serves any step as well.
        inverse = Inverse(*(getattr(partition, name) for name in Inverse._fields))
        motion = self._latest[1] if state is self._latest[0] else self._motion(state, partition)
        loads = factors.reshape(count, len(body.loads))
        solved = take_steps(body, inverse, motion, travel, loads, self._friction, TOLERANCE, records)
        if not solved:
            end = float(times[0])
            after = advance([self.stepper], [state], end, [system.displacements(end)], watch=Stopwatch())[0]
            return after, after
        if solved < count:
            of_steps: dict[str, Any] = {name: values[:solved] for name, values in records._asdict().items()}
            records = Records(**of_steps)
        block = self._block(state, times[:solved], travel[1 : solved + 1], records)
        forces, product = motion.forces[:2].copy()
        last = self._last(state, block, motion, replace(partition, forces=forces, product=product))
        self._latest = last, motion
        return last, block

    def _partition(self, state: State) -> Partition:
        """Return the partition of a state, with W times its forces."""
        matrix, penalty = self._body.compliance, self._body.penalty
        last = state.working_set
        if isinstance(last, Partition) and last.compliance is matrix:
            return last
        forces = state.interface.forces
        return replace(first_partition(matrix, penalty), forces=forces, product=active_product(matrix, forces))

    def _motion(self, state: State, partition: Partition) -> Motion:
        """Return a state as the arrays of compiled code."""
        interface, release, size = state.interface, state.release, self._interface.shape[1]
        unbalances = [self._on_coordinates(forces) for forces in (state.unbalance, state.unbalance_before)]
        rates = state.displacement[:size], state.velocity[:size], state.acceleration[:size]
        left = np.zeros((2, *state.moved.shape)) if release is None else np.stack([release.fading, release.cancelled])
        slips = interface.slip_distance, interface.slip_since_contact, interface.slip, interface.limit
        product = partition.product
        if partition.forces is not interface.forces:
            product = active_product(self._body.compliance, interface.forces)
        return Motion(
            fields=np.stack([*rates, *unbalances]),
            load=self._on_coordinates(state.load),
            forces=np.stack([interface.forces, product, state.contact_forces, state.contact_forces_before]),
            relative=np.stack([interface.relative, state.moved]),
            release=left,
            largest=np.array([0.0 if release is None else release.largest]),
            slips=np.stack(slips),
            states=interface.state.copy(),
        )

    def _on_coordinates(self, forces: Array) -> Array:
        """Return forces (m + p,) on coordinates and interface as forces on the coordinates, (m,)."""
        size = self._interface.shape[1]
        behind = forces[size:]
        return forces[:size] + behind @ self._interface if behind.any() else forces[:size]

    def _block(self, before: State, times: Array, travel: Array, records: Records) -> State:
        """Return what is recorded of steps, time first."""
        stored, spent = records.energies.T[:3], np.cumsum(records.energies.T[3:], axis=1)
        energies = dict(zip(ENERGIES[:3], stored, strict=True)), dict(zip(ENERGIES[3:], spent, strict=True))
        none, slips = np.zeros(0), records.slips
        # Fields with the displacement of the interface behind them; one product reads the interface once for all.
        fields, size = records.fields.transpose(1, 0, 2), self._interface.shape[1]
        behind = (fields.reshape(-1, size) @ self._interface.T).reshape(3, times.size, -1)
        displacement, velocity, acceleration = np.concatenate([fields, behind], axis=2)
        return State(
            time=times,  # type: ignore[arg-type]
            displacement=displacement,
            velocity=velocity,
            acceleration=acceleration,
            inertia=none,
            load=none,
            unbalance=none,
            unbalance_before=none,
            counterfaces=travel,
            moved=none,
            contact_forces=records.forces[:, 1],
            contact_forces_before=none,
            interface=InterfaceState(
                records.forces[:, 0], records.relative, slips[:, 0], none, none, records.states, slips[:, 1]
            ),
            energies=before.energies.after(*energies),
            moments=before.moments,
            step=self.stepper.scheme.step,
            iterations=records.iterations,  # type: ignore[arg-type]
            residual=records.residuals,  # type: ignore[arg-type]
        )

    def _last(self, before: State, block: State, motion: Motion, partition: Partition) -> State:
        """Return the state at the end of a block, from which steps may go on."""
        size, slips = self._interface.shape[1], motion.slips.copy()
        # On coordinates and interface, of which forces act on the coordinates alone.
        inertia, load, unbalance, unbalance_before = forces = np.zeros((4, size + len(self._interface)))
        inertia[:size] = self.stepper.scheme.inertia_factor * motion.fields[2]
        load[:size], forces[2:, :size] = motion.load, motion.fields[3:]
        ends: dict[str, Any] = {name: getattr(block, name)[-1] for name in _RECORDED}
        last_energies = {name: float(np.ravel(value)[-1]) for name, value in vars(block.energies).items()}
        left, cancelled = motion.release.copy()
        release = Release(left, cancelled, float(motion.largest[0])) if motion.largest[0] else None
        relative, moved = motion.relative.copy()
        interface = InterfaceState(
            partition.forces, relative, slips[0], slips[1], slips[2], motion.states.copy(), slips[3]
        )
        contact_forces, contact_forces_before = motion.forces[2:].copy()
        return replace(
            before,
            **{name: end if np.ndim(end) else end.item() for name, end in ends.items()},
            inertia=inertia,
            load=load,
            unbalance=unbalance,
            unbalance_before=unbalance_before,
            moved=moved,
            contact_forces=contact_forces,
            contact_forces_before=contact_forces_before,
            interface=interface,
            energies=Energies(**last_energies),
            step=self.stepper.scheme.step,
            working_set=partition,
            release=release,
        )


def _loads_of(stepper: Stepper) -> Sequence[Any]:
    return (*stepper.system.loads, *stepper.system.commanded)


def _empty_records(count: int, body: Body) -> Records:
    nodes, size = len(body.gaps), body.effective.size
    return Records(
        fields=np.zeros((count, 3, size)),
        forces=np.zeros((count, 2, nodes, 2)),
        relative=np.zeros((count, nodes, 2)),
        slips=np.zeros((count, 2, nodes)),
        states=np.zeros((count, nodes), dtype=np.int8),
        energies=np.zeros((count, len(ENERGIES))),
        iterations=np.zeros(count, dtype=np.int64),
        residuals=np.zeros(count),
    )
