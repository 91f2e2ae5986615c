"""Every specimen that a study may name answers the protocol, and its presets read."""

from __future__ import annotations

import dataclasses

import pytest

from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.specimens.protocol import Specimen
from fingerslip.specimens.tactip.sites import GROUPS

PRESETS = [(kind, name) for kind, presets in SPECIMENS.items() for name in presets.names]
SITES = {"fingertip": RECEPTOR_KINDS, "tactip": tuple(GROUPS)}


@pytest.mark.parametrize(("kind", "name"), PRESETS, ids=[name for _, name in PRESETS])
def test_a_model_can_be_made_of_every_preset(kind, name):
    specimen: Specimen = SPECIMENS[kind].read(name)
    assert dataclasses.is_dataclass(specimen)
    assert type(specimen.default_mesh) in specimen.mesh_sources
    assert specimen.depth > 0
    assert 0 < specimen.largest_extent < 1
    assert specimen.formulation in ("plane_strain", "plane_stress")
    assert specimen.materials
    dim = specimen.default_mesh.dim
    assert all(set(axes) <= set("xyz"[:dim]) for axes in specimen.supports(dim).values())
    for site in specimen.sites(SITES[kind], dim):
        assert len(site.position) == dim
        assert site.region in specimen.materials
