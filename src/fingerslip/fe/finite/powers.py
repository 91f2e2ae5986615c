"""Bodies whose laws are all sums of powers of the stretches: stresses, thickness and energies of all points at once.

With principal logarithmic strains e_i, ln J their sum, and x_i = e_i, or in isochoric laws x_i = e_i - ln J/3, the
energy per reference volume is sum_p mu_p/alpha_p (sum_i exp(alpha_p x_i) - 3) + K/2 (ln J)^2, less sum_p mu_p ln J in
laws that are not isochoric. Every law that ships is one of these; one of a user's own need not be.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np

from fingerslip.arrays import Floats, Integers
from fingerslip.materials.large_strain import FiniteMaterial, log_volume_of

# Iterations of the thickness at most; change after which, as the next is about its square, rounding is left; largest.
_LIMIT, _LAST, _LARGEST = 60, 1e-8, 0.5
# What of a law the sum of powers stands for.
_FUNCTIONS = ("stored_energy", "kirchhoff_stress", "kirchhoff_tangent", "volumetric")


@dataclass(frozen=True)
class PointLaws:
    """The laws of n points with up to t powers each."""

    factors: Floats  # (t, n), mu [Pa], zero for powers that a law has not
    exponents: Floats  # (t, n), alpha [-]
    moduli: Floats  # (n,), K [Pa]
    isochoric: Floats  # (n,), 1 in isochoric laws, 0 in others

    def stress(self, log_strain: Floats) -> Floats:
        """Return the principal Kirchhoff stresses (n, 3) [Pa] at logarithmic strains (n, 3)."""
        log_volume = log_volume_of(log_strain)
        total: Floats = reduce(np.add, (power for power, _ in self._powers(log_strain, log_volume)))
        total += self._volume_stress(log_volume, total)[:, None]
        return total

    def thickness(self, log_strain: Floats) -> Floats | None:
        """Return the strain across the plane (n,) that nothing acts on, from (n, 3) with guesses; None if not found."""
        trial = log_strain.copy(order="F")
        # Where no law is isochoric, the powers across say all.
        needed = trial if self._is_isochoric else trial[:, 2:]
        for _ in range(_LIMIT):
            log_volume = log_volume_of(trial)
            powers = list(self._powers(needed, log_volume))
            total: Floats = reduce(np.add, (power for power, _ in powers))
            rates: Floats = reduce(np.add, (exponent * power for power, exponent in powers))
            stress, stiffness = total[:, -1] + self._volume_stress(log_volume, total), rates[:, -1] + self.moduli
            if self._is_isochoric:
                stiffness += self.isochoric * (log_volume_of(rates) / 9.0 - rates[:, 2] * (2.0 / 3.0))
            change = np.clip(stress / stiffness, -_LARGEST, _LARGEST)
            trial[:, 2] -= change
            if np.abs(change).max(initial=0.0) <= _LAST:
                return trial[:, 2]
        return None

    def energy(self, log_strain: Floats) -> Floats:
        """Return the energies (n,) [J/m^3] at logarithmic strains (n, 3)."""
        log_volume = log_volume_of(log_strain)
        energy = (0.5 * self.moduli * log_volume - self._offset) * log_volume
        shape = self._shape(log_strain, log_volume)
        for factor, exponent in zip(self.factors, self.exponents, strict=True):
            energy += factor / exponent * log_volume_of(np.expm1(exponent[:, None] * shape))
        return energy

    def at(self, points: Integers) -> PointLaws:
        """Return the laws of some points (k,)."""
        of_powers = self.factors[:, points], self.exponents[:, points]
        return PointLaws(*of_powers, self.moduli[points], self.isochoric[points])

    @cached_property
    def _is_isochoric(self) -> bool:
        """Whether any of the laws is isochoric."""
        return bool(self.isochoric.any())

    @cached_property
    def _offset(self) -> Floats:
        """What laws that are not isochoric take from the stress of the powers, shape (n,) [Pa]."""
        return np.asarray((1.0 - self.isochoric) * self.factors.sum(axis=0))

    def _volume_stress(self, log_volume: Floats, total: Floats) -> Floats:
        """Return what comes to powers (n, k) [Pa] in all directions, at ln J (n,), shape (n,) [Pa]."""
        stress = self.moduli * log_volume - self._offset
        return np.asarray(stress - self.isochoric * log_volume_of(total) / 3.0) if self._is_isochoric else stress

    def _shape(self, log_strain: Floats, log_volume: Floats) -> Floats:
        """Return x_i of strains (n, k), same shape [-]."""
        return log_strain - (self.isochoric * log_volume / 3.0)[:, None] if self._is_isochoric else log_strain

    def _powers(self, log_strain: Floats, log_volume: Floats) -> Iterator[tuple[Floats, Floats]]:
        """Yield every term at strains (n, k), shape (n, k) [Pa], and its exponents (n, 1) [-]."""
        shape = self._shape(log_strain, log_volume)
        for factor, exponent in zip(self.factors, self.exponents, strict=True):
            power = np.exp(exponent[:, None] * shape)
            power *= factor[:, None]
            yield power, exponent[:, None]


def laws_of_points(materials: Sequence[FiniteMaterial], number: Integers) -> PointLaws | None:
    """Return the laws of points of materials with an index (n,); None where one of these is no sum of powers."""
    sums: list[Any] = [_powers_of(material) for material in materials]
    if not all(sums):
        return None
    most = max(len(powers) for powers, _, _ in sums)
    table = np.zeros((2, most, len(sums)))
    table[1] = 1.0
    for column, (powers, _, _) in enumerate(sums):
        table[:, : len(powers), column] = np.transpose(powers)
    moduli, isochoric = np.array([one[1:] for one in sums], dtype=float).T
    return PointLaws(table[0], table[1], moduli, isochoric).at(number)


def _powers_of(material: Any) -> Any:
    """Return the powers of a law; None where it has none, or is derived from such a law with functions of its own."""
    kind = type(material)
    owner = next((base for base in kind.__mro__ if "sum_of_powers" in vars(base)), None)
    if owner is None or any(getattr(kind, name) is not getattr(owner, name) for name in _FUNCTIONS):
        return None
    return material.sum_of_powers
