"""The factors of a motion at large strain: kept from step to step as long as that costs less than new ones."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.finite.body import BodyState
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch, build_stepper, is_large
from fingerslip.dynamics.system.scheme import Scheme
from fingerslip.dynamics.system.system import System
from fingerslip.errors import FingerslipError, InvertedCellError
from fingerslip.linear.solver import LinearSolver
from fingerslip.materials.elastic import RayleighDamping

__all__ = ["Factors"]

Array = NDArray[np.float64]

# What new factors cost, in iterations of a step, by the dimension of space: tangent, factorisation and compliance of
# the contact. By the processor time of these parts it is about 35 in 2D and 50 to 70 in 3D, with factors of
# single precision, which make both cheaper, as with those of double precision. Numbers and not
# a clock, so that a motion computed twice is the same to the last bit.
_COST = {2: 30, 3: 60}
# Steps that factors look ahead at most.
_FURTHEST = 10
# Share of the stiffness at rest that a definite tangent has beside.
_OF_REST = 1e-3


class MadeOf(NamedTuple):
    """What factors are made of: a body, whether its tangent was made definite, and whether they may be rough."""

    body: BodyState
    positive: bool
    rough: bool


@dataclass
class Factors:
    """The factors of a tangent, for steps of one length."""

    system: System  # the system of a body at large strain
    scheme: Scheme  # time integration
    damping: RayleighDamping  # material damping
    solver: LinearSolver  # what factorises
    watch: Stopwatch  # takes the times of tangents and factorisations
    reserved_bytes: int = 0  # memory that must stay free for the histories [bytes]
    stepper: Stepper | None = None
    count: int = 0
    made_of: MadeOf | None = None
    _least: int = field(default=0, repr=False)
    _excess: int = field(default=0, repr=False)
    _served: int = field(default=0, repr=False)

    def __post_init__(self) -> None:
        self._exact, self._rough = self.solver.series(), self.solver.rough()

    def at(self, state: BodyState, velocity: Array | None = None) -> Stepper:
        """Return the stepper of a step that begins with a body; new where old factors have cost more than these.

        Parameters
        ----------
        state : BodyState
            The body.
        velocity : (n,) array, optional
            Its velocity [m/s]. With it, new factors are those of where the body will be in the middle of their time:
            they then fit from beginning to end. That time is expected to be as long as that of the last ones.
        """
        if self.stepper is not None and self._excess < _COST[self.system.space.dim]:
            return self.stepper
        return self.renew(state, None if velocity is None else self._ahead(state, velocity))

    @property
    def current(self) -> Stepper:
        """The stepper of the present factors."""
        if self.stepper is None:
            raise ValueError("no factors were made yet")
        return self.stepper

    def renew(self, state: BodyState, ahead: BodyState | None = None, *, rough: bool = True) -> Stepper:
        """Return the stepper with the tangent of a body, or of where it goes if that can be factorised.

        An indefinite tangent, such as that of a body under much pressure, is made definite: it then only guides the
        iteration more slowly to the same solution. Its factors are never rough: it may be nearly singular.
        """
        # The old factors go first: in 3D there is no memory for both.
        self.stepper, self.count = None, self.count + 1
        self._least = self._excess = self._served = 0
        for body in (state,) if ahead is None else (ahead, state):
            with contextlib.suppress(FingerslipError):
                return self._make(MadeOf(body, positive=False, rough=rough))
        return self._make(MadeOf(state, positive=True, rough=False))

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self.system = system
        self.stepper = self.stepper and replace(self.stepper, system=system)

    def saved_state(self) -> tuple[tuple[BodyState, bool, bool] | None, int, tuple[int, int, int]]:
        """Return what :meth:`restore` needs."""
        return self.made_of and tuple(self.made_of), self.count, (self._least, self._excess, self._served)

    def restore(self, made_of: tuple[BodyState, bool, bool] | None, count: int, used: tuple[int, int, int]) -> None:
        """Make the factors again that were saved."""
        self.count = count
        self._least, self._excess, self._served = used
        if made_of is not None:
            self._make(MadeOf(*made_of))

    def used(self, iterations: int) -> None:
        """Take note of the iterations of a step."""
        self._least = min(self._least, iterations) if self._least else iterations
        self._excess += iterations - self._least
        self._served += 1

    def _ahead(self, state: BodyState, velocity: Array) -> BodyState | None:
        """Return the body after half as many steps as the present factors have served; None where there is none."""
        steps = min(self._served // 2, _FURTHEST)
        with contextlib.suppress(InvertedCellError):
            if steps:
                return self.system.require_body().at(state.displacement + steps * self.scheme.step * velocity, state)
        return None

    def _make(self, made_of: MadeOf) -> Stepper:
        with self.watch.part("tangent"):
            tangent = self.system.require_body().tangent(made_of.body, positive=made_of.positive)
            if made_of.positive:
                # Where nothing is left of a cell's stiffness, a little of that at rest keeps the matrix definite.
                tangent = tangent + _OF_REST * self.system.stiffness
        with self.watch.part("factorisation"):
            tangential = replace(self.system, stiffness=tangent)
            solver = self._rough if made_of.rough and is_large([self.system]) else self._exact
            stepper = build_stepper(
                tangential, self.scheme, self.damping, solver=solver, reserved_bytes=self.reserved_bytes
            )
        # A working set of other factors, or of those of a halved step, holds another compliance.
        edition = replace(stepper.compliance, edition=(self.scheme.step, self.count))
        self.stepper, self.made_of = replace(stepper, system=self.system, compliance=edition), made_of
        return self.stepper
