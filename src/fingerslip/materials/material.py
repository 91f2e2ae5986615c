"""What every material law answers, whatever the law."""

from __future__ import annotations

from typing import Literal, Protocol, runtime_checkable

from fingerslip.arrays import Floats

#: The two-dimensional assumption, or `solid` in 3D.
Formulation = Literal["plane_strain", "plane_stress", "solid"]

#: Pairs of axes of the shear components, by the dimension of space; they follow the normal components.
SHEARS = {2: ((0, 1),), 3: ((0, 1), (1, 2), (0, 2))}
#: Number of strain components, by the dimension of space.
STRAIN_COMPONENTS = {dim: dim + len(shears) for dim, shears in SHEARS.items()}


@runtime_checkable
class Material(Protocol):
    """A law between strain and stress, and what else a model asks of a material.

    Strains are small and come in arrays of shape (n, m), a row for each point: m = 3 components xx, yy, xy in
    2D, m = 6 components xx, yy, zz, xy, yz, xz in 3D. Shears are engineering shears, twice those of the tensor.
    The methods are pure: no mesh, no time. Where the law cannot represent itself in a formulation they raise
    :class:`~fingerslip.errors.InputError` that names the parameter.
    """

    @property
    def density(self) -> float:
        """Mass density [kg/m^3]."""

    @property
    def stiffness(self) -> float:
        """Modulus from which contact penalties are estimated [Pa], such as Young's modulus at rest."""

    def energy(self, strain: Floats, formulation: Formulation) -> Floats:
        """Return the strain energy density [J/m^3], shape (n,), of strains (n, m) [-]."""

    def stress(self, strain: Floats, formulation: Formulation) -> Floats:
        """Return the stress [Pa], shape (n, m): the derivative of the energy by the strain (n, m) [-]."""

    def stress_across(self, strain: Floats, formulation: Formulation) -> Floats:
        """Return the stress zz out of the plane [Pa], shape (n,), of strains (n, 3) [-] in plane strain or stress."""

    def tangent(self, strain: Floats, formulation: Formulation) -> Floats:
        """Return the derivative of the stress by the strain [Pa], shape (n, m, m), at strains (n, m) [-]."""

    def dilatational_modulus(self, formulation: Formulation) -> float:
        """Return the modulus [Pa] of the part of the tangent that is integrated selectively.

        The part is this modulus times the square of the dilatation, the sum of the normal strains in the array. What
        it leaves of the tangent must stay positive, and bounded where the material is nearly incompressible.
        """
