"""Mooney-Rivlin elasticity of nearly incompressible rubber; with one constant the isochoric neo-Hookean law.

With the isochoric principal stretches l_i = J^(-1/3) lambda_i the energy per reference volume is ::

    c10 (l_1^2 + l_2^2 + l_3^2 - 3) + c01 (l_1^-2 + l_2^-2 + l_3^-2 - 3) + K/2 (ln J)^2

after Mooney, J. Appl. Phys. 11 (1940) 582-592, and Rivlin, Phil. Trans. R. Soc. A 241 (1948) 379-397; FEBio has the
same law as "Mooney-Rivlin". The shear modulus at rest is 2 (c10 + c01). The part of the volume is that of
:mod:`fingerslip.materials.large_strain`.
"""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Literal

from fingerslip.errors import InputError
from fingerslip.materials.large_strain import BulkModulus, PoissonRatio, Power, PowersOfStretches, StableBetween
from fingerslip.materials.prony import Prony
from fingerslip.parameters import Density, SignedPressure, parameters


@parameters
class MooneyRivlin(PowersOfStretches):
    """Mooney-Rivlin elasticity, nearly incompressible; the neo-Hookean law without `c01`.

    Examples
    --------
    >>> import fingerslip as fs
    >>> rubber = fs.MooneyRivlin(c10=4e3, c01=1e3, density=1000.0, poisson_ratio=0.49)
    >>> rubber.shear_modulus
    10000.0
    """

    c10: Annotated[SignedPressure, "Factor of the first invariant [Pa]."]
    density: Annotated[Density, "Mass density in the reference state [kg/m^3]."]
    c01: Annotated[SignedPressure, "Factor of the second invariant [Pa]."] = 0.0
    bulk_modulus: BulkModulus = None
    poisson_ratio: PoissonRatio = None
    stable_between: StableBetween = (0.5, 2.0)
    prony: Prony = field(default=(), kw_only=True)
    law: Annotated[Literal["mooney_rivlin"], "The law, as study files name it."] = field(
        default="mooney_rivlin", kw_only=True, repr=False
    )

    def __post_init__(self) -> None:
        if self.shear_modulus <= 0.0:
            fault = f"got c10 + c01 = {self.c10 + self.c01:.6g} Pa, half the shear modulus"
            raise InputError("c10", fault, "needs a sum > 0")
        self.check_stable()

    @property
    def powers(self) -> tuple[Power, Power]:
        """The squares of the stretches and of their reciprocals, each with its factor [Pa]."""
        return (2.0 * self.c10, 2.0), (-2.0 * self.c01, -2.0)
