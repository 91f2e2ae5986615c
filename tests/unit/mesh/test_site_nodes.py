"""Nodes that stand for sites."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.mesh.site_nodes import site_nodes
from fingerslip.parameters import from_mapping
from fingerslip.sites import Site
from fingerslip.specimens.fingertip import preset
from fingerslip.specimens.fingertip.meshing.section.source import build_section
from fingerslip.specimens.fingertip.receptors import receptor_sites
from unit.fingers import SECTIONS, change


@pytest.mark.parametrize("element", ["Q4", "T3", "T6"])
@pytest.mark.parametrize("section", SECTIONS)
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


def test_site_by_coordinates_from_a_file():
    site = from_mapping(Site, {"name": "mine", "kind": "probe", "position": ["0 mm", "-6.5 mm"]}, "x")
    mesh = build_section(preset("wang2014-2d"))
    (node,) = site_nodes(mesh, [site])
    assert mesh.p[:, node] == pytest.approx([0.0, -6.5e-3])


@pytest.mark.parametrize(
    ("site", "message"),
    [
        (
            Site("far", "probe", (0.0, -8e-3)),
            "site far: x = 0 mm, y = -8 mm is 1.5 mm from the nearest node of the mesh",
        ),
        (Site("deep", "probe", (0.0, -2e-3), "epidermis"), "from the nearest node of 'epidermis', needs <="),
        (Site("FA-II-01", "FA-II", (0.0, -1e-3), "tissue"), "thinner than receptors.fa_ii_depth .* or leave FA-II out"),
        (Site("nail", "probe", (0.0, 0.0), "nail"), "region 'nail' is not in the mesh, it has: epidermis, dermis"),
    ],
)
def test_sites_outside_are_refused(site, message):
    with pytest.raises(InputError, match=message):
        site_nodes(build_section(preset("wang2014-2d")), [site])
