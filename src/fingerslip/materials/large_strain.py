"""What laws of large strain share: what every law answers, the split into shape and volume, how they are held stable.

A law is a function of the principal logarithmic strains e_i = ln(lambda_i), with the principal stretches lambda_i. Its
derivatives by them are the principal Kirchhoff stresses tau_i, which are the Cauchy stresses times J, the ratio of
current to reference volume, ln J = e_1 + e_2 + e_3. Being written in principal stretches, a law is isotropic and the
same after any rotation.

Most laws have one energy of the shape and one of the volume. The shape is in the isochoric principal stretches
l_i = J^(-1/3) lambda_i; with a sum of powers of them the energy per reference volume is ::

    sum_p mu_p/alpha_p (l_1^alpha_p + l_2^alpha_p + l_3^alpha_p - 3) + K/2 (ln J)^2

as in Ogden, Proc. R. Soc. Lond. A 326 (1972) 565-584. The energy of the volume, with the bulk modulus K, is that of
FEBio's laws of this kind and of the neo-Hookean law here: the pressure is linear in the logarithmic strains, so its
derivative is the constant K and costs nothing. The Cauchy pressure K ln J/J grows with the volume up to J = e = 2.7,
far beyond what a nearly incompressible layer reaches; see Doll & Schweizerhof, J. Appl. Mech. 67 (2000) 17-21, for this
and other functions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import product
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Protocol, TypeAlias, runtime_checkable

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.prony import Prony, check_prony
from fingerslip.parameters import Number, Pressure


def log_volume_of(log_strain: Floats) -> Floats:
    """Return ln J, shape (n,), of principal logarithmic strains (n, m): their sum, several times as fast as NumPy's."""
    total = log_strain[:, 0] + log_strain[:, 1]
    return np.asarray(total if log_strain.shape[1] == 2 else total + log_strain[:, 2])


