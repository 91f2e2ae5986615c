"""Material damping."""

from __future__ import annotations

from fingerslip.parameters import Duration, Rate, parameters

__all__ = ["RayleighDamping"]


@parameters
class RayleighDamping:
    """Damping matrix as `mass` times the mass matrix plus `stiffness` times the stiffness matrix.

    Parameters
    ----------
    mass : float
        Mass-proportional coefficient [1/s].
    stiffness : float
        Stiffness-proportional coefficient [s].
    """

    mass: Rate = 0.0
    stiffness: Duration = 0.0
