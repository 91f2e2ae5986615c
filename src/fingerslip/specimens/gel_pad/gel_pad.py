"""A flat gel with a grid of markers: its numbers, its meshes in rows of cells, and what a model takes from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.marker_layouts import MarkerLayout, grid_layout
from fingerslip.materials.choice import MaterialChoice, kept_values
from fingerslip.mesh.source import GROWTH, GradedMesh, MeshSource, grade
from fingerslip.parameters import PositiveLength, as_mapping, parameters
from fingerslip.parameters.presets import Presets
from fingerslip.sites import Site, ring_sites
from fingerslip.specimens.protocol import ModelUse, check_regions
from fingerslip.units import millimetres

if TYPE_CHECKING:
    import skfem


#: The group of sites, as study files name it.
MARKERS = "internal_markers"
_SHAPE = ("part", "length", "width", "thickness", "markers")
_POINTS = 100  # along which the wanted size is known
_Count = Annotated[int, pydantic.Field(ge=1, le=100)]


@parameters
class Markers:
    """A grid of markers on the touched surface of the gel, about its middle."""

    rows: Annotated[_Count, "Markers along z."]
    columns: Annotated[_Count, "Markers along x."]
    spacing: Annotated[PositiveLength, "Distance of neighbours [m]."]


@parameters
class PadSizes(GradedMesh):
    """Element sizes and element type of a gel pad."""

    contact_size: Annotated[
        PositiveLength, "Size among the markers on the touched surface, at most: whole cells from marker to marker [m]."
    ] = 0.45e-3
    bulk_size: Annotated[PositiveLength, "Largest size [m]."] = 2e-3
    element: Annotated[Literal["Q4", "H8"], "Bilinear quadrilateral of a section, trilinear hexahedron in 3D."] = "Q4"
    body: Annotated[Literal["gel_pad"], "What is meshed."] = "gel_pad"

    @property
    def dim(self) -> int:
        """Dimension of space."""
        return 2 if self.element == "Q4" else 3

    def build(self, specimen: GelPad, /) -> skfem.Mesh:
        """Build the mesh [m]: the region `gel`, boundaries `contact` (y = 0) and `back`."""
        import skfem

        if (specimen.part == "section") != (self.element == "Q4"):
            allowed = f"needs {'section' if self.element == 'Q4' else 'whole'}"
            raise InputError("part", f"got {specimen.part} with mesh.element {self.element}", allowed)
        markers, top = specimen.markers, specimen.thickness
        x = self._lines(markers.columns, markers.spacing, specimen.length)
        z = self._lines(markers.rows, markers.spacing, specimen.width)
        y = self._widening_lines(0.0, top)
        mesh = skfem.MeshQuad.init_tensor(x, y) if self.element == "Q4" else skfem.MeshHex.init_tensor(x, y, z)
        mesh = mesh.with_subdomains({"gel": lambda points: points[1] > 0.0})
        limit = 1e-6 * top
        return mesh.with_boundaries(
            {"contact": lambda points: points[1] < limit, "back": lambda points: points[1] > top - limit}
        )

    def _lines(self, count: int, spacing: float, extent: float) -> Floats:
        """Return the coordinates (n,) [m] of lines of nodes: even among markers, then wider to both ends."""
        last = 0.5 * (count - 1) * spacing
        among = (count - 1) * int(np.ceil(spacing / self.contact_size - 1e-9)) + 1
        outside = self._widening_lines(last, 0.5 * extent)[1:]
        return np.concatenate([-outside[::-1], np.linspace(-last, last, among), outside])

    def _widening_lines(self, start: float, end: float) -> Floats:
        """Divide a length [m] from the contact size at its start on."""
        along = np.linspace(start, end, _POINTS)
        return grade(along, np.minimum(self.bulk_size, self.contact_size + GROWTH * (along - start)))


@parameters
class GelPad:
    """A flat gel on a rigid window, with a grid of markers on the surface that is touched.

    Its touched surface is y = 0, the gel above it.
    """

    mesh_sources: ClassVar[tuple[type[MeshSource], ...]] = (PadSizes,)
    largest_extent: ClassVar[float] = 0.2

    part: Annotated[Literal["section", "whole"], "What is modelled: the section z = 0, or the gel in 3D."]
    length: Annotated[PositiveLength, "Side of the gel along x [m]."]
    width: Annotated[PositiveLength, "Side of the gel along z [m]."]
    thickness: Annotated[PositiveLength, "Side of the gel along y [m]."]
    markers: Annotated[Markers, "Grid of markers."]
    materials: Annotated[
        dict[str, MaterialChoice], "dict of str to Elastic, NeoHookean, MooneyRivlin or Ogden : Material of `gel`."
    ]
    formulation: Annotated[Literal["plane_strain", "plane_stress"], "Out-of-plane behaviour of the section."]
    depth: Annotated[PositiveLength, "Out-of-plane thickness of the section [m]."]

    def __post_init__(self) -> None:
        check_regions(self.materials, ("gel",))
        for name, count in (("length", self.markers.columns), ("width", self.markers.rows)):
            span, room = (count - 1) * self.markers.spacing, getattr(self, name)
            if span >= room:
                fault = f"has {count} markers over {millimetres(span)}"
                raise InputError("markers", fault, f"needs < {millimetres(room)} ({name})", "take fewer or closer ones")

    @property
    def layout(self) -> MarkerLayout:
        """The markers of what is modelled; those of a section are one row."""
        rows = 1 if self.part == "section" else self.markers.rows
        return grid_layout(self.markers.spacing, rows, self.markers.columns)

    @property
    def marker_points(self) -> Floats:
        """Points of the markers, shape (n, 2) for a section, else (n, 3) [m]."""
        x, z = self.layout.position.T
        return np.column_stack([x, np.zeros_like(x), z][: 2 if self.part == "section" else 3])

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
        """Return the sites of the markers, ring by ring about the middle: ``internal-marker-2-05``."""
        unknown = next((group for group in groups if group != MARKERS), None)
        if unknown is not None:
            raise InputError("record.groups", f"a gel_pad has no '{unknown}'", f"needs {MARKERS}")
        if groups and dim != (2 if self.part == "section" else 3):
            raise InputError("record", f"got the sites of a {self.part} for {dim} dimensions", "needs a mesh of it")
        return ring_sites("internal marker", self.layout.ring, self.marker_points, "gel") if groups else ()

    def unused_reason(self, path: str, use: ModelUse, /) -> str:
        """Return why a value, such as ``markers.rows``, makes no difference to a model; see `ModelUse`."""
        group = path.partition(".")[0]
        if group in ("formulation", "depth"):
            return "of 2D sections only" if use.dim == 3 else ""
        if group in _SHAPE and not use.meshed and not use.groups:
            return "the mesh comes from a file"
        return "in 3D only" if use.dim == 2 and path in ("width", "markers.rows") else ""


PRESETS = Presets(GelPad, "fingerslip.specimens.gel_pad", kept_values)
