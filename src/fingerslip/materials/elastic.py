"""Hooke's law, isotropic linear elasticity at small strain, and Rayleigh damping.

With the dilatation e, the sum of the normal strains, and the strain tensor E, the energy is
lambda/2 e^2 + G E:E, the stress lambda e I + 2 G E. In solids and plane strain lambda is Lame's first constant
E nu / ((1 + nu)(1 - 2 nu)); in plane stress, with the in-plane dilatation, it is E nu / (1 - nu^2).
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.materials.material import SHEARS, STRAIN_COMPONENTS, Formulation
from fingerslip.materials.prony import Prony, check_prony
from fingerslip.parameters import Density, Duration, Number, Pressure, Rate, parameters


@parameters
class RayleighDamping:
    """Damping matrix as `mass` times the mass matrix plus `stiffness` times the stiffness matrix.

    Examples
    --------
    Damping of 5 % of the critical one at 20 Hz, by the stiffness matrix alone:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> damping = fs.RayleighDamping(stiffness=2 * 0.05 / (2 * np.pi * 20.0))
    >>> f"{1e3 * damping.stiffness:.2f} ms"
    '0.80 ms'
    """

    mass: Annotated[Rate, "Mass-proportional coefficient [1/s]."] = 0.0
    stiffness: Annotated[Duration, "Stiffness-proportional coefficient [s]."] = 0.0


_DIMENSIONS = {components: dim for dim, components in STRAIN_COMPONENTS.items()}


class ByYoungsModulus:
    """A law whose constants at rest are Young's modulus and Poisson's ratio: a parameter set with the fields below."""

    if TYPE_CHECKING:
        youngs_modulus: float
        poisson_ratio: float
        prony: Prony

    def __post_init__(self) -> None:
        check_prony(self.prony)

    @property
    def shear_modulus(self) -> float:
        """Shear modulus at rest [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def stiffness(self) -> float:
        """Young's modulus at rest [Pa], from which contact penalties are estimated."""
        return self.youngs_modulus


@parameters
class Elastic(ByYoungsModulus):
    """Isotropic linear elasticity at small strain.

    Examples
    --------
    >>> import fingerslip as fs
    >>> tissue = fs.Elastic(youngs_modulus=34e3, poisson_ratio=0.48, density=1000.0)
    >>> f"shear modulus {tissue.shear_modulus:.0f} Pa, bulk modulus {tissue.bulk_modulus:.0f} Pa"
    'shear modulus 11486 Pa, bulk modulus 283333 Pa'
    """

    youngs_modulus: Annotated[Pressure, "Young's modulus [Pa]."]
    poisson_ratio: Annotated[Number, pydantic.Field(ge=0, le=0.5), "Poisson's ratio [-], from 0 to 0.5."]
    density: Annotated[Density, "Mass density [kg/m^3]."]
    prony: Prony = field(default=(), kw_only=True)
    law: Annotated[Literal["elastic"], "The law, as study files name it."] = field(
        default="elastic", kw_only=True, repr=False
    )

    @property
    def bulk_modulus(self) -> float:
        """Bulk modulus [Pa], of a material that is not incompressible."""
        return self.youngs_modulus / (3.0 * (1.0 - 2.0 * self.poisson_ratio))

    def energy(self, strain: Floats, formulation: Formulation) -> Floats:
        """Return the strain energy density [J/m^3], shape (n,), of strains (n, m) [-]."""
        dim = _DIMENSIONS[strain.shape[1]]
        normal, shear = strain[:, :dim], strain[:, dim:]
        # Sums along short rows take numpy's ``sum`` several times as long.
        distortion = np.einsum("ij,ij->i", normal, normal) + 0.5 * np.einsum("ij,ij->i", shear, shear)
        dilatation, modulus = np.einsum("ij->i", normal), self.dilatational_modulus(formulation)
        return np.asarray(0.5 * modulus * dilatation**2 + self.shear_modulus * distortion)

    def stress(self, strain: Floats, formulation: Formulation) -> Floats:
        """Return the stress [Pa], shape (n, m), of strains (n, m) [-]."""
        dim, modulus = _DIMENSIONS[strain.shape[1]], self.dilatational_modulus(formulation)
        normal, shear = strain[:, :dim], strain[:, dim:]
        stress = np.empty_like(strain)
        stress[:, :dim] = modulus * np.einsum("ij->i", normal)[:, None] + 2.0 * self.shear_modulus * normal
        stress[:, dim:] = self.shear_modulus * shear
        return stress

    def stress_across(self, strain: Floats, formulation: Formulation) -> Floats:
        """Return the stress zz out of the plane [Pa], shape (n,), of strains (n, 3) [-]."""
        if formulation == "plane_stress":
            return np.zeros(len(strain))
        return np.asarray(self.poisson_ratio * self.stress(strain, formulation)[:, :2].sum(axis=1))

    def tangent(self, strain: Floats, formulation: Formulation) -> Floats:
        """Return the derivative of the stress by the strain [Pa], shape (n, m, m), at strains (n, m) [-]."""
        constant = hooke_tangent(strain.shape[1], self.dilatational_modulus(formulation), self.shear_modulus)
        return np.broadcast_to(constant, (len(strain), *constant.shape))

    def dilatational_modulus(self, formulation: Formulation) -> float:
        """Return the factor lambda of the dilatation in the stress [Pa]; refuse an infinite one."""
        modulus, ratio = self.youngs_modulus, self.poisson_ratio
        if formulation == "plane_stress":
            return modulus * ratio / (1.0 - ratio**2)
        if ratio == 0.5:
            allowed = f"{formulation.replace('_', ' ')} with displacement elements needs < 0.5"
            raise InputError("poisson_ratio", "got 0.5", allowed, "write 0.4999")
        return modulus * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio))


def hooke_tangent(components: int, first_lame: float, shear_modulus: float) -> Floats:
    """Return the derivative of the stress by the strain [Pa], shape (m, m), for m strain components."""
    dim = _DIMENSIONS[components]
    tangent = shear_modulus * np.diag([2.0] * dim + [1.0] * len(SHEARS[dim]))
    tangent[:dim, :dim] += first_lame
    return tangent
