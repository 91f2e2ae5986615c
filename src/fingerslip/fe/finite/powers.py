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

import numba
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
        total: Floats = reduce(np.add, (power for power, _ in self._powers(log_strain)))
        pressure = self.moduli * log_volume_of(log_strain) - self._offset
        pressure -= self.isochoric * (total[:, 0] + total[:, 1] + total[:, 2]) / 3.0
        total += pressure[:, None]
        return total

    def thickness(self, log_strain: Floats) -> Floats | None:
        """Return the strain across the plane (n,) that nothing acts on, from (n, 3) with guesses; None if not found."""
        trial = log_strain.copy(order="F")
        # Where no law is isochoric, the powers across say all.
        needed = trial if self._is_isochoric else trial[:, 2:]
        for _ in range(_LIMIT):
            powers = list(self._powers(needed))
            total: Floats = reduce(np.add, (power for power, _ in powers))
            rates: Floats = reduce(np.add, (exponent * power for power, exponent in powers))
            if _corrected(total, rates, self.moduli, self._offset, self.isochoric, trial):
                return trial[:, 2]
        return None

    def energy(self, points: Integers, squared: Floats, log_strain: Floats, selective: Floats) -> Floats:
        """Return the energies (k,) [J/m^3] at points (k,) less those of selective moduli (n,) [Pa].

        Squared stretches are (n, dim), logarithmic strains (n, 3).
        """
        energies = np.empty(points.size)
        laws = self.factors, self.exponents, self.moduli, self.isochoric
        _write_energies(points, *laws, selective, squared, log_strain, energies)
        return energies

    @cached_property
    def _is_isochoric(self) -> bool:
        """Whether any of the laws is isochoric."""
        return bool(self.isochoric.any())

    @cached_property
    def _offset(self) -> Floats:
        """What laws that are not isochoric take from the stress of the powers, shape (n,) [Pa]."""
        return np.asarray((1.0 - self.isochoric) * self.factors.sum(axis=0))

    def _powers(self, log_strain: Floats) -> Iterator[tuple[Floats, Floats]]:
        """Yield every term at strains (n, k), shape (n, k) [Pa], and its exponents (n, 1) [-]."""
        if self._is_isochoric:
            log_strain = log_strain - (self.isochoric * log_volume_of(log_strain) / 3.0)[:, None]
        for factor, exponent in zip(self.factors, self.exponents, strict=True):
            power = exponent[:, None] * log_strain
            np.exp(power, out=power)
            power *= factor[:, None]
            yield power, exponent[:, None]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _corrected(total, rates, moduli, offset, isochoric, trial):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Correct strains (n, 3) across the plane by powers and their rates (n, k); tell whether they were right before."""
    last, right = total.shape[1] - 1, True
    for p in range(len(trial)):
        stress = total[p, last] + moduli[p] * (trial[p, 0] + trial[p, 1] + trial[p, 2]) - offset[p]
        stiffness = rates[p, last] + moduli[p]
        if last:
            stress -= isochoric[p] * (total[p, 0] + total[p, 1] + total[p, 2]) / 3.0
            mean = (rates[p, 0] + rates[p, 1] + rates[p, 2]) / 9.0
            stiffness += isochoric[p] * (mean - rates[p, 2] * (2.0 / 3.0))
        change = min(max(stress / stiffness, -_LARGEST), _LARGEST)
        trial[p, 2] -= change
        right &= np.abs(change) <= _LAST
    return right


@numba.njit(cache=True, nogil=True)
def _write_energies(points, factors, exponents, moduli, isochoric, selective, squared, log_strain, energies):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Fill in the energies (k,) of laws at points (k,)."""
    for row in range(points.size):
        p = points[row]
        volume = log_strain[p, 0] + log_strain[p, 1] + log_strain[p, 2]
        averaged = volume if squared.shape[1] == 3 else log_strain[p, 0] + log_strain[p, 1]
        energy = 0.5 * (moduli[p] * volume * volume - selective[p] * averaged * averaged)
        for term in range(len(factors)):
            growth, exponent = 0.0, exponents[term, p]
            for k in range(3):
                if exponent == 2.0 and not isochoric[p] and k < squared.shape[1]:
                    growth += squared[p, k] - 1.0
                else:
                    growth += np.expm1(exponent * (log_strain[p, k] - isochoric[p] * volume / 3.0))
            energy += factors[term, p] * (growth / exponent - (1.0 - isochoric[p]) * volume)
        energies[row] = energy


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
    moduli, isochoric = np.array([law[1:] for law in sums], dtype=float).T
    return PointLaws(*(values[..., number] for values in (*table, moduli, isochoric)))


def _powers_of(material: Any) -> Any:
    """Return the powers of a law; None where it has none, or is derived from such a law with functions of its own."""
    kind = type(material)
    owner = next((base for base in kind.__mro__ if "sum_of_powers" in vars(base)), None)
    if owner is None or any(getattr(kind, name) is not getattr(owner, name) for name in _FUNCTIONS):
        return None
    return material.sum_of_powers
