"""Friction laws: how large the tangential traction may get.

A law turns the pressure and the slip rate at the start of a step into the friction coefficient of the step. That
is exact for constant coefficients and first order in the step for the others; within a step the problem stays
that of Coulomb's law, which is solved to its full tolerance.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.parameters import NonNegativeNumber, Pressure, Speed, parameters

__all__ = ["Anisotropic", "Coulomb", "FrictionLaw", "PressureDependent", "StaticKinetic"]

Array = NDArray[np.float64]


@parameters
class Coulomb:
    """Coulomb's law: the tangential traction is at most the coefficient times the normal one.

    Parameters
    ----------
    coefficient : float
        Friction coefficient [-]; 0 is frictionless.
    """

    coefficient: NonNegativeNumber

    def coefficients(self, pressure: Array, slip_rate: Array) -> Array:
        """Return the friction coefficient at nodes with `pressure` (n,) [Pa] and `slip_rate` (n,) [m/s], shape (n,)."""
        return np.full(pressure.shape, self.coefficient) + 0.0 * slip_rate


@parameters
class StaticKinetic:
    """Friction that drops from a static to a kinetic coefficient with the slip rate.

    The coefficient is ``kinetic + (static - kinetic) exp(-slip_rate / decay_speed)``. The slip rate is that of the
    step before, so in quasi-static sliding the law needs steps in which the drop stays below the penalty's own force.

    Parameters
    ----------
    static, kinetic : float
        Coefficients at rest and at large slip rate [-].
    decay_speed : float
        Slip rate at which 63 % of the drop has happened [m/s].
    """

    static: NonNegativeNumber
    kinetic: NonNegativeNumber
    decay_speed: Speed

    @property
    def coefficient(self) -> float:
        """Coefficient at rest [-]."""
        return self.static

    def coefficients(self, pressure: Array, slip_rate: Array) -> Array:
        """Return the friction coefficient at nodes with `pressure` (n,) [Pa] and `slip_rate` (n,) [m/s], shape (n,)."""
        share: Array = np.exp(-np.abs(slip_rate) / self.decay_speed) + 0.0 * pressure
        return self.kinetic + (self.static - self.kinetic) * share


@parameters
class PressureDependent:
    """Friction whose coefficient is a power of the pressure, as on soft skin.

    The coefficient is reference_coefficient (pressure / reference_pressure)^exponent, held constant below a
    hundredth of the reference pressure so that it stays finite where contact ends.

    Parameters
    ----------
    reference_coefficient : float
        Coefficient at the reference pressure [-].
    reference_pressure : float
        [Pa].
    exponent : float
        Power of the pressure, above -1 so that friction grows with load [-]; -1/3 is Hertz adhesion.
    """

    reference_coefficient: NonNegativeNumber
    reference_pressure: Pressure
    exponent: Annotated[float, pydantic.Field(gt=-1.0, le=1.0)]

    @property
    def coefficient(self) -> float:
        """Coefficient at the reference pressure [-]."""
        return self.reference_coefficient

    def coefficients(self, pressure: Array, slip_rate: Array) -> Array:
        """Return the friction coefficient at nodes with `pressure` (n,) [Pa] and `slip_rate` (n,) [m/s], shape (n,)."""
        relative = np.maximum(pressure / self.reference_pressure, _LOWEST_PRESSURE)
        values: Array = self.reference_coefficient * relative**self.exponent + 0.0 * slip_rate
        return values


@parameters
class Anisotropic:
    """Friction with an elliptic cone: one coefficient along a direction, another across it.

    The traction (along, across) stays in the ellipse with half axes `along` and `across` times the normal one, and
    slip is normal to that ellipse. For contact in space.

    Parameters
    ----------
    along, across : float
        Friction coefficients [-], both above zero.
    direction : tuple of float
        The first direction; its part along the surface counts.
    """

    along: Annotated[float, pydantic.Field(gt=0)]
    across: Annotated[float, pydantic.Field(gt=0)]
    direction: tuple[float, ...] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if len(self.direction) != 3 or not any(self.direction):
            raise InputError("direction", f"got {self.direction}", "needs three components, not all zero")

    @property
    def coefficient(self) -> float:
        """Coefficient along the first direction [-]."""
        return self.along

    def coefficients(self, pressure: Array, slip_rate: Array) -> Array:
        """Return the friction coefficient along the first direction at nodes, shape (n,)."""
        return np.full(pressure.shape, self.along) + 0.0 * slip_rate


FrictionLaw = Coulomb | StaticKinetic | PressureDependent | Anisotropic

_LOWEST_PRESSURE = 0.01
