"""The gel pad as a specimen: its numbers, and what a model takes from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from fingerslip.errors import InputError
from fingerslip.materials.choice import kept_values
from fingerslip.mesh.source import MeshSource
from fingerslip.parameters import as_mapping, parameters
from fingerslip.parameters.presets import Presets
from fingerslip.sites import Site
from fingerslip.specimens.gel_pad.meshing import PadSizes
from fingerslip.specimens.gel_pad.numbers import GelPadNumbers
from fingerslip.specimens.protocol import ModelUse

#: The group of sites, as study files name it.
MARKERS = "internal_markers"
_SHAPE = ("part", "length", "width", "thickness", "markers")


@parameters
class GelPad(GelPadNumbers):
    """A flat gel on a rigid window, with a grid of markers on the surface that is touched.

    Its touched surface is y = 0, the gel above it.

    Parameters
    ----------
    part : {'section', 'whole'}
        What is modelled: the section z = 0, or the gel in 3D.
    length, width, thickness : float
        Sides of the gel along x, z and y [m].
    markers : Markers
        Grid of markers.
    materials : dict of str to Elastic, NeoHookean, MooneyRivlin or Ogden
        Material of `gel`.
    formulation : {'plane_strain', 'plane_stress'}
        Out-of-plane behaviour of the section.
    depth : float
        Out-of-plane thickness of the section [m].
    """

    mesh_sources: ClassVar[tuple[type[MeshSource], ...]] = (PadSizes,)
    largest_extent: ClassVar[float] = 0.2

    @property
    def default_mesh(self) -> MeshSource:
        """The mesh of the part that is modelled."""
        return PadSizes(element="Q4" if self.part == "section" else "H8")

    @property
    def shape(self) -> Mapping[str, Any]:
        """All values but the material and what of a section is not seen in its plane."""
        return {name: value for name, value in as_mapping(self).items() if name in _SHAPE}

    def supports(self, dim: int, /) -> Mapping[str, tuple[str, ...]]:
        """Return what is held: the back of the gel, on its window."""
        return {"back": tuple("xyz"[:dim])}

    def sites(self, groups: Sequence[str], dim: int, /) -> tuple[Site, ...]:
        """Return the sites of the markers, ring by ring about the middle: ``internal-marker-2-05``.

        Raises
        ------
        InputError
            For another group than `internal_markers`, and where the part that is modelled has another dimension.
        """
        unknown = next((group for group in groups if group != MARKERS), None)
        if unknown is not None:
            raise InputError("record", f"a gel_pad has no '{unknown}'", f"needs {MARKERS}")
        if groups and dim != (2 if self.part == "section" else 3):
            raise InputError("record", f"got the sites of a {self.part} for {dim} dimensions", "needs a mesh of it")
        ring = self.layout.ring
        numbers = np.arange(len(ring)) - np.searchsorted(ring, ring) + 1
        return tuple(
            Site(f"internal-marker-{ring}-{number:02d}", "internal marker", tuple(map(float, point)), "gel")
            for ring, number, point in zip(ring, numbers, self.marker_points, strict=True)
            if groups
        )

    def unused_reason(self, path: str, use: ModelUse, /) -> str:
        """Return why a value, such as ``markers.rows``, makes no difference to a model; see `ModelUse`."""
        group = path.partition(".")[0]
        if group in ("formulation", "depth"):
            return "of 2D sections only" if use.dim == 3 else ""
        if group in _SHAPE and not use.meshed and not use.groups:
            return "the mesh comes from a file"
        return "in 3D only" if use.dim == 2 and path in ("width", "markers.rows") else ""


PRESETS = Presets(GelPad, "fingerslip.specimens.gel_pad", kept_values)
