"""The fingertip as a specimen: its numbers, and what a model takes from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, ClassVar

from fingerslip.errors import InputError
from fingerslip.mesh.source import MeshSource
from fingerslip.parameters import as_mapping, parameters
from fingerslip.sites import RECEPTOR_KINDS, Site
from fingerslip.specimens.fingertip.meshing.section.source import MeshSizes
from fingerslip.specimens.fingertip.meshing.solid.source import SolidSizes
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.sites import receptor_sites, reference_sites, skin_markers, solid_receptor_sites
from fingerslip.specimens.fingertip.usage import unused_reason
from fingerslip.specimens.protocol import ModelUse

__all__ = ["REFERENCE_NODES", "Fingertip"]

#: Group of the reference nodes h1 to h7 and v1 to v7 of a fingertip in 3D.
REFERENCE_NODES = "reference_nodes"

#: Groups of sites that only a fingertip in 3D has.
_IN_SPACE: Mapping[str, Callable[[FingertipNumbers], tuple[Site, ...]]] = MappingProxyType(
    {REFERENCE_NODES: reference_sites, "external_markers": skin_markers}
)
_OF_NO_EFFECT = frozenset({"materials", "receptors"})


@parameters
class Fingertip(FingertipNumbers):
    """Everything that describes one fingertip, and what a model takes from it.

    Parameters
    ----------
    section : {'sagittal', 'transverse'}
        The plane of the 2D model: along or across the finger.
    sagittal, transverse : SagittalOutline, TransverseOutline
        Outline of the skin in either section.
    layers : Layers
        Thickness of the skin and the epidermis.
    phalanx : Phalanx
        The distal phalanx.
    ridges : Ridges
        Intermediate and limiting ridges.
    fingerprint : Fingerprint
        Ripples of the outer surface.
    receptors : Receptors
        Depths of the receptors.
    materials : dict of str to Elastic, NeoHookean, MooneyRivlin or Ogden
        Material of each of `epidermis`, `dermis`, `tissue` and `phalanx`, and of the `nail` where there is one.
    formulation : {'plane_strain', 'plane_stress'}
        Out-of-plane behaviour of the 2D model.
    depth : float
        Out-of-plane thickness of the 2D model [m].
    solid : SolidShape, optional
        What the fingertip in 3D has beyond its sections. With it the transverse section is the cut x = 0 of the
        fingertip in 3D, as the sagittal section is the cut z = 0; without it there are only the sections.
    """

    mesh_sources: ClassVar[tuple[type[MeshSource], ...]] = (MeshSizes, SolidSizes)
    largest_extent: ClassVar[float] = 0.2

    @property
    def default_mesh(self) -> MeshSource:
        """The mesh in 3D where the fingertip has a shape in 3D, else that of its section."""
        return MeshSizes() if self.solid is None else SolidSizes()

    @property
    def shape(self) -> Mapping[str, Any]:
        """All values but materials and receptors, which change no mesh."""
        return {name: value for name, value in as_mapping(self).items() if name not in _OF_NO_EFFECT}

    def supports(self, dim: int, /) -> Mapping[str, tuple[str, ...]]:
        """Return what is held in all components: a rigid phalanx as a whole, an elastic one at its back."""
        return {"phalanx" if self.phalanx.rigid else "phalanx_dorsal": tuple("xyz"[:dim])}

    def sites(self, groups: Sequence[str], dim: int, /) -> tuple[Site, ...]:
        """Return the sites of groups: kinds of receptors, and in 3D ``reference_nodes`` and ``external_markers``.

        Parameters
        ----------
        groups : sequence of str
            Among FA-I, SA-I, FA-II, SA-II, reference_nodes and external_markers, the dots on the skin of a finger that
            is filmed.
        dim : int
            Dimension of space, 2 for a section.

        Raises
        ------
        InputError
            For reference nodes and markers of a section, and for unknown groups.
        """
        _check_groups(groups, dim)
        receptors = set(groups) & set(RECEPTOR_KINDS)
        candidates: tuple[Site, ...] = ()
        if receptors:
            candidates = solid_receptor_sites(self) if dim == 3 else receptor_sites(self)
        in_space = [site for group in _IN_SPACE if group in groups for site in _IN_SPACE[group](self)]
        return (*(site for site in candidates if site.kind in receptors), *in_space)

    def unused_reason(self, path: str, use: ModelUse, /) -> str:
        """Return why a value, such as ``phalanx.tissue_thickness``, makes no difference to a model; see `ModelUse`."""
        return unused_reason(self, path, use)


def _check_groups(groups: Sequence[str], dim: int) -> None:
    available = (*RECEPTOR_KINDS, *_IN_SPACE)
    unknown = next((group for group in groups if group not in available), None)
    if unknown is not None:
        raise InputError("record", f"a fingertip has no '{unknown}'", f"needs some of {', '.join(available)}")
    flat = next((group for group in _IN_SPACE if group in groups and dim == 2), None)
    if flat is not None:
        raise InputError(f"record.{flat}", "without a fingertip in 3D", "needs mesh.element T4 or T10")
