"""What every specimen says of itself holds in its mesh: supports, materials and the nodes of its sites."""

import itertools

import numpy as np
import pytest

from fingerslip.mesh.facets import site_nodes
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.specimens.fingertip.fingertip import build_section, preset
from fingerslip.specimens.fingertip.sites import receptor_sites
from fingerslip.specimens.protocol import Specimen
from fingerslip.specimens.tactip.numbers import GROUPS as MARKER_GROUPS
from integration.conftest import cases
from unit.fingers import SECTIONS, change

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


# All elements and both sections are in the fast cases.
FAST = (("sagittal", "T3"), ("sagittal", "T6"), ("transverse", "Q4"))


@pytest.mark.parametrize(("section", "element"), cases(itertools.product(SECTIONS, ("Q4", "T3", "T6")), FAST))
def test_nodes_are_near_their_sites_and_in_their_region(element, section):
    fingertip = change(section=section)
    mesh, sites = build_section(fingertip, element=element), receptor_sites(fingertip)
    nodes = site_nodes(mesh, sites)
    distance = np.linalg.norm(mesh.p[:, nodes].T - [site.position for site in sites], axis=1)
    assert distance.max() < 0.25e-3
    for node, site in zip(nodes, sites, strict=True):
        assert node in mesh.t[:, mesh.subdomains[site.region]]


def test_ridge_tip_receptors_are_exactly_on_nodes():
    fingertip = preset("wang2014-2d")
    mesh = build_section(fingertip)
    tips = [s for s in receptor_sites(fingertip) if s.kind in {"FA-I", "SA-I"} and -4e-3 < s.position[0] < 2e-3]
    nodes = site_nodes(mesh, tips)
    expected = np.array([site.position for site in tips])
    assert np.abs(mesh.p[:, nodes].T - expected).max() < 1e-8
