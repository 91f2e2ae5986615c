"""Friction that falls over a slip distance."""

from __future__ import annotations

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.friction.law import Conditions, Isotropic
from fingerslip.parameters import NonNegativeNumber, PositiveLength, parameters


@parameters
class SlipWeakening(Isotropic):
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

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> from fingerslip.contact.friction import Conditions
    >>> from fingerslip.contact.solve.projection import project
    >>> slipped = Conditions(np.full(3, 2e3), np.zeros(3), np.array([0.0, 10e-6, 50e-6]), time=0.0)
    >>> law = fs.SlipWeakening(static=0.8, kinetic=0.5, distance=20e-6)
    >>> project(np.full((3, 2), [2e3, -1500.0]), law.coefficients(slipped)).tolist()
    [[2000.0, -1500.0], [2000.0, -1300.0], [2000.0, -1000.0]]
    """

    static: NonNegativeNumber
    kinetic: NonNegativeNumber
    distance: PositiveLength

    @property
    def coefficient(self) -> float:
        """Coefficient before slip [-]."""
        return self.static

    def coefficients(self, conditions: Conditions) -> Floats:
        """Return the friction coefficient of every node, shape (n,) [-]."""
        share: Floats = np.minimum(conditions.slip_since_contact / self.distance, 1.0)
        return self.static - (self.static - self.kinetic) * share
