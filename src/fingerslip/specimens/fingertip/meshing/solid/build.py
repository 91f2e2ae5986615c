"""Build the mesh of a fingertip in space."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
import skfem
from numpy.typing import NDArray

from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.sizes import ElementSizes
from fingerslip.specimens.fingertip.meshing.names import DERMIS, EPIDERMIS, NAIL, PHALANX, TISSUE, with_names
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.phalanx_surface import phalanx_surface
from fingerslip.specimens.fingertip.pose import posed
from fingerslip.specimens.fingertip.skin_surface import skin_section, solid_shape

if TYPE_CHECKING:
    from fingerslip.specimens.fingertip.meshing.section.core import CoreMesh
    from fingerslip.specimens.fingertip.meshing.solid.skin import SolidSkin

__all__ = ["mesh_solid", "solid_cells"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_SLICES = 400


def mesh_solid(fingertip: FingertipNumbers, sizes: ElementSizes) -> skfem.Mesh3D:
    """Build the mesh of a fingertip in space from a set of sizes; regions and boundaries are those of `build_solid`."""
    # Gmsh is loaded here and nowhere else: a mesh file of one's own does without it.
    from fingerslip.specimens.fingertip.meshing.solid.core import mesh_solid_core
    from fingerslip.specimens.fingertip.meshing.solid.phalanx import mesh_phalanx
    from fingerslip.specimens.fingertip.meshing.solid.skin import check_skin_fits, inner_surface, sweep_solid_skin

    check_skin_fits(fingertip)
    phalanx = phalanx_surface(fingertip)
    skin = sweep_solid_skin(fingertip, sizes, phalanx.points.reshape(-1, 3))
    core = mesh_solid_core(inner_surface(skin), mesh_phalanx(fingertip, phalanx, sizes, skin), sizes.bulk_size)
    mesh = _joined(fingertip, skin, core)
    mesh = dataclasses.replace(mesh, doflocs=np.ascontiguousarray(posed(fingertip, mesh.p.T).T))
    check_quality(mesh)
    return _quadratic(mesh) if sizes.element == "T10" else mesh


def solid_cells(fingertip: FingertipNumbers, sizes: ElementSizes) -> float:
    """Return about how many tetrahedra a fine mesh will have, without making it.

    As many regular ones of the bulk's size as fill the finger, whose sections are ellipses; coarse meshes have more,
    because layers and contact are finer.
    """
    outline = fingertip.sagittal
    x = np.linspace(-outline.pad_length, outline.tip_length, _SLICES)
    _, height, width = skin_section(fingertip, x)
    volume = float(np.trapezoid(np.pi * height * width, x))
    return 6.0 * float(np.sqrt(2.0)) * volume / sizes.bulk_size**3


def _quadratic(mesh: skfem.MeshTet1) -> skfem.MeshTet2:
    """Return the mesh with a node in the middle of every edge, and its names."""
    finer = skfem.MeshTet2.from_mesh(mesh)
    return dataclasses.replace(finer, _subdomains=mesh.subdomains, _boundaries=mesh.boundaries)


def _joined(fingertip: FingertipNumbers, skin: SolidSkin, core: CoreMesh) -> skfem.MeshTet1:
    """Join skin and core along the dermis-tissue interface; the skin's nodes come first, row by row."""
    from fingerslip.specimens.fingertip.meshing.solid.skin import tetrahedra

    rows, columns = skin.points.shape[:2]
    above = (rows - 1) * columns
    points = np.vstack([skin.points[:-1].reshape(-1, 3), core.points])
    cells, layer = tetrahedra(skin)
    inside = [core.cells["tissue"] + above, core.cells["phalanx"] + above]
    nodes = np.vstack([cells, *inside])
    in_core = np.repeat([TISSUE, PHALANX], [len(part) for part in inside])
    region = np.concatenate([_skin_regions(fingertip, skin, cells, layer), in_core])
    order = np.argsort(region, kind="stable")
    mesh = skfem.MeshTet1(np.ascontiguousarray(points.T), np.ascontiguousarray(nodes[order].astype(np.int32).T))
    return with_names(mesh, region[order], skin.fine)


def _skin_regions(fingertip: FingertipNumbers, skin: SolidSkin, cells: Integers, layer: Integers) -> Integers:
    """Return the region of each tetrahedron of the skin, by its row and, for the nail, by its place."""
    middle = (skin.levels[:-1] + skin.levels[1:]) / 2
    region = np.where(middle < fingertip.layers.epidermis_thickness, EPIDERMIS, DERMIS)[layer]
    nail = solid_shape(fingertip).nail
    if nail is not None:
        # A prism is all nail or none of it, so the place is that of its columns on the outer surface.
        x, y, z = skin.points[0][skin.triangles].mean(axis=1).T
        on_nail = (nail.start < x) & (x < nail.end) & (np.abs(z) < nail.half_width) & (y > 0.0)
        triangle = np.tile(np.arange(len(skin.triangles)), len(cells) // len(skin.triangles))
        region = np.where((middle < nail.thickness)[layer] & on_nail[triangle], NAIL, region)
    return region