@runtime_checkable
class FiniteMaterial(Protocol):
    """A law between large strain and stress, and what else a model asks of a material.

    The methods are pure: no mesh, no time. Logarithmic strains come in arrays of shape (n, 3), a row for each point.
    """

    @property
    def density(self) -> float:
        """Mass density in the reference state [kg/m^3]."""

    @property
    def stiffness(self) -> float:
        """Young's modulus at rest [Pa], from which contact penalties are estimated."""

    def at_rest(self) -> Elastic:
        """Return the law at small strain, with which `kinematics: small` computes."""

    def stored_energy(self, log_strain: Floats) -> Floats:
        """Return the strain energy per reference volume [J/m^3], shape (n,)."""

    def kirchhoff_stress(self, log_strain: Floats) -> Floats:
        """Return the principal Kirchhoff stresses [Pa], shape (n, 3): the derivative of the energy."""

    def kirchhoff_tangent(self, log_strain: Floats) -> Floats:
        """Return the derivative of the stresses by the logarithmic strains [Pa], shape (n, 3, 3), symmetric."""

    def volumetric(self, log_volume: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the part of the energy that grows with the bulk modulus, and its two derivatives, each (n,) [Pa].

        It is a function of ln J (n,) alone, zero with its slope at rest. Elements integrate it from mean volumes, so
        that they do not lock near incompressibility. What it leaves of the energy must stay bounded there.
        """


#: Principal logarithmic strains of the tests of an incompressible material, over that of the stretch of the test.
TESTS = MappingProxyType({"uniaxial": (1.0, -0.5, -0.5), "equibiaxial": (1.0, 1.0, -2.0), "planar": (1.0, 0.0, -1.0)})
#: Two directions of shape that are orthogonal to each other and to the change of volume.
SHAPES = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, -2.0]]) / np.sqrt([[2.0], [6.0]])
_STRETCHES = 400
_NOTHING = 1e-12  # stiffness against a change of shape, over the largest, that is taken for none [-]


def deviator(values: Floats) -> Floats:
    """Return (n, 3) values less the mean of their rows."""
    return values - (log_volume_of(values) / 3.0)[:, None]


def isochoric_tangent(rates: Floats) -> Floats:
    """Return the derivative (n, 3, 3) [Pa] of the deviator of stresses of rates (n, 3) [Pa] by the log strains."""
    tangent = (rates[:, :, None] + rates[:, None, :]) / -3.0
    tangent += (log_volume_of(rates) / 9.0)[:, None, None]
    diagonal = np.einsum("nii->ni", tangent)
    diagonal += rates
    return tangent


def check_stability(tangent: Callable[[Floats], Floats], stretches: tuple[float, float]) -> None:
    """Refuse a law that is not stable in Drucker's sense within a range of stretches.

    Stable means that the work of the change of stress on the change of strain is positive for every change: that the
    tangent of the Kirchhoff stress by the logarithmic strain is positive definite. Shape and volume do not couple, so
    it is enough to look at changes of shape, in the uniaxial, equibiaxial and planar test of the incompressible
    material.
    """
    low, high = stretches
    if not 0.0 < low < 1.0 < high:
        fault = f"got {low:g} and {high:g}"
        raise InputError("stable_between", fault, "needs a stretch between 0 and 1 and one above 1", "write [0.5, 2]")
    lost: dict[str, list[str]] = {}
    for (test, direction), (side, end) in product(TESTS.items(), zip(("below", "above"), stretches, strict=True)):
        path = np.linspace(0.0, np.log(end), _STRETCHES)
        stiffness = np.linalg.eigvalsh(SHAPES @ tangent(path[:, None] * np.array(direction)) @ SHAPES.T)
        # What rounding leaves of zero is none, so that a law is refused with the same words on every processor.
        rows = np.flatnonzero(stiffness[:, 0] <= _NOTHING * np.abs(stiffness).max())
        if rows.size:
            lost.setdefault(test, []).append(f"{side} {np.exp(path[rows[0]]):.3g}")
    if lost:
        allowed = f"needs to be stable for stretches of {low:g} to {high:g} in uniaxial, equibiaxial and planar tests"
        repair = "change the moduli, or narrow stable_between where the material is stretched less"
        limits = ", ".join(f"{test} {' and '.join(sides)}" for test, sides in lost.items())
        raise InputError("", f"is not stable (Drucker) at stretches: {limits}", allowed, repair)


#: A power of the isochoric stretches: its factor mu [Pa] and its exponent alpha [-].
Power: TypeAlias = tuple[float, float]
#: Powers of a law, the factor of (ln J)^2/2 [Pa], and whether the powers are those of isochoric stretches.
SumOfPowers: TypeAlias = tuple[Sequence[Power], float, bool]


#: What of its parameters several laws share.
BulkModulus: TypeAlias = Annotated[Pressure | None, "Bulk modulus [Pa]."]
PoissonRatio: TypeAlias = Annotated[
    Annotated[Number, pydantic.Field(ge=0, lt=0.5)] | None,
    "Poisson's ratio at rest [-], from 0 to below 0.5; exactly one of the two is needed.",
]
StableBetween: TypeAlias = Annotated[
    tuple[Number, Number], "Lowest and highest stretch [-] within which the law is held to be stable."
]


class PowersOfStretches:
    """A law of this kind: a parameter set with the fields below says its `powers`."""

    if TYPE_CHECKING:
        density: float
        bulk_modulus: float | None
        poisson_ratio: float | None
        stable_between: tuple[float, float]
        prony: Prony

        @property
        def powers(self) -> Sequence[Power]:
            """The powers of the stretches."""

    def check_stable(self) -> None:
        """Refuse moduli with which the law is not stable, and terms by which it cannot relax."""
        check_stability(self.kirchhoff_tangent, self.stable_between)
        check_prony(self.prony)

    @property
    def shear_modulus(self) -> float:
        """Shear modulus at rest [Pa]."""
        return 0.5 * sum(modulus * exponent for modulus, exponent in self.powers)

    @cached_property
    def bulk(self) -> float:
        """Bulk modulus [Pa], of which either itself or Poisson's ratio is given."""
        shear, bulk, ratio = self.shear_modulus, self.bulk_modulus, self.poisson_ratio
        if bulk is None:
            if ratio is None:
                raise InputError("bulk_modulus", "is missing", "needs a value", "or give poisson_ratio")
            return 2.0 * shear * (1.0 + ratio) / (3.0 * (1.0 - 2.0 * ratio))
        if ratio is not None:
            raise InputError("poisson_ratio", "is given with bulk_modulus", "needs one of the two", "leave one out")
        least = 2.0 * shear / 3.0
        if bulk < least:
            fault = f"got {bulk:.6g} Pa, too small against the shear modulus of {shear:.6g} Pa"
            allowed = f"needs at least {least:.6g} Pa, where Poisson's ratio is 0"
            raise InputError(
                "bulk_modulus", fault, allowed, "nearly incompressible layers have 10 to 1000 times as much"
            )
        return bulk

    @property
    def sum_of_powers(self) -> SumOfPowers:
        """The law as a sum of powers of the stretches."""
        return self.powers, self.bulk, True

    @property
    def stiffness(self) -> float:
        """Young's modulus at rest [Pa], from which contact penalties are estimated."""
        return self.at_rest().youngs_modulus

    @cached_property
    def _at_rest(self) -> Elastic:
        # Poisson's ratio is taken as it is given, so that no digit of it is lost.
        shear, ratio = self.shear_modulus, self.poisson_ratio
        if ratio is None:
            ratio = (1.5 * self.bulk - shear) / (3.0 * self.bulk + shear)
        return Elastic(2.0 * shear * (1.0 + ratio), ratio, self.density, prony=self.prony)

    def at_rest(self) -> Elastic:
        """Return the law at small strain."""
        return self._at_rest

    def stored_energy(self, log_strain: Floats) -> Floats:
        """Return the strain energy per reference volume [J/m^3], shape (n,), of logarithmic strains (n, 3)."""
        shape, energy = deviator(log_strain), self.volumetric(log_volume_of(log_strain))[0]
        for modulus, exponent in self.powers:
            energy += modulus / exponent * log_volume_of(np.expm1(exponent * shape))
        return energy

    def kirchhoff_stress(self, log_strain: Floats) -> Floats:
        """Return the principal Kirchhoff stresses [Pa], shape (n, 3), of logarithmic strains (n, 3)."""
        shape = deviator(log_strain)
        powers = sum(modulus * np.exp(exponent * shape) for modulus, exponent in self.powers)
        return deviator(np.asarray(powers)) + (self.bulk * log_volume_of(log_strain))[:, None]

    def kirchhoff_tangent(self, log_strain: Floats) -> Floats:
        """Return the derivative of the stresses [Pa], shape (n, 3, 3), at logarithmic strains (n, 3)."""
        shape = deviator(log_strain)
        rates = sum(modulus * exponent * np.exp(exponent * shape) for modulus, exponent in self.powers)
        return isochoric_tangent(np.asarray(rates)) + self.bulk

    def volumetric(self, log_volume: Floats) -> tuple[Floats, Floats, Floats]:
        """Return K/2 (ln J)^2 and its two derivatives [Pa], each (n,), at ln J (n,)."""
        pressure = self.bulk * log_volume
        return 0.5 * pressure * log_volume, pressure, np.full_like(log_volume, self.bulk)
