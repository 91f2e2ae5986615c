"""What every friction law answers, and what it may depend on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

import numpy as np

from fingerslip.arrays import Flags, Floats

# Slips [m], slip rates [m/s] and a pressure [Pa] at which a law is asked whether it weakens.
_SLIPS = np.concatenate([[0.0], np.geomspace(1e-9, 1.0, 91)])
_PRESSURE = 1e3


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

    pressure: Floats
    slip_rate: Floats
    slip_since_contact: Floats
    time: float

    def at(self, nodes: Flags | slice) -> Conditions:
        """Return the conditions at some of the nodes, which a mask (n,) or a slice marks."""
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


class Isotropic:
    """What laws share that hold in 2D and in 3D, in all directions of the surface alike."""

    dims: ClassVar[tuple[int, ...]] = (2, 3)
    frame: ClassVar[TangentFrame] = ISOTROPIC


class FrictionLaw(Protocol):
    """The friction coefficient of contact nodes, and the frame and the dimensions in which it holds.

    A law whose coefficients never change says so by ``is_constant = True``: then many steps are taken at once.
    """

    @property
    def coefficient(self) -> float:
        """Reference friction coefficient [-], which histories record."""

    @property
    def dims(self) -> tuple[int, ...]:
        """Numbers of space dimensions in which the law works."""

    @property
    def frame(self) -> TangentFrame:
        """Tangents in which the law is isotropic."""

    def coefficients(self, conditions: Conditions) -> Floats:
        """Return the friction coefficient of every node, along the first tangent, shape (n,) [-]."""


def weakens(law: FrictionLaw) -> bool:
    """Tell whether friction falls as a node slips farther or faster, so that contact may stick and slip by itself.

    Examples
    --------
    >>> from fingerslip.contact.friction import Coulomb, StaticKinetic
    >>> weakens(Coulomb(0.6)), weakens(StaticKinetic(0.6, 0.5, decay_speed=1e-3))
    (False, True)
    """
    pressure, none = np.full(_SLIPS.size, _PRESSURE), np.zeros(_SLIPS.size)
    further = law.coefficients(Conditions(pressure, none, _SLIPS, time=0.0))
    faster = law.coefficients(Conditions(pressure, _SLIPS, none, time=0.0))
    return bool(np.any(np.diff([further, faster]) < 0.0))
