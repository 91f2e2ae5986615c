"""What every specimen says of itself holds in its mesh."""

from __future__ import annotations

import pytest

from fingerslip.mesh.site_nodes import site_nodes
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.specimens.protocol import Specimen

PRESETS = [(presets, name) for presets in SPECIMENS.values() for name in presets.names]


@pytest.mark.parametrize(("presets", "name"), PRESETS, ids=[name for _, name in PRESETS])
def test_supports_materials_and_sites_are_in_its_default_mesh(presets, name):
    specimen: Specimen = presets.read(name)
    mesh = specimen.default_mesh.build(specimen)
    assert set(specimen.supports(mesh.dim())) <= set(mesh.boundaries) | set(mesh.subdomains)
    assert set(mesh.subdomains) == set(specimen.materials)
    sites = specimen.sites(RECEPTOR_KINDS, mesh.dim())
    assert len(site_nodes(mesh, sites)) == len(sites) > 0
