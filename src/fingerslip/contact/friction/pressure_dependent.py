"""Friction that is a power of the pressure."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.contact.friction.law import Conditions, Isotropic
from fingerslip.parameters import NonNegativeNumber, Number, Pressure, parameters

# Share of the reference pressure below which the coefficient no longer changes.
_LOWEST_PRESSURE = 0.01


@parameters
class PressureDependent(Isotropic):
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

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> from fingerslip.contact.friction import Conditions
    >>> from fingerslip.contact.solve.projection import project
    >>> law = fs.PressureDependent(reference_coefficient=0.6, reference_pressure=1e3, exponent=-1 / 3)
    >>> at_rest = Conditions(np.array([1e3, 8e3]), np.zeros(2), np.zeros(2), time=0.0)
    >>> project(np.array([[1e3, -500.0], [8e3, -4e3]]), law.coefficients(at_rest)).round(9).tolist()
    [[1000.0, -500.0], [8000.0, -2400.0]]
    """

    reference_coefficient: NonNegativeNumber
    reference_pressure: Pressure
    exponent: Annotated[Number, pydantic.Field(gt=-1.0, le=1.0)]

    @property
    def coefficient(self) -> float:
        """Coefficient at the reference pressure [-]."""
        return self.reference_coefficient

    def coefficients(self, conditions: Conditions) -> Floats:
        """Return the friction coefficient of every node, shape (n,) [-]."""
        relative = np.maximum(conditions.pressure / self.reference_pressure, _LOWEST_PRESSURE)
        return np.asarray(self.reference_coefficient * relative**self.exponent)
