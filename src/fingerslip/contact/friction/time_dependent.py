"""Friction that changes over time."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.friction.law import Conditions, Isotropic
from fingerslip.errors import InputError
from fingerslip.parameters import Duration, NonNegativeNumber, parameters


@parameters
class TimeDependent(Isotropic):
    """Coulomb's law with a coefficient that changes over time, as where a surface becomes wet or a finger sweats.

    mu(t) is linear between given times, and constant before the first and after the last of them. Every step takes the
    coefficient at its end.

    Parameters
    ----------
    times : tuple of float
        Ascending times [s].
    values : tuple of float
        The friction coefficient at each [-].

    Examples
    --------
    A node under 2 kPa with a trial traction of 800 Pa sticks at first, and slips when the coefficient has halved:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> from fingerslip.contact.friction import Conditions
    >>> from fingerslip.contact.solve.projection import project
    >>> law = fs.TimeDependent(times=(1.0, 2.0), values=(0.5, 0.25))
    >>> for time in (1.0, 2.0):
    ...     now = Conditions(np.array([2e3]), np.zeros(1), np.zeros(1), time)
    ...     print(project(np.array([[2e3, -800.0]]), law.coefficients(now)).tolist())
    [[2000.0, -800.0]]
    [[2000.0, -500.0]]
    """

    times: tuple[Duration, ...]
    values: tuple[NonNegativeNumber, ...]

    def __post_init__(self) -> None:
        ascending = all(early < late for early, late in pairwise(self.times))
        if not self.times or not ascending:
            raise InputError("times", f"got {list(self.times)}", "needs ascending times, at least one")
        if len(self.times) != len(self.values):
            fault = f"got {len(self.values)} for {len(self.times)} times"
            raise InputError("values", fault, "needs one for each time")

    @property
    def coefficient(self) -> float:
        """Coefficient at the first time [-]."""
        return self.values[0]

    def coefficients(self, conditions: Conditions) -> Floats:
        """Return the friction coefficient of every node, shape (n,) [-]."""
        now = float(np.interp(conditions.time, self.times, self.values))
        return np.full(conditions.pressure.shape, now)
