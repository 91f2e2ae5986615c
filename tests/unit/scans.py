"""A scan and its mesh that tests share; nothing is meshed."""

from __future__ import annotations

from typing import Any

import numpy as np
import skfem

from fingerslip.mesh.scan.build import Deviation, ScanMesh, SurfaceMesh, layer_quality
from fingerslip.mesh.scan.layered import LayerSizes
from fingerslip.mesh.scan.repair import Repairs
from places import ROOT
from unit.study.block import block_values

MESHES = ROOT / "meshes"
SCAN = SurfaceMesh(
    skin=str(MESHES / "scan_skin.stl"),
    phalanx=str(MESHES / "scan_phalanx.stl"),
    tip=(0.8, 0.36, 0.48),
    pad=(0.48, -0.86, -0.155),
    plate_angle=np.radians(20.0),
    layers=LayerSizes(contact_size=1.2e-3, bulk_size=3e-3, cut=16e-3, tolerance=0.15e-3),
)


def scan_values(**changes: Any) -> dict[str, Any]:
    """Return a study of a scan, as a YAML file holds it."""
    mesh = {"skin": "skin.stl", "phalanx": "phalanx.stl", "tip": [1, 0, 0], "pad": [0, -1, 0], "plate_angle": "20 deg"}
    mesh |= {"unit": "mm", "layers": {"skin_thickness": "1.2 mm", "cut": "16 mm"}}
    return block_values() | {"mesh": mesh | changes, "sweep": {}}


def mesh_of_a_scan() -> ScanMesh:
    """Return a cube in place of a finger."""
    cube = skfem.MeshTet1().scaled(10e-3)
    cube = cube.with_subdomains({"tissue": np.arange(cube.nelements)}).with_boundaries({"skin": cube.boundary_facets()})
    repairs = {"/scans/skin.stl": Repairs(1, 94, (4e-3,), (15.6e-3,))}
    return ScanMesh(cube, repairs, layer_quality(cube), (Deviation("skin", 2e-5, 7e-5),), (0.9e-3, 1e-3, 1.1e-3))
