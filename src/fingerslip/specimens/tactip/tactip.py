"""The TacTip as a specimen: its numbers, and what a model takes from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from fingerslip.errors import InputError
from fingerslip.materials.choice import kept_values
from fingerslip.mesh.source import ContactReach, GradedMesh, MeshSource
from fingerslip.parameters import PositiveLength, as_mapping, parameters
from fingerslip.parameters.presets import Presets
from fingerslip.sites import Site
from fingerslip.specimens.protocol import ModelUse
from fingerslip.specimens.tactip.numbers import GROUPS, TacTipNumbers, marker_sites

if TYPE_CHECKING:
    import skfem


@parameters
class SensorSectionSizes(GradedMesh):
    """Element sizes and element type of the section of a TacTip."""

    dim: ClassVar[int] = 2

    contact_size: Annotated[PositiveLength, "Size in the skin that can touch, and at the rods [m]."] = 0.3e-3
    bulk_size: Annotated[PositiveLength, "Largest size [m]."] = 1.2e-3
    contact_reach: ContactReach = 8e-3
    element: Annotated[Literal["Q4", "T3", "T6"], "Bilinear quadrilateral, linear or quadratic triangle."] = "Q4"
    body: Annotated[Literal["tactip"], "What is meshed."] = "tactip"

    def build(self, specimen: TacTipNumbers, /) -> skfem.Mesh2D:
        """Build the mesh [m]: regions `skin`, `gel`, `rods`, `window`, boundaries `contact` and `window_face`."""
        from fingerslip.specimens.tactip.meshing import mesh_sensor_section

        _check_part(specimen, ("section",), self.element)
        return mesh_sensor_section(specimen, self)


@parameters
class SensorSolidSizes(GradedMesh):
    """Element sizes and element type of a TacTip in 3D."""

    element_sizes: ClassVar[tuple[str, ...]] = ("contact_size", "rod_size", "bulk_size")
    dim: ClassVar[int] = 3

    contact_size: Annotated[PositiveLength, "Size in the skin that can touch [m]."] = 1e-3
    bulk_size: Annotated[PositiveLength, "Largest size [m]."] = 3e-3
    contact_reach: ContactReach = 6e-3
    rod_size: Annotated[
        PositiveLength,
        "Largest size at the rods; bends of ridges get finer with it, eight edges in a circle at 0.35 mm [m].",
    ] = 0.35e-3
    element: Annotated[Literal["T4", "T10"], "Linear or quadratic tetrahedron."] = "T4"
    body: Annotated[Literal["tactip"], "What is meshed."] = "tactip"

    def build(self, specimen: TacTipNumbers, /) -> skfem.Mesh3D:
        """Build the mesh [m]: regions and boundaries of the section, and `symmetry` of a half."""
        from fingerslip.specimens.tactip.meshing import mesh_sensor_solid

        _check_part(specimen, ("half", "whole"), self.element)
        return mesh_sensor_solid(specimen, self, self.rod_size)


def _check_part(specimen: TacTipNumbers, allowed: tuple[str, ...], element: str) -> None:
    if specimen.part not in allowed:
        raise InputError("part", f"got {specimen.part} with mesh.element {element}", f"needs {' or '.join(allowed)}")


_SHAPE = ("part", "dome", "skin", "rods", "markers", "window")
_OF_SECTIONS = ("formulation", "depth")


@parameters
class TacTip(TacTipNumbers):
    """Everything that describes one optical sensor of the TacTip kind, and what a model takes from it."""

    mesh_sources: ClassVar[tuple[type[MeshSource], ...]] = (SensorSectionSizes, SensorSolidSizes)
    largest_extent: ClassVar[float] = 0.2

    @property
    def default_mesh(self) -> MeshSource:
        """The mesh of the part that is modelled."""
        return SensorSectionSizes() if self.part == "section" else SensorSolidSizes()

    @property
    def shape(self) -> Mapping[str, Any]:
        """All values but materials and what of a section is not seen in its plane."""
        return {name: value for name, value in as_mapping(self).items() if name in _SHAPE}

    def supports(self, dim: int, /) -> Mapping[str, tuple[str, ...]]:
        """Return what is held: the window, and the plane z = 0 of a half across itself."""
        held = {"window": tuple("xyz"[:dim])}
        return held | {"symmetry": ("z",)} if self.part == "half" else held

    def sites(self, groups: Sequence[str], dim: int, /) -> tuple[Site, ...]:
        """Return the sites of groups: internal_markers, rod_feet (where rods begin in the skin), external_markers."""
        unknown = next((group for group in groups if group not in GROUPS), None)
        if unknown is not None:
            raise InputError("record.groups", f"a tactip has no '{unknown}'", f"needs some of {', '.join(GROUPS)}")
        if groups and dim != (2 if self.part == "section" else 3):
            raise InputError("record", f"got the sites of a {self.part} for {dim} dimensions", "needs a mesh of it")
        return tuple(site for group in groups for site in marker_sites(self, group))

    def unused_reason(self, path: str, use: ModelUse, /) -> str:
        """Return why a value, such as ``skin.ridges.pitch``, makes no difference to a model; see `ModelUse`."""
        group = path.partition(".")[0]
        if group in _OF_SECTIONS:
            return "of 2D sections only" if use.dim == 3 else ""
        if group in _SHAPE and not use.meshed and not use.groups:
            return "the mesh comes from a file"
        if path.startswith("skin.ridges.") and path != "skin.ridges.enabled" and not self.skin.ridges.enabled:
            return "switched off"
        if path == "markers.layers" and self.markers.layout == "rings":
            return "of the hexagonal layout only"
        return "of rings only" if path.startswith("markers.rings") and self.markers.layout == "hexagonal" else ""


PRESETS = Presets(TacTip, "fingerslip.specimens.tactip", kept_values)
