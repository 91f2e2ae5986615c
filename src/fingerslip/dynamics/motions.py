"""Motions that are computed together: what they are, and how they are marched in the coordinates of their systems."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.march import Inspect, march
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.recording.recoveries import Recoveries
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch, build_steppers
from fingerslip.dynamics.system.system import System
from fingerslip.linear.solver import LinearSolver
from fingerslip.linear.threads import single_dense_thread
from fingerslip.model import Model

__all__ = ["Marched", "Motions", "march_motions"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motions:
    """Models that share a matrix, and how to march them.

    Parameters
    ----------
    models : tuple of Model
        The models.
    systems : tuple of System
        Their systems on the mesh.
    times : tuple of (n_times,) array
        Times of their steps [s].
    solver : LinearSolver
        What factorises.
    watch : Stopwatch
        Takes the times.
    progress : callable, optional
        Called after every step with the fraction that is done.
    threads : int
        Threads that solve contacts side by side.
    """

    models: tuple[Model, ...]
    systems: tuple[System, ...]
    times: tuple[Array, ...]
    solver: LinearSolver
    watch: Stopwatch
    progress: Callable[[float], None] | None
    threads: int

    @property
    def first(self) -> Motions:
        """The first motion alone."""
        return replace(self, models=self.models[:1], systems=self.systems[:1], times=self.times[:1])


@dataclass(frozen=True)
class Marched:
    """Motions that are computed.

    Parameters
    ----------
    steppers : tuple of Stepper
        What stayed the same in each.
    recorders : tuple of Recorder
        What was recorded of each.
    basis : mapping of str to object
        What histories say of the basis.
    """

    steppers: tuple[Stepper, ...]
    recorders: tuple[Recorder, ...]
    basis: Mapping[str, object]


def march_motions(
    motions: Motions, systems: Sequence[System], basis: Mapping[str, object], inspect: Inspect | None = None
) -> Marched:
    """Compute motions.

    Parameters
    ----------
    motions : Motions
        What to compute.
    systems : sequence of System
        Their systems, on the mesh or reduced.
    basis : mapping of str to object
        What histories say of the basis.
    inspect : callable, optional
        As for :func:`fingerslip.dynamics.march.march`.
    """
    watch, first = motions.watch, motions.models[0]
    with watch.part("assembly"):
        recoveries = Recoveries(systems[0])
        recorders = tuple(
            Recorder(model, system, own, recoveries)
            for model, system, own in zip(motions.models, systems, motions.times, strict=True)
        )
    with watch.part("factorisation"):
        reserved = sum(own.nbytes for own in recorders)
        steppers = build_steppers(systems, first.time, first.damping, solver=motions.solver, reserved_bytes=reserved)
    with watch.part("stepping"), single_dense_thread():
        march(
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
