"""Receptors, reference nodes and dots at their places in the skin."""

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingerslip.mesh.facets import site_nodes
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens.fingertip.fingertip import preset
from fingerslip.specimens.fingertip.outline import outline_curve
from fingerslip.specimens.fingertip.sites import receptor_sites, reference_sites, skin_markers, solid_receptor_sites
from fingerslip.specimens.fingertip.skin import depth_below_skin
from unit.fingers import SECTIONS, change, change_solid, coarse_solid


def of_kind(sites, kind):
    return [site for site in sites if site.kind == kind]


def depths(fingertip, sites):
    distance, _ = cKDTree(outline_curve(fingertip).points).query([site.position for site in sites])
    return distance


def test_receptors_are_at_their_depths_and_on_the_interface_where_ridges_are_off():
    ridged, plain = preset("wang2014-2d"), change(ridges={"enabled": False})
    sites, flat = receptor_sites(ridged), receptor_sites(plain)
    mean, foot = 0.5e-3, 0.0625e-3
    expected = {"FA-I": mean + 0.1e-3 - foot, "SA-I": mean + 0.15e-3 - foot, "FA-II": 3e-3, "SA-II": 1.4e-3}
    for kind, depth in expected.items():
        assert depths(ridged, of_kind(sites, kind)) == pytest.approx(depth, abs=1e-7)
    assert depths(plain, of_kind(flat, "FA-I") + of_kind(flat, "SA-I")) == pytest.approx(0.5e-3, abs=1e-7)
    assert [site.name for site in flat] == [site.name for site in sites]


@pytest.mark.parametrize("section", SECTIONS)
def test_receptors_are_numbered_along_the_finger_and_those_of_both_ridges_alternate(section):
    sites = receptor_sites(change(section=section))
    for kind in RECEPTOR_KINDS:
        some = of_kind(sites, kind)
        assert [site.name for site in some] == [f"{kind}-{k:02d}" for k in range(1, len(some) + 1)]
        assert np.all(np.diff([site.position[0] for site in some]) > 0)
        assert len(some) >= 20
    order = sorted(of_kind(sites, "FA-I") + of_kind(sites, "SA-I"), key=lambda site: site.position[0])
    assert all(a.kind != b.kind for a, b in itertools.pairwise(order))


FINGER = change_solid()


def places(sites):
    return {site.name: np.array(site.position) for site in sites}


def test_reference_nodes_are_on_skin_and_tissue_and_stand_with_the_finger():
    sites = reference_sites(FINGER)
    at = places(sites)
    assert list(at) == [f"{layer}-{line}{k}" for layer in ("skin", "tissue") for line in "hv" for k in range(1, 8)]
    depth = depth_below_skin(FINGER, np.array(list(at.values())))
    assert depth == pytest.approx(np.repeat([0.0, 1e-3], 14), abs=5e-6)
    assert all(max(abs(at[f"skin-h{k}"][2]), abs(at[f"skin-v{k}"][0])) < 1e-12 for k in range(1, 8))
    # Nodes 2 to 5 lie evenly about the lowest point, and the numbers run towards the tip and towards +z.
    assert at["skin-v2"][2] == pytest.approx(-at["skin-v5"][2])
    assert at["skin-h7"][0] > at["skin-h1"][0]
    assert at["skin-v7"][2] > at["skin-v1"][2]
    assert np.linalg.norm(at["skin-v4"] - at["skin-v3"]) == pytest.approx(2.2e-3, rel=0.01)
    turned = places(reference_sites(change_solid(solid={"angle": "0.3 rad"})))
    assert turned["skin-h7"][1] > at["skin-h7"][1]
    lengths = [np.linalg.norm(its["skin-h1"] - its["skin-v7"]) for its in (turned, at)]
    assert lengths[0] == pytest.approx(lengths[1])


def test_receptors_in_3d_are_those_of_the_section_on_a_plain_interface():
    flat = receptor_sites(dataclasses.replace(FINGER, ridges=dataclasses.replace(FINGER.ridges, enabled=False)))
    solid = solid_receptor_sites(change_solid(ridges={"enabled": True}))
    expected = [(site.name, pytest.approx((*site.position, 0.0))) for site in flat]
    assert [(site.name, site.position) for site in solid] == expected


@pytest.mark.slow
def test_sites_are_in_the_mesh_and_dots_are_nodes_of_the_skin():
    sites, mesh = (*reference_sites(FINGER), *solid_receptor_sites(FINGER)), coarse_solid()
    away = np.linalg.norm(mesh.p[:, site_nodes(mesh, sites)].T - [site.position for site in sites], axis=1)
    assert away.max() < 1.2e-3
    dots = site_nodes(mesh, skin_markers(FINGER, 3e-3, 1))
    assert set(dots) <= set(mesh.facets[:, mesh.boundaries["skin"]].ravel())


def test_dots_lie_on_the_skin_and_form_a_lattice_from_below():
    sites = skin_markers(FINGER)
    at = np.array([site.position for site in sites])
    assert len(sites) == 61
    assert sites[0].name == "external-marker-0-01"
    assert at[0] == pytest.approx([0.0, -FINGER.sagittal.half_height, 0.0], abs=1e-12)
    assert depth_below_skin(FINGER, at) == pytest.approx(np.zeros(61), abs=1e-5)
    apart = np.linalg.norm(at[:, None, [0, 2]] - at[None][:, :, [0, 2]], axis=2) + np.eye(61)
    assert apart.min(axis=1) == pytest.approx(np.full(61, 1.5e-3))
