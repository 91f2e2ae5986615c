"""From a fingertip to a mesh: sections, the fingertip in space, quality, files, and the nodes of receptor sites."""

from fingerslip.mesh.groups import require_boundary, require_region
from fingerslip.mesh.io import read_mesh, write_mesh
from fingerslip.mesh.quality import QualityLimits, QualityRow, check_quality, quality_limits, quality_table
from fingerslip.mesh.section import build_section, mesh_section
from fingerslip.mesh.sites import RECEPTOR_KINDS, Site, receptor_sites, site_nodes
from fingerslip.mesh.sizes import MeshSizes, SolidSizes
from fingerslip.mesh.solid import build_solid, mesh_solid
from fingerslip.mesh.solid_sites import reference_sites, solid_receptor_sites

__all__ = [
    "RECEPTOR_KINDS",
    "MeshSizes",
    "QualityLimits",
    "QualityRow",
    "Site",
    "SolidSizes",
    "build_section",
    "build_solid",
    "check_quality",
    "mesh_section",
    "mesh_solid",
    "quality_limits",
    "quality_table",
    "read_mesh",
    "receptor_sites",
    "reference_sites",
    "require_boundary",
    "require_region",
    "site_nodes",
    "solid_receptor_sites",
    "write_mesh",
]
