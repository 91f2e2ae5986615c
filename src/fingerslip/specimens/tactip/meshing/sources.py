"""The section and the solid of a TacTip as sources of meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from fingerslip.errors import InputError
from fingerslip.mesh.source import GradedMesh
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.specimens.tactip.numbers import TacTipNumbers

if TYPE_CHECKING:
    import skfem


@parameters
class SensorSectionSizes(GradedMesh):
    """Element sizes and element type of the section of a TacTip.

    Parameters
    ----------
    contact_size : float
        Size in the skin that can touch, and at the rods [m].
    bulk_size : float
        Largest size [m].
    contact_reach : float
        Height above the lowest point up to which the skin is meshed at `contact_size` [m].
    element : {'Q4', 'T3', 'T6'}
        Bilinear quadrilateral, linear or quadratic triangle.
    body : {'tactip'}
        What is meshed.
    """

    dim: ClassVar[int] = 2

    contact_size: PositiveLength = 0.3e-3
    bulk_size: PositiveLength = 1.2e-3
    contact_reach: PositiveLength = 8e-3
    element: Literal["Q4", "T3", "T6"] = "Q4"
    body: Literal["tactip"] = "tactip"

    def build(self, specimen: TacTipNumbers, /) -> skfem.Mesh2D:
        """Build the mesh [m]: regions `skin`, `gel`, `rods`, `window`, boundaries `contact` and `window_face`."""
        from fingerslip.specimens.tactip.meshing.build import mesh_sensor_section

        _check_part(specimen, ("section",), self.element)
        return mesh_sensor_section(specimen, self)


@parameters
class SensorSolidSizes(GradedMesh):
    """Element sizes and element type of a TacTip in 3D.

    Parameters
    ----------
    contact_size : float
        Size in the skin that can touch [m].
    bulk_size : float
        Largest size [m].
    contact_reach : float
        Height above the lowest point up to which the skin is meshed at `contact_size` [m].
    rod_size : float
        Largest size at the rods; bends of ridges get finer with it, eight edges in a circle at 0.35 mm [m].
    element : {'T4', 'T10'}
        Linear or quadratic tetrahedron.
    body : {'tactip'}
        What is meshed.
    """

    element_sizes: ClassVar[tuple[str, ...]] = ("contact_size", "rod_size", "bulk_size")
    dim: ClassVar[int] = 3

    contact_size: PositiveLength = 1e-3
    bulk_size: PositiveLength = 3e-3
    contact_reach: PositiveLength = 6e-3
    rod_size: PositiveLength = 0.35e-3
    element: Literal["T4", "T10"] = "T4"
    body: Literal["tactip"] = "tactip"

    def build(self, specimen: TacTipNumbers, /) -> skfem.Mesh3D:
        """Build the mesh [m]: regions and boundaries of the section, and `symmetry` of a half."""
        from fingerslip.specimens.tactip.meshing.build import mesh_sensor_solid

        _check_part(specimen, ("half", "whole"), self.element)
        return mesh_sensor_solid(specimen, self, self.rod_size)


def _check_part(specimen: TacTipNumbers, allowed: tuple[str, ...], element: str) -> None:
    if specimen.part not in allowed:
        raise InputError("part", f"got {specimen.part} with mesh.element {element}", f"needs {' or '.join(allowed)}")
