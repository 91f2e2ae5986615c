"""Friction with an elliptic cone."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.contact.friction.law import Conditions, TangentFrame
from fingerslip.errors import InputError
from fingerslip.parameters import Number, parameters


@parameters
class Anisotropic:
    """Friction with an elliptic cone: one coefficient along a direction, another across it; for contact in 3D.

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

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> from fingerslip.contact.friction import Conditions
    >>> from fingerslip.contact.solve.projection import project
    >>> law = fs.Anisotropic(along=0.6, across=0.3)
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

    def coefficients(self, conditions: Conditions) -> Floats:
        """Return the friction coefficient of every node along the first direction, shape (n,) [-]."""
        return np.full(conditions.pressure.shape, self.along)
