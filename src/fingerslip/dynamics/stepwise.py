"""One motion, step by step: from its state to the next, into the records, past the checks of every step."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.compact.integrator import CompactSteps, is_compact
from fingerslip.dynamics.finite.course import FiniteCourse
from fingerslip.dynamics.motions import Motions
from fingerslip.dynamics.outside import OutsideCheck
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.reduced.march import BasisStore, basis_attributes, reduced_for_steps
from fingerslip.dynamics.reduced.residual import ResidualCheck
from fingerslip.dynamics.rotations import RotationCheck
from fingerslip.dynamics.step.state import State, first_state
from fingerslip.dynamics.step.step import advance
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch, build_steppers
from fingerslip.dynamics.system.system import System
from fingerslip.linear.craig_bampton import CraigBampton
from fingerslip.linear.solver import LinearSolver
from fingerslip.model.model import Model, ReducedBasis

__all__ = ["CompactCourse", "Course", "SmallCourse", "Stepwise", "make_course"]

Array = NDArray[np.float64]

_logger = logging.getLogger("fingerslip.dynamics")


class Course(Protocol):
    """What takes the steps of one motion."""

    @property
    def stepper(self) -> Stepper:
        """What stays the same from step to step."""

    @property
    def attributes(self) -> Mapping[str, object]:
        """What a history says of how it was computed."""

    def start(self) -> State:
        """Return the state at time zero."""

    def advance(self, state: State, end: float) -> State:
        """Take a step from a state to a time [s]."""

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""

    def saved_state(self) -> Any:
        """Return what :meth:`restore` needs, as plain data and arrays."""

    def restore(self, saved: Any) -> None:
        """Go on where :meth:`saved_state` was called."""


class SmallCourse:
    """One motion at small strain; see :class:`Course`."""

    def __init__(self, stepper: Stepper, watch: Stopwatch) -> None:
        self._steppers, self._watch = [stepper], watch
        self.attributes: Mapping[str, object] = {"basis": "full"}

    @property
    def stepper(self) -> Stepper:
        """What stays the same."""
        return self._steppers[0]

    def start(self) -> State:
        """Return the state at time zero."""
        return first_state(self.stepper)

    def advance(self, state: State, end: float) -> State:
        """Take a step to a time [s]."""
        shift = self.stepper.system.displacements(end)
        return advance(self._steppers, [state], end, [shift], watch=self._watch)[0]

    def steer(self, system: System) -> None:
        """Go on with another system."""
        self._steppers = [self.stepper.with_system(system)]

    def saved_state(self) -> None:
        """Return nothing: factors are those of the model."""

    def restore(self, saved: None) -> None:
        """Do nothing."""


class CompactCourse:
    """One motion in a reduced basis in 2D; see :class:`Course`."""

    def __init__(self, steps: CompactSteps, model: Model, basis: CraigBampton, check: ResidualCheck) -> None:
        self._steps, self._basis, self._check = steps, basis, check
        wanted = model.basis or ReducedBasis()
        self._limits = wanted.tolerance, wanted.acceleration_tolerance

    @property
    def stepper(self) -> Stepper:
        """What stays the same."""
        return self._steps.stepper

    @property
    def attributes(self) -> Mapping[str, object]:
        """What a history says of the basis; a warning where its errors are beyond the tolerances."""
        self._check.finish()
        errors = self._check.error, self._check.acceleration_error
        if any(error > limit for error, limit in zip(errors, self._limits, strict=True)):
            _logger.warning("basis: %d vibrations leave errors of %.2g and %.2g", self._basis.frequencies.size, *errors)
        return basis_attributes(self._basis, self._check)

    def start(self) -> State:
        """Return the state at time zero."""
        state = first_state(self.stepper)
        self._check.look(0, state)
        return state

    def advance(self, state: State, end: float) -> State:
        """Take a step to a time [s]."""
        after, _ = self._steps.advance(state, np.array([end]))
        self._check.look(0, after)
        return after

    def steer(self, system: System) -> None:
        """Go on with another system."""
        self._steps.steer(self.stepper.with_system(system))

    def saved_state(self) -> Any:
        """Return the state of the check."""
        return self._check.saved_state()

    def restore(self, saved: Any) -> None:
        """Go on with the state of the check."""
        self._check.restore(saved)


def make_course(  # noqa: PLR0917
    model: Model,
    system: System,
    solver: LinearSolver,
    watch: Stopwatch,
    reserved_bytes: int,
    bases: BasisStore | None = None,
) -> tuple[Course, System]:
    """Return what takes the steps of a model, and its system, which is another one in a reduced basis.

    Units: reserved_bytes [bytes].
    """
    if model.is_finite:
        return FiniteCourse(model, system, solver, watch, reserved_bytes), system
    if model.basis is not None:
        course = _compact_course(model, system, solver, watch, bases)
        if course is not None:
            return course, course.stepper.system
    with watch.part("factorisation"):
        steppers = build_steppers([system], model.time, model.damping, solver=solver, reserved_bytes=reserved_bytes)
    return SmallCourse(steppers[0], watch), system


def _compact_course(
    model: Model, system: System, solver: LinearSolver, watch: Stopwatch, bases: BasisStore | None
) -> CompactCourse | None:
    """Return the course of a model in a basis; None where it is better computed on the mesh."""
    reduced = reduced_for_steps(Motions((model,), (system,), (), solver, watch, None, 1), bases)
    if reduced is None:
        return None
    stepper = build_steppers([reduced[0]], model.time, model.damping, solver=solver)[0]
    if not is_compact(stepper):
        _logger.warning("no reduced basis: it is stepped in 2D on flat counterfaces alone")
        return None
    return CompactCourse(CompactSteps(stepper), model, *reduced[1:])


class Stepwise:
    """One motion with its records and checks.

    Arrays: times (n_times,) [s].
    """

    def __init__(self, course: Course, recorder: Recorder, system: System, times: Array, watch: Stopwatch) -> None:
        self.course, self.recorder, self.times, self.watch = course, recorder, times, watch
        self._checks = OutsideCheck(system), RotationCheck(system)
        self.taken = 0
        self.state = course.start()
        recorder.record(self.state)

    @property
    def last(self) -> int:
        """How many steps there are."""
        return self.times.size - 1

    def step(self) -> None:
        """Take the next step and record it.

        Raises
        ------
        ConvergenceError
            Where it was not solved.
        SlipOutsideContactError
            Where a node that is no candidate has reached its counterface.
        """
        self.state = self.course.advance(self.state, float(self.times[self.taken + 1]))
        self.taken += 1
        with self.watch.part("recording"):
            for check in self._checks:
                check.look(self.state)
            self.recorder.record(self.state)

    def check(self) -> None:
        """Finish the checks of the steps that were taken."""
        for check in self._checks:
            check.finish()

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self.course.steer(system)
        self.recorder.steer(system)
