"""Compressible neo-Hookean elasticity: rubber-like at large strain, Hooke's law at small strain.

With G and Lame's first constant lambda, the energy per reference volume is ::

    G/2 (tr C - 3) - G ln J + lambda/2 (ln J)^2

as in Bonet & Wood (2008), Nonlinear Continuum Mechanics for Finite Element Analysis, section 6.4.3. Many codes have
the same law, such as FEBio as "neo-Hookean".
"""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.materials.elastic import ByYoungsModulus, Elastic
from fingerslip.materials.large_strain import SumOfPowers, log_volume_of
from fingerslip.materials.prony import Prony
from fingerslip.parameters import Density, Number, Pressure, parameters


@parameters
class NeoHookean(ByYoungsModulus):
    """Compressible neo-Hookean elasticity.

    Examples
    --------
    Tension that stretches it by half at constant volume, beside that of Hooke's law:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> rubber = fs.NeoHookean(youngs_modulus=30e3, poisson_ratio=0.49, density=1000.0)
    >>> along, across, _ = rubber.kirchhoff_stress(np.log([[1.5, 1.5**-0.5, 1.5**-0.5]]))[0]
    >>> f"{along - across:.0f} Pa, {30e3 * 0.5:.0f} Pa"
    '15940 Pa, 15000 Pa'
    """

    youngs_modulus: Annotated[Pressure, "Young's modulus at rest [Pa]."]
    poisson_ratio: Annotated[Number, pydantic.Field(ge=0, lt=0.5), "Poisson's ratio at rest [-], from 0 to below 0.5."]
    density: Annotated[Density, "Mass density in the reference state [kg/m^3]."]
    prony: Prony = field(default=(), kw_only=True)
    law: Annotated[Literal["neo_hookean"], "The law, as study files name it."] = field(
        default="neo_hookean", kw_only=True, repr=False
    )

    @cached_property
    def first_lame(self) -> float:
        """Lame's first constant at rest [Pa]."""
        return self.at_rest().dilatational_modulus("solid")

    @cached_property
    def _at_rest(self) -> Elastic:
        return Elastic(self.youngs_modulus, self.poisson_ratio, self.density, prony=self.prony)

    @property
    def sum_of_powers(self) -> SumOfPowers:
        """The law as a sum of powers of the stretches."""
        return ((self.shear_modulus, 2.0),), self.first_lame, False

    def at_rest(self) -> Elastic:
        """Return the law at small strain."""
        return self._at_rest

    def stored_energy(self, log_strain: Floats) -> Floats:
        """Return the strain energy per reference volume [J/m^3], shape (n,), of logarithmic strains (n, 3)."""
        log_volume = log_volume_of(log_strain)
        stretched = 0.5 * (np.exp(2.0 * log_strain).sum(axis=1) - 3.0) - log_volume
        return np.asarray(self.shear_modulus * stretched + 0.5 * self.first_lame * log_volume**2)

    def kirchhoff_stress(self, log_strain: Floats) -> Floats:
        """Return the principal Kirchhoff stresses [Pa], shape (n, 3), of logarithmic strains (n, 3)."""
        stress = np.exp(2.0 * log_strain)
        stress *= self.shear_modulus
        stress += (self.first_lame * log_volume_of(log_strain) - self.shear_modulus)[:, None]
        return stress

    def kirchhoff_tangent(self, log_strain: Floats) -> Floats:
        """Return the derivative of the stresses [Pa], shape (n, 3, 3), at logarithmic strains (n, 3)."""
        tangent = np.full((len(log_strain), 3, 3), self.first_lame)
        axes = np.arange(3)
        tangent[:, axes, axes] += 2.0 * self.shear_modulus * np.exp(2.0 * log_strain)
        return tangent

    def volumetric(self, log_volume: Floats) -> tuple[Floats, Floats, Floats]:
        """Return lambda/2 (ln J)^2 and its two derivatives [Pa], each (n,), at ln J (n,)."""
        modulus = self.first_lame
        return 0.5 * modulus * log_volume**2, modulus * log_volume, np.full_like(log_volume, modulus)
