"""Sections of the fingertip as a source of meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from fingerslip.mesh.sizes import check_sizes
from fingerslip.mesh.source import MeshSource
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.parameters.schema import require_kind
from fingerslip.specimens.fingertip.numbers import FingertipNumbers

if TYPE_CHECKING:
    import skfem

__all__ = ["MeshSizes", "build_section"]

_Element = Literal["Q4", "T3", "T6"]


@parameters
class MeshSizes(MeshSource):
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

    needs_specimen: ClassVar[bool] = True
    element_sizes: ClassVar[tuple[str, ...]] = ("contact_size", "bulk_size")
    dim: ClassVar[int] = 2

    contact_size: PositiveLength = 0.12e-3
    bulk_size: PositiveLength = 0.28e-3
    contact_reach: PositiveLength = 2e-3
    element: _Element = "Q4"

    def __post_init__(self) -> None:
        check_sizes(self.contact_size, self.bulk_size)

    def build(self, specimen: FingertipNumbers, /) -> skfem.Mesh2D:
        """Build the mesh [m]; see :func:`build_section`."""
        from fingerslip.specimens.fingertip.meshing.section.build import mesh_section

        return mesh_section(specimen, self)

    def estimated_cells(self, specimen: FingertipNumbers, /) -> float:
        """Return about how many cells the mesh will have."""
        from fingerslip.specimens.fingertip.meshing.section.build import section_cells

        return section_cells(specimen, self)


_DEFAULT = MeshSizes()


def build_section(
    fingertip: FingertipNumbers,
    *,
    contact_size: float = _DEFAULT.contact_size,
    bulk_size: float = _DEFAULT.bulk_size,
    contact_reach: float = _DEFAULT.contact_reach,
    element: _Element = _DEFAULT.element,
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
    from fingerslip.specimens.fingertip.meshing.section.build import mesh_section

    require_kind(fingertip, FingertipNumbers, "a fingertip, such as preset('wang2014-2d')", "fingertip")
    return mesh_section(fingertip, MeshSizes(contact_size, bulk_size, contact_reach, element))
