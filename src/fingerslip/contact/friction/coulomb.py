"""Coulomb's law."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.friction.law import Conditions, Isotropic
from fingerslip.parameters import NonNegativeNumber, parameters


@parameters
class Coulomb(Isotropic):
    """Coulomb's law: the tangential traction is at most a constant times the pressure.

    mu = coefficient (Popov 2010, chapter 10).

    Parameters
    ----------
    coefficient : float
        Friction coefficient [-]; 0 is frictionless.

    Examples
    --------
    Under 2 kPa, a node with a trial traction of 800 Pa sticks and one with 1500 Pa slips:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> from fingerslip.contact.friction import Conditions
    >>> from fingerslip.contact.solve.projection import project
    >>> at_rest = Conditions(np.full(2, 2e3), np.zeros(2), np.zeros(2), time=0.0)
    >>> project(np.array([[2e3, -800.0], [2e3, -1500.0]]), fs.Coulomb(0.5).coefficients(at_rest)).tolist()
    [[2000.0, -800.0], [2000.0, -1000.0]]
    """

    is_constant: ClassVar[bool] = True

    coefficient: NonNegativeNumber

    def coefficients(self, conditions: Conditions) -> Floats:
        """Return the friction coefficient of every node, shape (n,) [-]."""
        return np.full(conditions.pressure.shape, self.coefficient)
