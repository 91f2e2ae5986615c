"""Receptors at their places in the skin, and the nodes that stand for them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingerslip.anatomy import outline_curve, preset
from fingerslip.errors import InputError
from fingerslip.mesh import RECEPTOR_KINDS, Site, build_section, receptor_sites, site_nodes
from fingerslip.parameters import from_mapping
from unit.fingers import SECTIONS, change


def of_kind(sites, kind):
    return [site for site in sites if site.kind == kind]


def depths(fingertip, sites):
    distance, _ = cKDTree(outline_curve(fingertip).points).query([site.position for site in sites])
    return distance


def test_receptors_are_at_their_depths():
    fingertip = preset("wang2014-2d")
    sites = receptor_sites(fingertip)
    mean, foot = 0.5e-3, 0.0625e-3
    expected = {"FA-I": mean + 0.1e-3 - foot, "SA-I": mean + 0.15e-3 - foot, "FA-II": 3e-3, "SA-II": 1.4e-3}
    for kind, depth in expected.items():
        assert depths(fingertip, of_kind(sites, kind)) == pytest.approx(depth, abs=1e-7)


def test_receptors_are_on_the_interface_where_ridges_are_off():
    fingertip = change(ridges={"enabled": False})
    sites = receptor_sites(fingertip)
    assert depths(fingertip, of_kind(sites, "FA-I") + of_kind(sites, "SA-I")) == pytest.approx(0.5e-3, abs=1e-7)
    assert [s.name for s in sites] == [s.name for s in receptor_sites(preset("wang2014-2d"))]


@pytest.mark.parametrize("section", SECTIONS)
def test_receptors_are_numbered_along_the_finger(section):
    sites = receptor_sites(change(section=section))
    for kind in RECEPTOR_KINDS:
        some = of_kind(sites, kind)
        assert [site.name for site in some] == [f"{kind}-{k:02d}" for k in range(1, len(some) + 1)]
        assert np.all(np.diff([site.position[0] for site in some]) > 0)
        assert len(some) >= 20


def test_intermediate_and_limiting_receptors_alternate():
    sites = receptor_sites(preset("wang2014-2d"))
    order = sorted(of_kind(sites, "FA-I") + of_kind(sites, "SA-I"), key=lambda site: site.position[0])
    assert all(a.kind != b.kind for a, b in itertools.pairwise(order))


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
