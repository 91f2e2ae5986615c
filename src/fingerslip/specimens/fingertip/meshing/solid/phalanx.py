"""The surface of the phalanx in space as triangles."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from fingerslip.mesh.patches import Triangulation, mesh_surface
from fingerslip.mesh.sizes import ElementSizes
from fingerslip.specimens.fingertip.meshing.solid.skin import SolidSkin, contact_points, graded_sizes
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.phalanx_surface import PhalanxSurface

__all__ = ["mesh_phalanx"]

_TISSUE_SHARE = 0.7


def mesh_phalanx(
    fingertip: FingertipNumbers, phalanx: PhalanxSurface, sizes: ElementSizes, skin: SolidSkin
) -> Triangulation:
    """Mesh the surface of the phalanx."""
    points = phalanx.points.reshape(-1, 3)
    tissue, _ = cKDTree(skin.points[-1]).query(points)
    largest = np.clip(_TISSUE_SHARE * tissue, sizes.contact_size, sizes.bulk_size)
    wanted = graded_sizes(points, contact_points(fingertip, sizes), sizes.contact_size, largest)
    origin = int(np.abs(phalanx.points[:, 0, 0]).argmin())
    return mesh_surface(phalanx.points, phalanx.open, origin, wanted.reshape(phalanx.points.shape[:2]))
