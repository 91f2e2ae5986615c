"""Friction laws: how large the tangential traction may be.

A law gives the friction coefficient mu of every contact node for one step. With the pressure p, the tangential traction
t_0 at the start of the step, the stiffness k_t of the contact and the tangential motion d of the step, the traction t
follows from Coulomb's law with that coefficient by return mapping (Simo & Laursen 1992)::

    trial    t* = t_0 - k_t d
    stick    t = t*                  where |t*| <= mu p
    slip     t = mu p t* / |t*|      elsewhere

The coefficient is taken from the conditions at the start of the step. This is exact for constant coefficients and first
order in the step for the others; within a step, the problem is solved to its full tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Protocol

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.parameters import NonNegativeNumber, Number, PositiveLength, Pressure, Speed, parameters

__all__ = [
    "ISOTROPIC",
    "Anisotropic",
    "BuiltInLaw",
    "Conditions",
    "Coulomb",
    "FrictionLaw",
    "PressureDependent",
    "SlipWeakening",
    "StaticKinetic",
    "TangentFrame",
]

Array = NDArray[np.float64]

# Share of the reference pressure below which a pressure-dependent coefficient no longer changes.
_LOWEST_PRESSURE = 0.01


@dataclass(frozen=True)
class Conditions:
    """What a friction law may depend on, at n contact nodes.

    Parameters
    ----------
    pressure : (n,) array
        Pressure at the start of the step [Pa], zero where the contact is open.
    slip_rate : (n,) array
        Slip of the last step over its duration [m/s], not negative.
    slip_since_contact : (n,) array
        Slip accumulated since the node came into contact [m]. A node that sticks keeps it, so that it is continuous in
        the motion; one that opens begins anew. Histories record ``slip_distance``, which never begins anew.
    time : float
        End of the step, for which the coefficient is needed [s].
    """

    pressure: Array
    slip_rate: Array
    slip_since_contact: Array
    time: float

    def at(self, nodes: NDArray[np.bool_]) -> Conditions:
        """Return the conditions at some of the nodes, which a mask (n,) marks."""
        return replace(
            self,
            pressure=self.pressure[nodes],
            slip_rate=self.slip_rate[nodes],
            slip_since_contact=self.slip_since_contact[nodes],
        )


@dataclass(frozen=True)
class TangentFrame:
    """The tangents in which a friction law is isotropic.

    Parameters
    ----------
    direction : tuple of float, optional
        Direction of the first tangent, as near as the surface allows [-]; without it the counterface's own.
    stretch : float
        Length of the second tangent [-]. Lengths other than one turn an elliptic friction cone into a circular one,
        while force times displacement is unchanged.
    """

    direction: tuple[float, ...] | None = None
    stretch: float = 1.0


ISOTROPIC = TangentFrame()


class FrictionLaw(Protocol):
    """The friction coefficient of contact nodes, and the frame and the dimensions in which it holds."""

    @property
    def coefficient(self) -> float:
        """Reference friction coefficient [-], which histories record."""

    @property
    def dims(self) -> tuple[int, ...]:
        """Numbers of space dimensions in which the law works."""

    @property
    def frame(self) -> TangentFrame:
        """Tangents in which the law is isotropic."""

    def coefficients(self, conditions: Conditions) -> Array:
        """Return the friction coefficient of every node, along the first tangent, shape (n,) [-]."""


@parameters
class Coulomb:
    """Coulomb's law: the tangential traction is at most a constant times the pressure.

    mu = coefficient (Popov 2010, chapter 10).

    Parameters
    ----------
    coefficient : float
        Friction coefficient [-]; 0 is frictionless.

    Examples
    --------
    Under 2 kPa, a node with a trial traction of 800 Pa sticks and one with 1500 Pa slips:

    >>> from fingerslip.contact.solve.projection import project
    >>> at_rest = Conditions(np.full(2, 2e3), np.zeros(2), np.zeros(2), time=0.0)
    >>> project(np.array([[2e3, -800.0], [2e3, -1500.0]]), Coulomb(0.5).coefficients(at_rest)).tolist()
    [[2000.0, -800.0], [2000.0, -1000.0]]
    """

    dims: ClassVar[tuple[int, ...]] = (2, 3)
    frame: ClassVar[TangentFrame] = ISOTROPIC

    coefficient: NonNegativeNumber

    def coefficients(self, conditions: Conditions) -> Array:
        """Return the friction coefficient of every node, shape (n,) [-]."""
        return np.full(conditions.pressure.shape, self.coefficient)


@parameters
class StaticKinetic:
    """Friction that drops from a static to a kinetic coefficient with the slip rate.

    mu = kinetic + (static - kinetic) exp(-slip_rate / decay_speed) (Armstrong-Hélouvry, Dupont & Canudas de Wit 1994).
    The slip rate is that of the step before. In quasi-static motion the law therefore slides steadily only at steps
    longer than ``|d mu / d slip_rate| p / k``, with the pressure p and the stiffness k per area of what holds it;
    at shorter ones it sticks and slips from step to step.

    Parameters
    ----------
    static, kinetic : float
        Coefficients at rest and at large slip rate [-].
    decay_speed : float
        Slip rate at which 63 % of the drop has happened [m/s].

    Examples
    --------
    Of two nodes with the same trial traction, the one at rest sticks and the one that slides goes on at a lower force:

    >>> from fingerslip.contact.solve.projection import project
    >>> sliding = Conditions(np.full(2, 2e3), np.array([0.0, 1.0]), np.array([0.0, 1e-3]), time=0.0)
    >>> law = StaticKinetic(static=0.8, kinetic=0.5, decay_speed=1e-3)
    >>> project(np.full((2, 2), [2e3, -1500.0]), law.coefficients(sliding)).tolist()
    [[2000.0, -1500.0], [2000.0, -1000.0]]
    """

    dims: ClassVar[tuple[int, ...]] = (2, 3)
    frame: ClassVar[TangentFrame] = ISOTROPIC

    static: NonNegativeNumber
    kinetic: NonNegativeNumber
    decay_speed: Speed

    @property
    def coefficient(self) -> float:
        """Coefficient at rest [-]."""
        return self.static

    def coefficients(self, conditions: Conditions) -> Array:
        """Return the friction coefficient of every node, shape (n,) [-]."""
        share: Array = np.exp(-np.abs(conditions.slip_rate) / self.decay_speed)
        return self.kinetic + (self.static - self.kinetic) * share


@parameters
class SlipWeakening:
    """Friction that falls from a static to a kinetic coefficient over a slip distance.

    ::

        mu(s) = static - (static - kinetic) min(s / distance, 1)

    with the slip s of a node: linear slip weakening (Ida 1972; Palmer & Rice 1973). Slip along this line takes the work
    (static - kinetic) p distance / 2 per area beyond that of the kinetic coefficient, and it sets a length and a time
    for what lets go at once. Under a pressure p, slip is steady where what holds the surface is stiffer per area than
    (static - kinetic) p / distance, and runs away where it is softer, whatever the step.

    s is the slip since the node came into contact. A node that sticks again keeps it and stays as weak as it was:
    contact does not heal while it is closed. A node that opens and lands again touches other points of the
    counterface and is as strong as at first. s is that at the start of the step, so friction is late by the slip of a
    step: pairs of s and mu lie on the line exactly, forces and work over time come to it with the first order.

    Parameters
    ----------
    static, kinetic : float
        Coefficients before slip and from the slip distance on [-].
    distance : float
        Slip over which the coefficient falls [m].

    Examples
    --------
    Of three nodes with the same trial traction, the one that has not slipped sticks; those that have slipped by half of
    the distance and by more than all of it go on at lower forces:

    >>> from fingerslip.contact.solve.projection import project
    >>> slipped = Conditions(np.full(3, 2e3), np.zeros(3), np.array([0.0, 10e-6, 50e-6]), time=0.0)
    >>> law = SlipWeakening(static=0.8, kinetic=0.5, distance=20e-6)
    >>> project(np.full((3, 2), [2e3, -1500.0]), law.coefficients(slipped)).tolist()
    [[2000.0, -1500.0], [2000.0, -1300.0], [2000.0, -1000.0]]
    """

    dims: ClassVar[tuple[int, ...]] = (2, 3)
    frame: ClassVar[TangentFrame] = ISOTROPIC

    static: NonNegativeNumber
    kinetic: NonNegativeNumber
    distance: PositiveLength

    @property
    def coefficient(self) -> float:
        """Coefficient before slip [-]."""
        return self.static

    def coefficients(self, conditions: Conditions) -> Array:
        """Return the friction coefficient of every node, shape (n,) [-]."""
        share: Array = np.minimum(conditions.slip_since_contact / self.distance, 1.0)
        return self.static - (self.static - self.kinetic) * share


@parameters
class PressureDependent:
    """Friction whose coefficient is a power of the pressure, as on soft skin.

    mu = reference_coefficient (p / reference_pressure)^exponent, constant below a hundredth of the reference pressure
    so that it stays finite where contact ends. The exponent -1/3 follows from adhesion on the area of a Hertz contact
    (Adams, Briscoe & Johnson 2007).

    Parameters
    ----------
    reference_coefficient : float
        Coefficient at the reference pressure [-].
    reference_pressure : float
        Pressure at which the reference coefficient holds [Pa].
    exponent : float
        Power of the pressure, above -1 so that friction grows with load [-].

    Examples
    --------
    Eight times the pressure halves the coefficient. Of two nodes pulled at half their pressure, the first sticks:

    >>> from fingerslip.contact.solve.projection import project
    >>> law = PressureDependent(reference_coefficient=0.6, reference_pressure=1e3, exponent=-1 / 3)
    >>> at_rest = Conditions(np.array([1e3, 8e3]), np.zeros(2), np.zeros(2), time=0.0)
    >>> project(np.array([[1e3, -500.0], [8e3, -4e3]]), law.coefficients(at_rest)).round(9).tolist()
    [[1000.0, -500.0], [8000.0, -2400.0]]
    """

    dims: ClassVar[tuple[int, ...]] = (2, 3)
    frame: ClassVar[TangentFrame] = ISOTROPIC

    reference_coefficient: NonNegativeNumber
    reference_pressure: Pressure
    exponent: Annotated[Number, pydantic.Field(gt=-1.0, le=1.0)]

    @property
    def coefficient(self) -> float:
        """Coefficient at the reference pressure [-]."""
        return self.reference_coefficient

    def coefficients(self, conditions: Conditions) -> Array:
        """Return the friction coefficient of every node, shape (n,) [-]."""
        relative = np.maximum(conditions.pressure / self.reference_pressure, _LOWEST_PRESSURE)
        values: Array = self.reference_coefficient * relative**self.exponent
        return values


@parameters
class Anisotropic:
    """Friction with an elliptic cone: one coefficient along a direction, another across it; for contact in space.

    The traction (t_1, t_2), along and across, stays in the ellipse (t_1 / along)^2 + (t_2 / across)^2 <= p^2, and slip
    is normal to the ellipse: the associated sliding rule of Michałowski & Mróz (1978).

    Parameters
    ----------
    along, across : float
        Friction coefficients [-], both above zero.
    direction : tuple of float
        The first direction [-]; its part along the surface counts.

    Examples
    --------
    Under 2 kPa, a node pulled by a trial traction of 1 kPa sticks along the first direction and slips across it:

    >>> from fingerslip.contact.solve.projection import project
    >>> law = Anisotropic(along=0.6, across=0.3)
    >>> at_rest = Conditions(np.full(2, 2e3), np.zeros(2), np.zeros(2), time=0.0)
    >>> frame = np.array([1.0, 1.0, law.frame.stretch])
    >>> trial = np.array([[2e3, -1e3, 0.0], [2e3, 0.0, -1e3]]) / frame
    >>> (project(trial, law.coefficients(at_rest)) * frame).tolist()
    [[2000.0, -1000.0, 0.0], [2000.0, 0.0, -600.0]]
    """

    dims: ClassVar[tuple[int, ...]] = (3,)

    along: Annotated[Number, pydantic.Field(gt=0)]
    across: Annotated[Number, pydantic.Field(gt=0)]
    direction: tuple[float, ...] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if len(self.direction) != 3 or not any(self.direction):
            raise InputError("direction", f"got {self.direction}", "needs three components, not all zero")

    @property
    def coefficient(self) -> float:
        """Coefficient along the first direction [-]."""
        return self.along

    @property
    def frame(self) -> TangentFrame:
        """Tangents along and across the direction; the second one turns the ellipse into a circle."""
        return TangentFrame(self.direction, self.across / self.along)

    def coefficients(self, conditions: Conditions) -> Array:
        """Return the friction coefficient of every node along the first direction, shape (n,) [-]."""
        return np.full(conditions.pressure.shape, self.along)


# What study files can name, each by its class in snake case.
BuiltInLaw = Coulomb | StaticKinetic | PressureDependent | Anisotropic | SlipWeakening
