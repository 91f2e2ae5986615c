"""The surface of the phalanx in space as triangles."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from fingerslip.mesh.patches import Triangulation, mesh_surface
from fingerslip.mesh.sizes import SolidSizes
from fingerslip.specimens.fingertip import BoneSurface, Fingertip
from fingerslip.specimens.fingertip.meshing.solid.skin import SolidSkin, contact_points, graded_sizes

__all__ = ["mesh_bone"]

_TISSUE_SHARE = 0.7


def mesh_bone(fingertip: Fingertip, bone: BoneSurface, sizes: SolidSizes, skin: SolidSkin) -> Triangulation:
    """Mesh the surface of the phalanx.

    Parameters
    ----------
    fingertip : Fingertip
        A fingertip in space.
    bone : BoneSurface
        The surface of its phalanx.
    sizes : SolidSizes
        Element sizes.
    skin : SolidSkin
        The skin around it; no triangle is much wider than the tissue between is thick.
    """
    points = bone.points.reshape(-1, 3)
    tissue, _ = cKDTree(skin.points[-1]).query(points)
    largest = np.clip(_TISSUE_SHARE * tissue, sizes.contact_size, sizes.bulk_size)
    wanted = graded_sizes(points, contact_points(fingertip, sizes), sizes.contact_size, largest)
    origin = int(np.abs(bone.points[:, 0, 0]).argmin())
    return mesh_surface(bone.points, bone.open, origin, wanted.reshape(bone.points.shape[:2]))
