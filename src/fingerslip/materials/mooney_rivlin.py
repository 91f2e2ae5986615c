"""Mooney-Rivlin elasticity of nearly incompressible rubber; with one constant the isochoric neo-Hookean law.

With the isochoric principal stretches l_i = J^(-1/3) lambda_i the energy per reference volume is ::

    c10 (l_1^2 + l_2^2 + l_3^2 - 3) + c01 (l_1^-2 + l_2^-2 + l_3^-2 - 3) + K/2 (ln J)^2

after Mooney, J. Appl. Phys. 11 (1940) 582-592, and Rivlin, Phil. Trans. R. Soc. A 241 (1948) 379-397; FEBio has the
same law as "Mooney-Rivlin". The shear modulus at rest is 2 (c10 + c01). :mod:`fingerslip.materials.isochoric` has the
part of the volume.
"""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.isochoric import (
    check_stability,
    chosen_bulk_modulus,
    deviator,
    isochoric_tangent,
    linearised,
    summed,
    volumetric_energy,
)
from fingerslip.materials.prony import Prony, check_prony
from fingerslip.parameters import Density, Number, Pressure, SignedPressure, parameters

__all__ = ["MooneyRivlin"]

Array = NDArray[np.float64]


@parameters
class MooneyRivlin:
    """Mooney-Rivlin elasticity, nearly incompressible; the neo-Hookean law without `c01`.

    Parameters
    ----------
    c10 : float
        Factor of the first invariant [Pa].
    density : float
        Mass density in the reference state [kg/m^3].
    c01 : float
        Factor of the second invariant [Pa].
    bulk_modulus : float, optional
        Bulk modulus [Pa].
    poisson_ratio : float, optional
        Poisson's ratio at rest [-], from 0 to below 0.5; exactly one of the two is needed.
    stable_between : tuple of float
        Lowest and highest stretch [-] within which the law is held to be stable.
    prony : tuple of PronyTerm
        Terms by which the shear modulus relaxes; without them the material is elastic.
    law : {'mooney_rivlin'}
        The law, as study files name it.
    """

    c10: SignedPressure
    density: Density
    c01: SignedPressure = 0.0
    bulk_modulus: Pressure | None = None
    poisson_ratio: Annotated[Number, pydantic.Field(ge=0, lt=0.5)] | None = None
    stable_between: tuple[Number, Number] = (0.5, 2.0)
    prony: Prony = field(default=(), kw_only=True)
    law: Literal["mooney_rivlin"] = field(default="mooney_rivlin", kw_only=True, repr=False)

    def __post_init__(self) -> None:
        if self.shear_modulus <= 0.0:
            found = f"got c10 + c01 = {self.c10 + self.c01:.6g} Pa, half the shear modulus"
            raise InputError("c10", found, "needs a sum > 0")
        check_stability(self.kirchhoff_tangent, self.stable_between)
        check_prony(self.prony)

    @property
    def shear_modulus(self) -> float:
        """Shear modulus at rest [Pa]."""
        return 2.0 * (self.c10 + self.c01)

    @cached_property
    def bulk(self) -> float:
        """Bulk modulus [Pa], given or from Poisson's ratio."""
        return chosen_bulk_modulus(self.shear_modulus, self.bulk_modulus, self.poisson_ratio)

    @property
    def stiffness(self) -> float:
        """Young's modulus at rest [Pa], from which contact penalties are estimated."""
        return self.at_rest().youngs_modulus

    def at_rest(self) -> Elastic:
        """Return the law at small strain."""
        return linearised(self.shear_modulus, self.bulk, self.poisson_ratio, self.density, self.prony)

    def stored_energy(self, log_strain: Array) -> Array:
        """Return the strain energy per reference volume [J/m^3], shape (n,), of logarithmic strains (n, 3)."""
        twice = 2.0 * deviator(log_strain)
        energy = self.c10 * summed(np.expm1(twice)) + self.c01 * summed(np.expm1(-twice))
        return energy + self.volumetric(summed(log_strain))[0]

    def kirchhoff_stress(self, log_strain: Array) -> Array:
        """Return the principal Kirchhoff stresses [Pa], shape (n, 3), of logarithmic strains (n, 3)."""
        squares = np.exp(2.0 * deviator(log_strain))
        stress = deviator(2.0 * self.c10 * squares - 2.0 * self.c01 / squares)
        return stress + (self.bulk * summed(log_strain))[:, None]

    def kirchhoff_tangent(self, log_strain: Array) -> Array:
        """Return the derivative of the stresses [Pa], shape (n, 3, 3), at logarithmic strains (n, 3)."""
        squares = np.exp(2.0 * deviator(log_strain))
        tangent = isochoric_tangent(4.0 * self.c10 * squares + 4.0 * self.c01 / squares)
        tangent += self.bulk
        return tangent

    def volumetric(self, log_volume: Array) -> tuple[Array, Array, Array]:
        """Return K/2 (ln J)^2 and its two derivatives [Pa], each (n,), at ln J (n,)."""
        return volumetric_energy(self.bulk, log_volume)
