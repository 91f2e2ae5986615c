"""What the laws have in common whose energy of shape is a sum of powers of the isochoric stretches.

With the isochoric principal stretches l_i = J^(-1/3) lambda_i the energy per reference volume is ::

    sum_p mu_p/alpha_p (l_1^alpha_p + l_2^alpha_p + l_3^alpha_p - 3) + K/2 (ln J)^2

as in Ogden, Proc. R. Soc. Lond. A 326 (1972) 565-584; :mod:`fingerslip.materials.large_strain` says why the part of the
volume is this.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fingerslip.materials.elastic import Elastic
from fingerslip.materials.large_strain import (
    check_stability,
    chosen_bulk_modulus,
    deviator,
    isochoric_tangent,
    linearise,
    sum_columns,
    volumetric_energy,
)
from fingerslip.materials.prony import Prony, check_prony

__all__ = ["Power", "PowersOfStretches"]

Array = NDArray[np.float64]
#: A power of the isochoric stretches: its factor mu [Pa] and its exponent alpha [-].
Power: TypeAlias = tuple[float, float]


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
        """Bulk modulus [Pa], given or from Poisson's ratio."""
        return chosen_bulk_modulus(self.shear_modulus, self.bulk_modulus, self.poisson_ratio)

    @property
    def stiffness(self) -> float:
        """Young's modulus at rest [Pa], from which contact penalties are estimated."""
        return self.at_rest().youngs_modulus

    def at_rest(self) -> Elastic:
        """Return the law at small strain."""
        return linearise(self.shear_modulus, self.bulk, self.poisson_ratio, self.density, self.prony)

    def stored_energy(self, log_strain: Array) -> Array:
        """Return the strain energy per reference volume [J/m^3], shape (n,), of logarithmic strains (n, 3)."""
        shape, energy = deviator(log_strain), self.volumetric(sum_columns(log_strain))[0]
        for modulus, exponent in self.powers:
            energy += modulus / exponent * sum_columns(np.expm1(exponent * shape))
        return energy

    def kirchhoff_stress(self, log_strain: Array) -> Array:
        """Return the principal Kirchhoff stresses [Pa], shape (n, 3), of logarithmic strains (n, 3)."""
        shape = deviator(log_strain)
        powers = sum(modulus * np.exp(exponent * shape) for modulus, exponent in self.powers)
        return deviator(np.asarray(powers)) + (self.bulk * sum_columns(log_strain))[:, None]

    def kirchhoff_tangent(self, log_strain: Array) -> Array:
        """Return the derivative of the stresses [Pa], shape (n, 3, 3), at logarithmic strains (n, 3)."""
        shape = deviator(log_strain)
        rates = sum(modulus * exponent * np.exp(exponent * shape) for modulus, exponent in self.powers)
        tangent = isochoric_tangent(np.asarray(rates))
        tangent += self.bulk
        return tangent

    def volumetric(self, log_volume: Array) -> tuple[Array, Array, Array]:
        """Return K/2 (ln J)^2 and its two derivatives [Pa], each (n,), at ln J (n,)."""
        return volumetric_energy(self.bulk, log_volume)
