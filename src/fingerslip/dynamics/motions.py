"""Motions that are computed together: which integrator takes their steps, and what came of them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from fingerslip.arrays import Floats
from fingerslip.dynamics.adaptive import Controlled
from fingerslip.dynamics.compact.integrator import Compact, obstacle
from fingerslip.dynamics.finite.large import Large
from fingerslip.dynamics.loop import BodyIntegrator, BodyObserver, Check, Loop
from fingerslip.dynamics.recording.dataset import labelled_history
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.recording.schedule import record_bytes
from fingerslip.dynamics.recording.snapshots import Recoveries
from fingerslip.dynamics.reduced.reduction import ByModes
from fingerslip.dynamics.step.small_strain import SmallStrain
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch, build_steppers, factorised
from fingerslip.dynamics.system.scheme import make_scheme
from fingerslip.dynamics.system.system import System
from fingerslip.errors import ConvergenceError
from fingerslip.libraries import xr
from fingerslip.linear.resources import Mapper, side_by_side, single_dense_thread
from fingerslip.linear.solver import LinearSolver
from fingerslip.model.model import Model
from fingerslip.model.timing import Adaptive

_logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Motions:
    """Models that share a matrix, and how to compute them."""

    models: tuple[Model, ...]  # the models
    systems: tuple[System, ...]  # their systems on the mesh
    times: tuple[Floats, ...]  # (n_times,), times of their steps [s]
    solver: LinearSolver  # what factorises
    watch: Stopwatch  # takes the times
    progress: Callable[[float], None] | None = None  # called after every step with the fraction that is done
    threads: int = 1  # threads that solve contacts side by side

    @property
    def record_bytes(self) -> int:
        """What the records of all of them take [bytes]."""
        pairs = zip(self.models, self.systems, strict=True)
        return sum(
            record_bytes(model, len(system.space.positions), len(system.candidates.nodes)) for model, system in pairs
        )

    def part(self, numbers: slice) -> Motions:
        """Return some of the motions."""
        return replace(self, models=self.models[numbers], systems=self.systems[numbers], times=self.times[numbers])


@dataclass(frozen=True)
class Outcome:
    """What came of motions."""

    steppers: tuple[Stepper, ...]  # what stayed the same in each
    recorders: tuple[Recorder, ...]  # what was recorded of each
    attributes: Mapping[str, object]  # what histories say of how they were computed

    def histories(self, watch: Stopwatch) -> tuple[xr.Dataset, ...]:
        """Return the histories of all motions, of which each says what all of them took."""
        attributes = {**self.attributes, "n_simulated_together": len(self.steppers)}
        with watch.part("recording"):
            values = [recorder.values() for recorder in self.recorders]
        return tuple(
            labelled_history(of_motion, stepper, attributes | recorder.attributes, watch)
            for of_motion, stepper, recorder in zip(values, self.steppers, self.recorders, strict=True)
        )


def compute(motions: Motions, systems: Sequence[System], checks: Sequence[Check] = ()) -> Outcome:
    """Compute motions in the coordinates of their systems, each with a further check, if any."""
    with side_by_side(min(motions.threads, len(systems))) as mapper:
        loop, integrator, recorders = prepare(motions, systems, checks, mapper)
        try:
            with motions.watch.part("stepping"), single_dense_thread():
                loop.run(motions.progress)
        except ConvergenceError as error:
            if len(recorders) == 1:
                attributes = {**loop.attributes, "failure": str(error)}
                (error.history,) = Outcome(tuple(integrator.steppers), recorders, attributes).histories(motions.watch)
            raise
    return Outcome(tuple(integrator.steppers), recorders, loop.attributes)


def prepare(
    motions: Motions, systems: Sequence[System], checks: Sequence[Check] = (), mapper: Mapper = map
) -> tuple[Loop[State], BodyIntegrator, tuple[Recorder, ...]]:
    """Return the loop that computes motions from time zero, what takes its steps, and what records each motion."""
    watch, model = motions.watch, motions.models[0]
    with watch.part("assembly"):
        recoveries = Recoveries(systems[0])
        recorders = tuple(
            Recorder(model, system, times, recoveries)
            for model, system, times in zip(motions.models, systems, motions.times, strict=True)
        )
    further = [[check] for check in checks] or [[] for _ in recorders]
    observers = list(map(BodyObserver, recorders, systems, further))
    integrator = make_integrator(motions, systems, mapper)
    driven: BodyIntegrator | Controlled = integrator
    if isinstance(model.time, Adaptive):
        driven = Controlled(integrator, model, systems[0].mass, observers[0].pass_by)
    with watch.part("stepping"), single_dense_thread():
        return Loop(driven, observers, motions.times, watch), integrator, recorders


def make_integrator(motions: Motions, systems: Sequence[System], mapper: Mapper = map) -> BodyIntegrator:
    """Return what takes the steps of motions in the coordinates of their systems."""
    model, solver, watch, reserved = motions.models[0], motions.solver, motions.watch, motions.record_bytes
    time, damping = model.time, model.damping
    if model.is_finite:
        return Large(model, systems[0], solver, watch, reserved)
    if isinstance(time, Adaptive):

        def make(length: float) -> list[Stepper]:
            scheme = make_scheme(time.fixed(length))
            with watch.part("factorisation"):
                return factorised(systems, scheme, damping, solver, reserved)

        return SmallStrain(make, time.shortest, watch)
    with watch.part("factorisation"):
        steppers = build_steppers(systems, time, damping, solver, reserved)
    if isinstance(steppers[0].condensed, ByModes):
        reason = next(filter(None, map(obstacle, steppers)), None)
        if reason is None:
            return Compact(steppers)
        _logger.info("no compiled steps in a basis: %s", reason)
    return SmallStrain(lambda _: steppers, time.step, watch, mapper)
