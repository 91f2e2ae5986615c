"""What a verification problem is, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from fingerslip.errors import FingerslipError
from fingerslip.libraries import xr

if TYPE_CHECKING:
    from fingerslip.model.model import Model


class VerificationError(FingerslipError):
    """A computed history breaks a law that every history has to keep."""


@dataclass(frozen=True)
class Check:
    """One number held against its closed form."""

    quantity: str  # what it is, with its unit
    expected: float  # by the closed form
    got: float
    allowed: float  # largest error
    # whether the error is the difference over the expected value, or the difference itself
    kind: Literal["relative", "absolute"]

    @property
    def error(self) -> float:
        """Size of the error [-], or in the quantity's unit where it is absolute."""
        difference = abs(self.got - self.expected)
        return difference / abs(self.expected) if self.kind == "relative" else difference

    @property
    def holds(self) -> bool:
        """Whether the error is allowed; nothing that is no number passes."""
        return bool(self.error <= self.allowed)


@dataclass(frozen=True)
class Problem:
    """A problem with a known answer."""

    name: str  # short name, as ``--only`` takes it
    title: str  # what it is about
    source: str  # where the known answer is from
    compute: Callable[..., Iterable[Check]]  # computes it, with the values of a case, and yields its checks
    # what the cases compute with; their names, such as elements, come before the quantities
    cases: Mapping[str, tuple[Any, ...]] = field(default_factory=lambda: {"": ()})
    slow: bool = False  # whether it takes more than about ten seconds

    def checks(self) -> tuple[Check, ...]:
        """Compute it and return the checks of all cases."""
        return tuple(
            replace(check, quantity=f"{case}: {check.quantity}" if case else check.quantity)
            for case, values in self.cases.items()
            for check in self.compute(*values)
        )


def each(*elements: str) -> dict[str, tuple[str]]:
    """Return a case for each kind of cell."""
    return {element: (element,) for element in elements}


@dataclass(frozen=True)
class Outcome:
    """A problem and what came of it."""

    problem: Problem  # the problem
    checks: tuple[Check, ...]  # its checks
    trouble: str = ""  # why it could not be computed

    @property
    def holds(self) -> bool:
        """Whether all checks passed."""
        return bool(self.checks) and all(check.holds for check in self.checks)


def relative(quantity: str, expected: float, got: float, allowed: float) -> Check:
    """Return a check of the relative error."""
    return Check(quantity, float(expected), float(got), allowed, "relative")


def absolute(quantity: str, expected: float, got: float, allowed: float) -> Check:
    """Return a check of the absolute error."""
    return Check(quantity, float(expected), float(got), allowed, "absolute")


def largest(quantity: str, expected: ArrayLike, got: ArrayLike, allowed: float, scale: float | None = None) -> Check:
    """Return a check of the largest absolute error of an array, over a scale or else the largest expected value."""
    error = np.abs(np.asarray(got) - expected).max() / (np.abs(expected).max() if scale is None else scale)
    return absolute(quantity, 0.0, float(error), allowed)


def run(problem: Problem) -> Outcome:
    """Compute a problem; what stops it makes it fail, and does not stop the others."""
    from fingerslip.linear.resources import limited_threads

    try:
        # The dense problems beside the simulations are tiny: threads that wait for each other make them slower.
        with limited_threads(1):
            return Outcome(problem, problem.checks())
    except FingerslipError as error:
        return Outcome(problem, (absolute("could not be computed", 0.0, np.nan, 0.0),), str(error))


def solve_problem(model: Model, penetration: float | None = None) -> xr.Dataset:
    """Simulate a model and hold its history against what every history has to keep, and a largest penetration [m]."""
    # Slow to import, and some problems solve no motion.
    from fingerslip.dynamics.simulation import simulate

    history = simulate(model)
    scale = max(np.abs(history[name].values).max() for name in ("external_work", "kinetic_energy", "strain_energy"))
    imbalance = float(np.abs(history["energy_imbalance"].values).max())
    # Rounding of thousands of steps, or what Newton's method leaves; a wrong sign or force anywhere gives per cents.
    if imbalance > (1e-5 if model.is_finite else 1e-7) * scale:
        raise VerificationError(f"energy is out of balance by {imbalance / scale:.1e} of the largest energy")
    if not model.contacts:
        return history
    deepest = -float(history["gap"].values.min())
    if penetration is not None and deepest > penetration:
        raise VerificationError(f"a node is {deepest:.3g} m inside the rigid body, {penetration:.3g} m are allowed")
    frictional = any(contact.friction.coefficient > 0.0 for contact in model.contacts)
    if frictional and not history["tangential_traction"].values.any():
        raise VerificationError("the friction coefficient is above zero, but friction never acts")
    return history
