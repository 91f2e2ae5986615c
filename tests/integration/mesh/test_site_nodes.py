"""Nodes that stand for the receptors of a section."""

import itertools

import numpy as np
import pytest

from fingerslip.mesh.facets import site_nodes
from fingerslip.specimens.fingertip.fingertip import build_section, preset
from fingerslip.specimens.fingertip.sites import receptor_sites
from integration.conftest import cases
from unit.fingers import SECTIONS, change

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
