"""Factors of a tangent at large strain, kept from step to step as long as that costs less than new ones."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.finite.body import BodyState, Inclusions, find_inclusions
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch, factorised, is_large
from fingerslip.dynamics.system.scheme import Scheme
from fingerslip.dynamics.system.system import System
from fingerslip.errors import FingerslipError, InvertedCellError
from fingerslip.linear.solver import LinearSolver
from fingerslip.materials.elastic import RayleighDamping

# What new factors cost, in iterations of a step, by the dimension of space: tangent, factorisation and compliance of
# the contact. By the processor time of these parts, 60 over 6 ms in 2D, and 120 in 3D, but a coarse fingertip
# takes 4 % less in all with 60. Numbers and not a clock, so that a motion computed twice is the same to the last bit.
_COST = {2: 10, 3: 60}
# What they cost at least where those before had to be made definite. A guess: 10 and 90 take as many factors, within
# 6 %, on the ridged section of ridged_vs_smooth_large.yaml at 5 mm.
_LEAST_DEFINITE = 30
# Steps that factors look ahead at most.
_FURTHEST = 10
# Share of a tangent that was made definite, beside the tangent itself, which is tried before the whole of it. There
# 0.02 and 0.5 take as many factors, within 7 %; with the whole alone, a step of 200 ms is not solved.
_DEFINITE = 0.1
# Share of the stiffness at rest that a definite tangent has beside.
_OF_REST = 1e-3


class MadeOf(NamedTuple):
    """What factors are made of: a body, the share of its tangent made definite, and whether they may be rough."""

    body: BodyState
    definite: float
    rough: bool


class Factors:
    """The factors of a tangent, for steps of one length, with bytes that must stay free for the histories."""

    def __init__(
        self,
        system: System,
        scheme: Scheme,
        damping: RayleighDamping,
        solver: LinearSolver,
        *,
        watch: Stopwatch,
        reserved_bytes: int,
    ) -> None:
        self.system, self.scheme, self.damping, self.watch = system, scheme, damping, watch
        self._solver, self._reserved, self._length = solver, reserved_bytes, scheme.step
        self._exact, self._rough = solver.series(), solver.rough()
        self._stepper: Stepper | None = None
        # (k, 3, 3), rotations R_0 of the inclusions of what they are made of [-]
        self.rotations: Floats = np.zeros((0, 3, 3))
        self._made_of: MadeOf | None = None
        self.count = self._least = self._excess = self._served = 0

    def at(self, state: BodyState, velocity: Floats) -> Stepper:
        """Return the stepper of a step that begins with a body; new where old factors have cost more than these.

        With its velocity (n,) [m/s], new factors are those of where the body will be in the middle of their time: they
        then fit from beginning to end. That time is expected to be as long as that of the last ones.
        """
        if self._stepper is not None and self._excess < _COST[self.system.space.dim]:
            return self._stepper
        ahead, steps = None, min(self._served // 2, _FURTHEST)
        with contextlib.suppress(InvertedCellError):
            if steps:
                further = steps * self.scheme.step * velocity
                ahead = self.system.require_body().at(state.displacement + further, state)
        return self.renew(state, ahead)

    @property
    def current(self) -> Stepper:
        """The stepper of the present factors."""
        assert self._stepper is not None, "no factors were made yet"
        return self._stepper

    @property
    def cost_in_step(self) -> int:
        """What new factors cost in the middle of a step, in iterations."""
        return max(_COST[self.system.space.dim], _LEAST_DEFINITE if self.is_positive else 0)

    @property
    def is_positive(self) -> bool:
        """Whether the tangent of the present factors was made definite."""
        return self._made_of is not None and self._made_of.definite > 0.0

    def renew(self, state: BodyState, ahead: BodyState | None = None, *, rough: bool = True) -> Stepper:
        """Return the stepper with the tangent of a body, or of where it goes if that can be factorised.

        An indefinite tangent, such as that of a body under much pressure, is made definite, in part where that is
        enough: it then only guides the iteration more slowly to the same solution. Its factors are never rough: it may
        be nearly singular.
        """
        # The old factors go first: in 3D there is no memory for both.
        self._stepper, self.count = None, self.count + 1
        self._least = self._excess = self._served = 0
        for body in (state,) if ahead is None else (ahead, state):
            with contextlib.suppress(FingerslipError):
                return self._make(MadeOf(body, definite=0.0, rough=rough))
        with contextlib.suppress(FingerslipError):
            return self._make(MadeOf(state, definite=_DEFINITE, rough=False))
        return self._make(MadeOf(state, definite=1.0, rough=False))

    def release(self) -> None:
        """Let go of the factors, and of the analyses that serve the next ones, which take as much memory."""
        self._stepper, self._exact, self._rough = None, self._solver.series(), self._solver.rough()

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self.system = system
        self._stepper = self._stepper and replace(self._stepper, system=system)

    def rescale(self, scheme: Scheme) -> None:
        """Go on with steps of another length, on which the tangent must not depend."""
        self.scheme = scheme
        self._stepper = self._stepper and replace(self._stepper, scheme=scheme)

    def saved_state(self) -> tuple[MadeOf | None, int, tuple[int, int, int]]:
        """Return what :meth:`restore` needs."""
        return self._made_of, self.count, (self._least, self._excess, self._served)

    def restore(self, made_of: tuple[BodyState, float, bool] | None, count: int, used: tuple[int, int, int]) -> None:
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

    @cached_property
    def inclusions(self) -> Inclusions:
        """What is stiff beside the rest of the body."""
        bulk, system = self.system.require_body().bulk, self.system
        stiffness = np.array([material.stiffness for material in bulk.materials.materials])[bulk.materials.number]
        return find_inclusions(system.space.positions, bulk.nodes, stiffness, system.unknowns, system.candidates.nodes)

    def _make(self, made_of: MadeOf) -> Stepper:
        with self.watch.part("tangent"):
            body, share = self.system.require_body(), made_of.definite
            tangent = body.tangent(made_of.body)
            if share:
                tangent = (1.0 - share) * tangent + share * body.tangent(made_of.body, positive=True)
                # Where nothing is left of a cell's stiffness, a little of that at rest keeps the matrix definite.
                tangent = tangent + _OF_REST * self.system.stiffness
        with self.watch.part("factorisation"):
            tangential = replace(self.system, stiffness=tangent)
            # What lies in much softer cells needs more digits than rough factors have.
            may_be_rough = is_large([self.system]) or not self.inclusions.owner.size
            solver = self._rough if made_of.rough and may_be_rough else self._exact
            (stepper,) = factorised([tangential], self.scheme, self.damping, solver, self._reserved)
        # A working set of other factors, or of those of a halved step, holds another compliance.
        edition = replace(stepper.compliance, edition=(self._length, self.count))
        self._stepper, self._made_of = replace(stepper, system=self.system, compliance=edition), made_of
        self.rotations = self.inclusions.rotations(made_of.body.displacement)
        return self._stepper
