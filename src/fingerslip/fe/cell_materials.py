"""The material of every cell."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from fingerslip.arrays import Floats, Integers
from fingerslip.errors import InputError, Mistakes, did_you_mean
from fingerslip.fe.space import Space
from fingerslip.materials.choice import AnyMaterial
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.material import Formulation, Material

Law = TypeVar("Law", bound=Material | FiniteMaterial)

_LOCKING = {
    "T3": ", and take Q4, T6 or integration 'nodal' because T3 locks",
    "T4": ", and take H8, T10 or integration 'nodal' because T4 locks",
}


@dataclass(frozen=True)
class CellMaterials(Generic[Law]):
    """The material of every cell."""

    materials: tuple[Law, ...]  # the materials of the regions
    number: Integers  # (n_cells,), index of each cell's material among them
    formulation: Formulation  # the two-dimensional assumption, or `solid`

    def __iter__(self) -> Iterator[tuple[Law, Integers]]:
        """Yield every material with its cells (k,)."""
        for number, material in enumerate(self.materials):
            yield material, np.flatnonzero(self.number == number)

    @property
    def density(self) -> Floats:
        """Mass densities of the cells, shape (n_cells,) [kg/m^3]."""
        return np.array([material.density for material in self.materials])[self.number]


def cell_materials(
    space: Space, materials: Mapping[str, AnyMaterial], formulation: Formulation
) -> CellMaterials[Material]:
    """Find the small-strain material of every cell; laws of large strain are taken at rest."""
    return _of_cells(space, {name: small_strain_law(law) for name, law in materials.items()}, formulation)


def finite_cell_materials(
    space: Space, materials: Mapping[str, AnyMaterial], formulation: Formulation
) -> CellMaterials[FiniteMaterial]:
    """Find the material of every cell at large strain; see :func:`cell_materials`."""
    finite, mistakes = {}, Mistakes()
    for name, law in materials.items():
        if isinstance(law, FiniteMaterial):
            finite[name] = law
            continue
        has = f"got {type(law).__name__}, a law of small strain"
        repair = "take NeoHookean with the same constants, or kinematics 'small'"
        allowed = "finite kinematics need a law of large strain"
        mistakes.found.append(InputError(f"materials.{name}", has, allowed, repair))
    mistakes.raise_all()
    return _of_cells(space, finite, formulation)


def small_strain_law(material: AnyMaterial) -> Material:
    """Return the law with which small strains are computed: of a law for large strain its law at rest."""
    return material.at_rest() if isinstance(material, FiniteMaterial) else material


def _of_cells(space: Space, materials: Mapping[str, Law], formulation: Formulation) -> CellMaterials[Law]:
    """Return the materials by cells; refuse laws that cannot be in a formulation, and that in a mesh."""
    if (formulation == "solid") != (space.dim == 3):
        allowed = "needs solid" if space.dim == 3 else "needs plane_strain or plane_stress"
        raise InputError("formulation", f"got {formulation} for a mesh in {space.dim} dimensions", allowed)
    mistakes = Mistakes()
    for name, material in materials.items():
        try:
            small_strain_law(material).dilatational_modulus(formulation)
        except InputError as error:
            repair = f"{error.repair}{_LOCKING.get(space.element, '')}"
            mistakes.found.append(InputError(f"materials.{name}.{error.where}", error.found, error.allowed, repair))
    with mistakes.collect():
        numbers = _numbers(space, materials)
    mistakes.raise_all()
    return CellMaterials(tuple(materials.values()), numbers, formulation)


def _numbers(space: Space, materials: Mapping[str, Law]) -> Integers:
    """Return the index of every cell's material among `materials`, shape (n_cells,)."""
    regions: Mapping[str, Any] = space.mesh.subdomains or {}
    numbers = np.full(space.mesh.nelements, -1)
    names = ", ".join(sorted(regions))
    absent = [
        InputError(f"materials.{n}", "no such region in the mesh", f"it has: {names}", did_you_mean(n, regions))
        for n in materials
        if n not in regions
    ]
    Mistakes(absent).raise_all()
    for number, name in enumerate(materials):
        if (numbers[regions[name]] >= 0).any():
            raise InputError("mesh", f"region '{name}' shares cells with another", "a cell has one material")
        numbers[regions[name]] = number
    # Regions that hold others, such as a set of all, lack what these do: those without any at all are to blame.
    bare = sorted((len(cells), name) for name, cells in regions.items() if len(cells) and (numbers[cells] < 0).any())
    lacking = [name for _, name in bare if (numbers[regions[name]] < 0).all()] or [name for _, name in bare]
    if lacking:
        names = " and ".join(f"'{name}'" for name in lacking)
        subject = f"region {names} has" if len(lacking) == 1 else f"regions {names} have"
        raise InputError("materials", f"{subject} no material", "every cell needs one, by one of its regions")
    if (numbers < 0).any():
        raise InputError("mesh", "some cells are in no region", "every cell needs a region, which gives its material")
    return numbers
