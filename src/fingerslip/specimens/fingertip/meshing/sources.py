"""The sections of a fingertip and the fingertip in 3D as sources of meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from fingerslip.mesh.source import GradedMesh
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.parameters.schema import require_kind
from fingerslip.specimens.fingertip.numbers import FingertipNumbers

if TYPE_CHECKING:
    import skfem

_InPlane = Literal["Q4", "T3", "T6"]
_Solid = Literal["T4", "T10"]

# Gmsh and scikit-fem are loaded where a mesh is built: a mesh file of one's own does without them.


@parameters
class MeshSizes(GradedMesh):
    """Element sizes and element type of a section.

    Parameters
    ----------
    contact_size : float
        Size along the skin that can touch [m].
    bulk_size : float
        Largest size, far from the contact [m].
    contact_reach : float
        Height above the lowest point up to which the skin is meshed at `contact_size` [m].
    element : {'Q4', 'T3', 'T6'}
        Bilinear quadrilateral, linear or quadratic triangle.
    """

    dim: ClassVar[int] = 2

    contact_size: PositiveLength = 0.12e-3
    bulk_size: PositiveLength = 0.28e-3
    contact_reach: PositiveLength = 2e-3
    element: _InPlane = "Q4"

    def build(self, specimen: FingertipNumbers, /) -> skfem.Mesh2D:
        """Build the mesh [m]; see :func:`build_section`."""
        from fingerslip.specimens.fingertip.meshing.section import mesh_section

        return mesh_section(specimen, self)

    def estimated_cells(self, specimen: FingertipNumbers, /) -> float:
        """Return about how many cells the mesh will have."""
        from fingerslip.specimens.fingertip.meshing.section import section_cells

        return section_cells(specimen, self)


@parameters
class SolidSizes(GradedMesh):
    """Element sizes and element type of a fingertip in 3D.

    Linear tetrahedra lock near incompressibility, so overall slip comes late on them; quadratic
    ones, the default, do not.

    Parameters
    ----------
    element : {'T4', 'T10'}
        Linear or quadratic tetrahedra.
    contact_size : float
        Size along the skin that can touch [m].
    bulk_size : float
        Largest size, far from the contact [m].
    contact_reach : float
        Height above the lowest point up to which the skin is meshed at `contact_size` [m].
    """

    dim: ClassVar[int] = 3

    element: _Solid = "T10"
    contact_size: PositiveLength = 0.8e-3
    bulk_size: PositiveLength = 1.3e-3
    contact_reach: PositiveLength = 1.5e-3

    def build(self, specimen: FingertipNumbers, /) -> skfem.Mesh3D:
        """Build the mesh [m]; see :func:`build_solid`."""
        from fingerslip.specimens.fingertip.meshing.solid import mesh_solid

        return mesh_solid(specimen, self)

    def estimated_cells(self, specimen: FingertipNumbers, /) -> float:
        """Return about how many tetrahedra the mesh will have."""
        from fingerslip.specimens.fingertip.meshing.solid import solid_cells

        return solid_cells(specimen, self)


_SECTION, _SOLID = MeshSizes(), SolidSizes()


def build_section(
    fingertip: FingertipNumbers,
    *,
    contact_size: float = _SECTION.contact_size,
    bulk_size: float = _SECTION.bulk_size,
    contact_reach: float = _SECTION.contact_reach,
    element: _InPlane = _SECTION.element,
) -> skfem.Mesh2D:
    """Build the mesh of a section, with named regions and boundaries.

    Parameters
    ----------
    fingertip : Fingertip
        What to mesh.
    contact_size, bulk_size, contact_reach, element : optional
        As of :class:`MeshSizes`.

    Returns
    -------
    skfem.MeshQuad1, skfem.MeshTri1 or skfem.MeshTri2
        Mesh [m] with the regions `epidermis`, `dermis`, `tissue` and `phalanx` and the boundaries `skin` (outer
        surface), `pad` (its part at the contact size), `epidermis_dermis`, `dermis_tissue`, `phalanx_surface` (with
        the tissue) and its parts `phalanx_palmar` and `phalanx_dorsal`; in a sagittal section also `base` (proximal
        cut) and, where the phalanx reaches it, its part `phalanx_base`.

    Raises
    ------
    InputError
        Where sizes and fingertip do not fit together.
    MeshError
        Where no mesh of good quality comes out.
    """
    require_kind(fingertip, FingertipNumbers, "a fingertip, such as preset('wang2014-2d')", "fingertip")
    return MeshSizes(contact_size, bulk_size, contact_reach, element).build(fingertip)


def build_solid(
    fingertip: FingertipNumbers,
    *,
    contact_size: float = _SOLID.contact_size,
    bulk_size: float = _SOLID.bulk_size,
    contact_reach: float = _SOLID.contact_reach,
    element: _Solid = _SOLID.element,
) -> skfem.Mesh3D:
    """Build the mesh of a fingertip in 3D, with named regions and boundaries.

    Axes: x along the finger towards the tip, y up (a plate comes from below), z across. The lowest point is at x = 0,
    y = -`half_height`; where the finger is level, the plane z = 0 is its sagittal and x = 0 its transverse section.

    Parameters
    ----------
    fingertip : Fingertip
        What to mesh, with its `solid` part.
    contact_size, bulk_size, contact_reach, element : optional
        As of :class:`SolidSizes`.

    Returns
    -------
    skfem.MeshTet1 or skfem.MeshTet2
        Mesh [m] with the regions `epidermis`, `dermis`, `tissue`, `phalanx` and, where there is one, `nail`; and the
        boundaries `skin` (outer surface), `pad` (its part at the contact size), `nail` (its part on the nail),
        `epidermis_dermis`, `dermis_tissue`, `phalanx_surface` (with the tissue), its parts `phalanx_palmar` and
        `phalanx_dorsal`, `base` (proximal cut) and, where the phalanx reaches it, its part `phalanx_base`.

    Raises
    ------
    InputError
        Where sizes and fingertip do not fit together, or the fingertip has only sections.
    MeshError
        Where no mesh of good quality comes out.
    """
    require_kind(fingertip, FingertipNumbers, "a fingertip, such as preset('wang2014-3d')", "fingertip")
    return SolidSizes(element, contact_size, bulk_size, contact_reach).build(fingertip)
