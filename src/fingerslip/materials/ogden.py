"""Ogden elasticity of nearly incompressible rubber and tissue, with any number of terms.

With the isochoric principal stretches l_i = J^(-1/3) lambda_i the energy per reference volume is ::

    sum_p mu_p/alpha_p (l_1^alpha_p + l_2^alpha_p + l_3^alpha_p - 3) + K/2 (ln J)^2

as in Ogden, Proc. R. Soc. Lond. A 326 (1972) 565-584. The shear modulus at rest is half the sum of mu_p alpha_p. Other
codes print other moduli for the same law: those of Abaqus are mu_p alpha_p/2, those of FEBio mu_p alpha_p.
:mod:`fingerslip.materials.large_strain` has the part of the volume.
"""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Literal

from fingerslip.errors import InputError
from fingerslip.materials.large_strain import BulkModulus, PoissonRatio, Power, PowersOfStretches, StableBetween
from fingerslip.materials.prony import Prony
from fingerslip.parameters import Density, Number, SignedPressure, parameters


@parameters
class OgdenTerm:
    """One power of the stretches in Ogden's law."""

    modulus: Annotated[SignedPressure, "The factor mu [Pa], of the sign of the exponent in most materials."]
    exponent: Annotated[Number, "The exponent alpha of the stretches [-], not 0."]

    def __post_init__(self) -> None:
        if self.exponent == 0.0:
            raise InputError("exponent", "got 0", "needs a number that is not 0")


@parameters
class Ogden(PowersOfStretches):
    """Ogden elasticity, nearly incompressible.

    Examples
    --------
    A term of 10 kPa with exponent 8 as Abaqus prints it:

    >>> import fingerslip as fs
    >>> skin = fs.Ogden((fs.OgdenTerm(modulus=2 * 10e3 / 8.0, exponent=8.0),), density=1000.0, poisson_ratio=0.49)
    >>> skin.shear_modulus
    10000.0
    """

    terms: Annotated[tuple[OgdenTerm, ...], "The powers of the stretches."]
    density: Annotated[Density, "Mass density in the reference state [kg/m^3]."]
    bulk_modulus: BulkModulus = None
    poisson_ratio: PoissonRatio = None
    stable_between: StableBetween = (0.5, 2.0)
    prony: Prony = field(default=(), kw_only=True)
    law: Annotated[Literal["ogden"], "The law, as study files name it."] = field(
        default="ogden", kw_only=True, repr=False
    )

    def __post_init__(self) -> None:
        if not self.terms:
            raise InputError("terms", "is empty", "needs at least one term")
        if self.shear_modulus <= 0.0:
            fault = f"has a sum of modulus times exponent of {2.0 * self.shear_modulus:.6g} Pa"
            raise InputError("terms", fault, "needs a sum > 0, twice the shear modulus")
        self.check_stable()

    @property
    def powers(self) -> tuple[Power, ...]:
        """The factor [Pa] and the exponent [-] of every term."""
        return tuple((term.modulus, term.exponent) for term in self.terms)
