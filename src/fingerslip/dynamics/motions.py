"""Motions that are computed together: what they are, and how they are marched in the coordinates of their systems."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.compact.integrator import CompactSteps, is_compact
from fingerslip.dynamics.march import Inspect, march
from fingerslip.dynamics.outside import OutsideCheck
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.recording.recoveries import Recoveries
from fingerslip.dynamics.rotations import RotationCheck
from fingerslip.dynamics.step.state import first_state
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch, build_steppers
from fingerslip.dynamics.system.system import System
from fingerslip.linear.solver import LinearSolver
from fingerslip.linear.threads import single_dense_thread
from fingerslip.model.model import Model

__all__ = ["Marched", "Motions", "march_motions"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motions:
    """Models that share a matrix, and how to march them."""

    models: tuple[Model, ...]  # the models
    systems: tuple[System, ...]  # their systems on the mesh
    times: tuple[Array, ...]  # (n_times,), times of their steps [s]
    solver: LinearSolver  # what factorises
    watch: Stopwatch  # takes the times
    progress: Callable[[float], None] | None  # called after every step with the fraction that is done
    threads: int  # threads that solve contacts side by side

    @property
    def first(self) -> Motions:
        """The first motion alone."""
        return replace(self, models=self.models[:1], systems=self.systems[:1], times=self.times[:1])


def march_compact(
    motions: Motions, steppers: Sequence[Stepper], recorders: Sequence[Recorder], inspect: Inspect | None
) -> None:
    """Take and record the steps of motions by compiled code, one motion after the other."""
    done, every = 0, sum(times.size - 1 for times in motions.times)
    for number, (stepper, recorder, times) in enumerate(zip(steppers, recorders, motions.times, strict=True)):
        steps, state = CompactSteps(stepper), first_state(stepper)
        checks = OutsideCheck(stepper.system), RotationCheck(stepper.system)
        block = state
        taken = 0
        while True:
            with motions.watch.part("recording"):
                for check in checks if taken else ():
                    check.look(block)
                recorder.record(block)
            if inspect is not None:
                inspect(number, block)
            if motions.progress is not None and taken:
                motions.progress((done + taken) / every)
            if taken == times.size - 1:
                break
            count = min(recorder.room, times.size - 1 - taken)
            state, block = steps.advance(state, times[taken + 1 : taken + 1 + count])
            taken += count
        done += taken
        for check in checks:
            check.finish()


@dataclass(frozen=True)
class Marched:
    """Motions that are computed."""

    steppers: tuple[Stepper, ...]  # what stayed the same in each
    recorders: tuple[Recorder, ...]  # what was recorded of each
    basis: Mapping[str, object]  # what histories say of the basis


def march_motions(
    motions: Motions, systems: Sequence[System], basis: Mapping[str, object], inspect: Inspect | None = None
) -> Marched:
    """Compute motions."""
    watch, first = motions.watch, motions.models[0]
    with watch.part("assembly"):
        recoveries = Recoveries(systems[0])
        recorders = tuple(
            Recorder(model, system, times, recoveries)
            for model, system, times in zip(motions.models, systems, motions.times, strict=True)
        )
    with watch.part("factorisation"):
        reserved = sum(times.nbytes for times in recorders)
        steppers = build_steppers(systems, first.time, first.damping, solver=motions.solver, reserved_bytes=reserved)
    with watch.part("stepping"), single_dense_thread():
        march_compact(motions, steppers, recorders, inspect) if all(map(is_compact, steppers)) else march(
            steppers,
            recorders,
            motions.times,
            watch=watch,
            progress=motions.progress,
            threads=motions.threads,
            inspect=inspect,
        )
        with watch.part("recording"):
            for recorder in recorders:
                recorder.complete()
    return Marched(tuple(steppers), recorders, basis)
