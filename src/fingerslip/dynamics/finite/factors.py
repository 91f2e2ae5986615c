"""The factors of a motion at large strain: kept from step to step as long as that costs less than new ones."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from fingerslip.dynamics.finite.body import BodyState
from fingerslip.dynamics.scheme import Scheme
from fingerslip.dynamics.stepper import Stepper, Stopwatch, build_stepper
from fingerslip.dynamics.system import System
from fingerslip.errors import FingerslipError
from fingerslip.linear.solver import LinearSolver
from fingerslip.materials.damping import RayleighDamping

__all__ = ["Factors"]

# What new factors cost, in iterations of a step, by the dimension of space: tangent, factorisation and compliance of
# the contact, as tests/benchmarks/bench_large_strain.py measures them. Numbers and not a clock, so that a motion
# computed twice is the same to the last bit.
_COST = {2: 30, 3: 60}
# Share of the stiffness at rest that a definite tangent has beside.
_OF_REST = 1e-3


@dataclass
class Factors:
    """The factors of a tangent, for steps of one length.

    Parameters
    ----------
    system : System
        The system of a body at large strain.
    scheme : Scheme
        Time integration.
    damping : RayleighDamping
        Material damping.
    solver : LinearSolver
        What factorises.
    watch : Stopwatch
        Takes the times of tangents and factorisations.
    reserved_bytes : int
        Memory that must stay free for the histories [bytes].
    """

    system: System
    scheme: Scheme
    damping: RayleighDamping
    solver: LinearSolver
    watch: Stopwatch
    reserved_bytes: int = 0
    stepper: Stepper | None = None
    count: int = 0
    made_at: tuple[BodyState, bool] | None = None
    _least: int = field(default=0, repr=False)
    _excess: int = field(default=0, repr=False)

    def at(self, state: BodyState) -> Stepper:
        """Return the stepper of a step that begins with a body; new where old factors have cost more than these."""
        if self.stepper is None or self._excess >= _COST[self.system.space.dim]:
            return self.renew(state)
        return self.stepper

    @property
    def current(self) -> Stepper:
        """The stepper of the present factors."""
        if self.stepper is None:
            raise ValueError("no factors were made yet")
        return self.stepper

    def renew(self, state: BodyState) -> Stepper:
        """Return the stepper with the tangent of a body.

        An indefinite tangent, such as that of a body under much pressure, is made definite: it then only guides the
        iteration more slowly to the same solution.
        """
        # The old factors go first: in space there is no memory for both.
        self.stepper, self.count = None, self.count + 1
        try:
            self.stepper, self.made_at = self._made(state, positive=False), (state, False)
        except FingerslipError:
            self.stepper, self.made_at = self._made(state, positive=True), (state, True)
        self._least, self._excess = 0, 0
        return self.stepper

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self.system = system
        self.stepper = self.stepper and replace(self.stepper, system=system)

    def saved(self) -> tuple[tuple[BodyState, bool] | None, int, int, int]:
        """Return what :meth:`restore` needs."""
        return self.made_at, self.count, self._least, self._excess

    def restore(self, made_at: tuple[BodyState, bool] | None, count: int, least: int, excess: int) -> None:
        """Make the factors again that were saved."""
        self.made_at, self.count, self._least, self._excess = made_at, count, least, excess
        self.stepper = None if made_at is None else self._made(made_at[0], positive=made_at[1])

    def used(self, iterations: int) -> None:
        """Take note of the iterations of a step."""
        self._least = min(self._least, iterations) if self._least else iterations
        self._excess += iterations - self._least

    def _made(self, state: BodyState, *, positive: bool) -> Stepper:
        with self.watch.part("tangent"):
            tangent = self.system.require_body().tangent(state, positive=positive)
            if positive:
                # Where nothing is left of a cell's stiffness, a little of that at rest keeps the matrix definite.
                tangent = tangent + _OF_REST * self.system.stiffness
        with self.watch.part("factorisation"):
            tangential = replace(self.system, stiffness=tangent)
            stepper = build_stepper(
                tangential, self.scheme, self.damping, solver=self.solver, reserved_bytes=self.reserved_bytes
            )
        # A working set of other factors, or of those of a halved step, holds another compliance.
        edition = replace(stepper.compliance, edition=(self.scheme.step, self.count))
        return replace(stepper, system=self.system, compliance=edition)
