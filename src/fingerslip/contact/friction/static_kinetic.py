"""Friction that drops with the slip rate."""

from __future__ import annotations

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.friction.law import Conditions, Isotropic
from fingerslip.parameters import NonNegativeNumber, Speed, parameters


@parameters
class StaticKinetic(Isotropic):
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

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> from fingerslip.contact.friction import Conditions
    >>> from fingerslip.contact.solve.projection import project
    >>> sliding = Conditions(np.full(2, 2e3), np.array([0.0, 1.0]), np.array([0.0, 1e-3]), time=0.0)
    >>> law = fs.StaticKinetic(static=0.8, kinetic=0.5, decay_speed=1e-3)
    >>> project(np.full((2, 2), [2e3, -1500.0]), law.coefficients(sliding)).tolist()
    [[2000.0, -1500.0], [2000.0, -1000.0]]
    """

    static: NonNegativeNumber
    kinetic: NonNegativeNumber
    decay_speed: Speed

    @property
    def coefficient(self) -> float:
        """Coefficient at rest [-]."""
        return self.static

    def coefficients(self, conditions: Conditions) -> Floats:
        """Return the friction coefficient of every node, shape (n,) [-]."""
        share: Floats = np.exp(-np.abs(conditions.slip_rate) / self.decay_speed)
        return self.kinetic + (self.static - self.kinetic) * share
