"""What of a law at large strain relaxes: the stress of the shape, and the spring of a Prony term.

The energy of a law is K/2 (ln J)^2, with the bulk modulus K at rest, or the law's own function of the volume alone,
and the rest, which is the energy of the shape: only this relaxes. Quasi-linear viscoelasticity (Simo 1987; Simo &
Hughes 1998, section 10.3) lets dashpots follow the stress of the shape: with S its second Piola-Kirchhoff stress,
which is a deviator and, in laws that mix shape and volume, a small pressure p ::

    S = J^(-2/3) A + p C^-1,    J^(-2/3) DEV[sum s_i Z_i] + sum s_i q_i C^-1 less where they relax

with Z_i of A and q_i of p as in :mod:`fingerslip.materials.prony`, and DEV[Z] = Z - (Z:C)/3 C^-1. So the pressure of
the volume is elastic, and a law relaxes towards the same law with (1 - sum s_i) of its energy of the shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import FingerslipError
from fingerslip.materials.large_strain import SHAPES, FiniteMaterial, deviator, log_volume_of

# Change of an iteration after which rounding is left, as the next would be of the size of its square; and the largest.
_LIMIT, _LAST, _LARGEST = 60, 1e-7, 0.5


def volume_part(material: FiniteMaterial, log_volume: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the energy of the volume, which does not relax, and its two derivatives [Pa], each (n,), at ln J (n,).

    It is what grows with the bulk modulus, completed at rest to the bulk modulus.
    """
    energy, slope, curvature = material.volumetric(log_volume)
    missing = material.at_rest().bulk_modulus - float(material.volumetric(np.zeros(1))[2][0])
    return energy + 0.5 * missing * log_volume**2, slope + missing * log_volume, curvature + missing


def shape_energy(material: FiniteMaterial, log_strain: Floats) -> Floats:
    """Return the energy of the shape [J/m^3], shape (n,), at logarithmic strains (n, 3)."""
    return np.asarray(material.stored_energy(log_strain) - volume_part(material, log_volume_of(log_strain))[0])


def shape_stress(material: FiniteMaterial, log_strain: Floats) -> Floats:
    """Return the principal Kirchhoff stresses of the shape [Pa], shape (n, 3), at logarithmic strains (n, 3)."""
    pressure = volume_part(material, log_volume_of(log_strain))[1]
    return np.asarray(material.kirchhoff_stress(log_strain) - pressure[:, None])


@dataclass(frozen=True)
class StepLaw:
    """The part of a law at the end of a step that has the principal directions of the strain."""

    material: FiniteMaterial  # the law at once
    share: float  # [-]
    pressure: Floats  # (n,), what the start of the step takes from the pressure of the shape [Pa]

    def kirchhoff_stress(self, log_strain: Floats) -> Floats:
        """Return the principal Kirchhoff stresses [Pa], shape (n, 3), at logarithmic strains (n, 3)."""
        elastic = volume_part(self.material, log_volume_of(log_strain))[1]
        stress = (1.0 - self.share) * self.material.kirchhoff_stress(log_strain)
        stress += (self.share * elastic - self.pressure)[:, None]
        return stress

    def kirchhoff_tangent(self, log_strain: Floats) -> Floats:
        """Return the derivative of the stresses [Pa], shape (n, 3, 3), at logarithmic strains (n, 3)."""
        elastic = volume_part(self.material, log_volume_of(log_strain))[2]
        tangent = (1.0 - self.share) * self.material.kirchhoff_tangent(log_strain)
        tangent += (self.share * elastic)[:, None, None]
        return tangent


def spring_strain(material: FiniteMaterial, stress: Floats, log_volume: Floats, guess: Floats) -> Floats:
    """Return the logarithmic strains (n, 3) [-] of springs that obey a law, from the deviator of their stress [Pa].

    Their ln J is `log_volume` (n,); the search starts from a guess (n, 3) [-].
    """
    strain = deviator(guess) + log_volume[:, None] / 3.0
    for _ in range(_LIMIT):
        missing = (material.kirchhoff_stress(strain) - stress) @ SHAPES.T
        change = np.clip(_solve(SHAPES @ material.kirchhoff_tangent(strain) @ SHAPES.T, missing), -_LARGEST, _LARGEST)
        strain -= change @ SHAPES
        if np.abs(change).max(initial=0.0) <= _LAST:
            return strain
    where = f"{type(material).__name__}: the strain of a spring of a Prony term was not found"
    raise FingerslipError(f"{where}; the law is not stable at this strain")


def _solve(matrices: Floats, vectors: Floats) -> Floats:
    """Return the solutions (n, 2) of equations with matrices (n, 2, 2)."""
    (first, beside), (other, last) = matrices.transpose(1, 2, 0)
    determinant = first * last - beside * other
    result = (last * vectors[:, 0] - beside * vectors[:, 1], first * vectors[:, 1] - other * vectors[:, 0])
    return np.asarray((np.array(result) / determinant).T)
