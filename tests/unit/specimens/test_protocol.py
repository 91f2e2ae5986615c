"""Every specimen that a study may name answers the protocol, and its presets read."""

from __future__ import annotations

import dataclasses

import pytest

from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.specimens.protocol import Specimen

PRESETS = [(presets, name) for presets in SPECIMENS.values() for name in presets.names]


@pytest.mark.parametrize(("presets", "name"), PRESETS, ids=[name for _, name in PRESETS])
def test_a_model_can_be_made_of_every_preset(presets, name):
    specimen: Specimen = presets.read(name)
    assert dataclasses.is_dataclass(specimen)
    assert type(specimen.default_mesh) in specimen.mesh_sources
    assert specimen.depth > 0
    assert 0 < specimen.largest_extent < 1
    assert specimen.formulation in ("plane_strain", "plane_stress")
    assert specimen.materials
    dim = specimen.default_mesh.dim
    assert all(set(axes) <= set("xyz"[:dim]) for axes in specimen.supports(dim).values())
    for site in specimen.sites(RECEPTOR_KINDS, dim):
        assert len(site.position) == dim
        assert site.region in specimen.materials
