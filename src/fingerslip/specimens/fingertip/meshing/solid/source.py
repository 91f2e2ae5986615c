"""The fingertip in 3D as a source of meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from fingerslip.mesh.sizes import check_sizes
from fingerslip.mesh.source import MeshSource
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.parameters.schema import require_kind
from fingerslip.specimens.fingertip.numbers import FingertipNumbers

if TYPE_CHECKING:
    import skfem

__all__ = ["SolidSizes", "build_solid"]

_Element = Literal["T4", "T10"]


@parameters
class SolidSizes(MeshSource):
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

    needs_specimen: ClassVar[bool] = True
    element_sizes: ClassVar[tuple[str, ...]] = ("contact_size", "bulk_size")
    dim: ClassVar[int] = 3

    element: _Element = "T10"
    contact_size: PositiveLength = 0.8e-3
    bulk_size: PositiveLength = 1.3e-3
    contact_reach: PositiveLength = 1.5e-3

    def __post_init__(self) -> None:
        check_sizes(self.contact_size, self.bulk_size)

    def build(self, specimen: FingertipNumbers, /) -> skfem.Mesh3D:
        """Build the mesh [m]; see :func:`build_solid`."""
        from fingerslip.specimens.fingertip.meshing.solid.build import mesh_solid

        return mesh_solid(specimen, self)

    def estimated_cells(self, specimen: FingertipNumbers, /) -> float:
        """Return about how many tetrahedra the mesh will have."""
        from fingerslip.specimens.fingertip.meshing.solid.build import solid_cells

        return solid_cells(specimen, self)


_DEFAULT = SolidSizes()


def build_solid(
    fingertip: FingertipNumbers,
    *,
    contact_size: float = _DEFAULT.contact_size,
    bulk_size: float = _DEFAULT.bulk_size,
    contact_reach: float = _DEFAULT.contact_reach,
    element: _Element = _DEFAULT.element,
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
    from fingerslip.specimens.fingertip.meshing.solid.build import mesh_solid

    require_kind(fingertip, FingertipNumbers, "a fingertip, such as preset('wang2014-3d')", "fingertip")
    return mesh_solid(fingertip, SolidSizes(element, contact_size, bulk_size, contact_reach))
