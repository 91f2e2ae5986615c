"""From a fingertip to a mesh: sections, quality, files, and the nodes of receptor sites."""

from fingerslip.mesh.groups import require_boundary, require_region
from fingerslip.mesh.io import read_mesh, write_mesh
from fingerslip.mesh.quality import QualityLimits, QualityRow, check_quality, quality_limits, quality_table
from fingerslip.mesh.section import build_section, mesh_section
from fingerslip.mesh.sites import RECEPTOR_KINDS, Site, receptor_sites, site_nodes
from fingerslip.mesh.sizes import MeshSizes

__all__ = [
    "RECEPTOR_KINDS",
    "MeshSizes",
    "QualityLimits",
    "QualityRow",
    "Site",
    "build_section",
    "check_quality",
    "mesh_section",
    "quality_limits",
    "quality_table",
    "read_mesh",
    "receptor_sites",
    "require_boundary",
    "require_region",
    "site_nodes",
    "write_mesh",
]
