"""Materials: what a layer is made of, and how it damps."""

from __future__ import annotations

from typing import Annotated

import pydantic

from fingerslip.parameters import Density, Duration, Pressure, Rate, parameters

__all__ = ["Elastic", "RayleighDamping"]


@parameters
class Elastic:
    """Isotropic linear elasticity at small strain.

    Parameters
    ----------
    youngs_modulus : float
        Young's modulus [Pa].
    poisson_ratio : float
        Poisson's ratio [-], from 0 to 0.5.
    density : float
        Mass density [kg/m^3].
    """

    youngs_modulus: Pressure
    poisson_ratio: Annotated[float, pydantic.Field(ge=0, le=0.5)]
    density: Density

    @property
    def shear_modulus(self) -> float:
        """Shear modulus [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))


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
