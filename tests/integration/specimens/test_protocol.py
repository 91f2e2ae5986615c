"""What every specimen says of itself holds in its mesh."""

import pytest

from fingerslip.mesh.facets import site_nodes
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.specimens.protocol import Specimen
from fingerslip.specimens.tactip.numbers import GROUPS as MARKER_GROUPS

# The groups of sites that specimens of each kind have in every dimension.
GROUPS = {"fingertip": RECEPTOR_KINDS, "tactip": tuple(MARKER_GROUPS), "gel_pad": ("internal_markers",)}
SLOW = ("tactip-ridged-3d", "tactip-smooth-3d", "wang2014-3d")
PRESETS = [
    pytest.param(kind, name, id=name, marks=[pytest.mark.slow] if name in SLOW else [])
    for kind, presets in SPECIMENS.items()
    for name in presets.names
]


@pytest.mark.parametrize(("kind", "name"), PRESETS)
def test_supports_materials_and_sites_are_in_its_default_mesh(kind, name):
    specimen: Specimen = SPECIMENS[kind].read(name)
    mesh = specimen.default_mesh.build(specimen)
    assert set(specimen.supports(mesh.dim())) <= set(mesh.boundaries) | set(mesh.subdomains)
    assert set(mesh.subdomains) == set(specimen.materials)
    sites = specimen.sites(GROUPS[kind], mesh.dim())
    assert len(site_nodes(mesh, sites)) == len(sites) > 0
