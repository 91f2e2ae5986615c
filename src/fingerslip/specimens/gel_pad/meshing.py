"""The section and the solid of a gel pad as a source of meshes: rows of cells, with a node in each marker."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.mesh.source import GROWTH, GradedMesh, grade
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.specimens.gel_pad.numbers import GelPadNumbers

if TYPE_CHECKING:
    import skfem

Floats = NDArray[np.float64]

_POINTS = 100  # along which the wanted size is known


@parameters
class PadSizes(GradedMesh):
    """Element sizes and element type of a gel pad.

    Parameters
    ----------
    contact_size : float
        Size among the markers on the touched surface, at most: whole cells from marker to marker [m].
    bulk_size : float
        Largest size [m].
    element : {'Q4', 'H8'}
        Bilinear quadrilateral of a section, trilinear hexahedron in 3D.
    body : {'gel_pad'}
        What is meshed.
    """

    contact_size: PositiveLength = 0.6e-3
    bulk_size: PositiveLength = 2e-3
    element: Literal["Q4", "H8"] = "Q4"
    body: Literal["gel_pad"] = "gel_pad"

    @property
    def dim(self) -> int:
        """Dimension of space."""
        return 2 if self.element == "Q4" else 3

    def build(self, specimen: GelPadNumbers, /) -> skfem.Mesh:
        """Build the mesh [m]: the region `gel`, boundaries `contact` (y = 0) and `back`."""
        import skfem

        if (specimen.part == "section") != (self.element == "Q4"):
            allowed = f"needs {'section' if self.element == 'Q4' else 'whole'}"
            raise InputError("part", f"got {specimen.part} with mesh.element {self.element}", allowed)
        markers, top = specimen.markers, specimen.thickness
        x = self._lines(markers.columns, markers.spacing, specimen.length)
        z = self._lines(markers.rows, markers.spacing, specimen.width)
        y = self._graded(0.0, top)
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
        outside = self._graded(last, 0.5 * extent)[1:]
        return np.concatenate([-outside[::-1], np.linspace(-last, last, among), outside])

    def _graded(self, start: float, end: float) -> Floats:
        """Divide a length [m] from the contact size at its start on."""
        along = np.linspace(start, end, _POINTS)
        return grade(along, np.minimum(self.bulk_size, self.contact_size + GROWTH * (along - start)))
