"""What every specimen answers: all that a model takes from it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from fingerslip.errors import InputError
from fingerslip.materials.choice import AnyMaterial
from fingerslip.materials.material import Formulation
from fingerslip.mesh.source import MeshSource
from fingerslip.sites import Site


@dataclass(frozen=True)
class ModelUse:
    """What a model takes from a specimen besides its materials."""

    dim: Literal[2, 3]  # dimension of space, 2 for a section
    meshed: bool = True  # whether the mesh is made of the specimen, rather than read from a file
    held: bool = True  # whether the specimen says what is held
    groups: frozenset[str] = frozenset()  # the groups of sites that are recorded


class Specimen(Protocol):
    """A body that is pressed on a surface, as numbers, and what a model takes from it."""

    @property
    def mesh_sources(self) -> tuple[type[MeshSource], ...]:
        """Classes of the sources that mesh it; of the class, so that study files know them too."""

    @property
    def default_mesh(self) -> MeshSource:
        """The source of its mesh where nothing else is said."""

    @property
    def shape(self) -> Mapping[str, Any]:
        """Plain data that decides its meshes, so that runs of the same shape share one."""

    @property
    def largest_extent(self) -> float:
        """What it measures at most [m]; a mesh file that is larger is not in metres."""

    @property
    def materials(self) -> Mapping[str, AnyMaterial]:
        """Material of every region of its meshes."""

    @property
    def formulation(self) -> Formulation:
        """Formulation of its models in 2D; those in 3D are `solid`."""

    @property
    def depth(self) -> float:
        """Out-of-plane depth of its models in 2D [m]."""

    def supports(self, dim: int, /) -> Mapping[str, tuple[str, ...]]:
        """Return the boundaries or regions that are held, and in which of the components x, y, z, by dimension."""

    def sites(self, groups: Sequence[str], dim: int, /) -> tuple[Site, ...]:
        """Return the sites of the given groups, such as a kind of receptors; refuse those that it has not."""

    def unused_reason(self, path: str, use: ModelUse, /) -> str:
        """Return why the value of a dotted path makes no difference to a model; empty for one that it uses."""


def check_regions(materials: Collection[str], regions: Collection[str]) -> None:
    """Refuse materials of other regions than those that a body has."""
    if set(materials) != set(regions):
        raise InputError("materials", f"has {', '.join(materials) or 'nothing'}", f"needs {', '.join(regions)}")
