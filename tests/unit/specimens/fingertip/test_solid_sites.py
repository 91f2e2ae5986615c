"""Sites in 3D: on their surfaces, named as in the paper, found in the mesh."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.mesh.site_nodes import site_nodes
from fingerslip.specimens.fingertip import depth_below_skin
from fingerslip.specimens.fingertip.sites import receptor_sites, reference_sites, solid_receptor_sites
from unit.fingers import change, change_solid, coarse_solid

FINGER = change_solid()


def places(sites):
    return {site.name: np.array(site.position) for site in sites}


def test_reference_nodes_are_on_skin_and_tissue():
    sites = reference_sites(FINGER)
    at = places(sites)
    assert list(at) == [f"{layer}-{line}{k}" for layer in ("skin", "tissue") for line in "hv" for k in range(1, 8)]
    depth = depth_below_skin(FINGER, np.array(list(at.values())))
    assert depth[:14] == pytest.approx(np.zeros(14), abs=5e-6)
    assert depth[14:] == pytest.approx(np.full(14, 1e-3), abs=5e-6)
    assert all(max(abs(at[f"skin-h{k}"][2]), abs(at[f"skin-v{k}"][0])) < 1e-12 for k in range(1, 8))
    # Nodes 2 to 5 lie evenly about the lowest point, and the numbers run towards the tip and towards +z.
    assert at["skin-v2"][2] == pytest.approx(-at["skin-v5"][2])
    assert at["skin-h7"][0] > at["skin-h1"][0]
    assert at["skin-v7"][2] > at["skin-v1"][2]
    assert np.linalg.norm(at["skin-v4"] - at["skin-v3"]) == pytest.approx(2.2e-3, rel=0.01)


def test_receptors_are_those_of_the_section_on_a_plain_interface():
    plain = dataclasses.replace(FINGER.ridges, enabled=False)
    flat = receptor_sites(dataclasses.replace(FINGER, ridges=plain))
    solid = solid_receptor_sites(change_solid(ridges={"enabled": True}))
    assert [site.name for site in solid] == [site.name for site in flat]
    assert all(site.position == pytest.approx((*other.position, 0.0)) for site, other in zip(solid, flat, strict=True))


def test_sites_are_in_the_mesh():
    sites = (*reference_sites(FINGER), *solid_receptor_sites(FINGER))
    nodes = site_nodes(coarse_solid(), sites)
    away = np.linalg.norm(coarse_solid().p[:, nodes].T - [site.position for site in sites], axis=1)
    assert away.max() < 1.2e-3


def test_sites_stand_with_the_finger():
    level, turned = (places(reference_sites(change_solid(solid={"angle": a}))) for a in ("0 rad", "0.3 rad"))
    assert turned["skin-h7"][1] > level["skin-h7"][1]
    assert np.linalg.norm(turned["skin-h1"] - turned["skin-v7"]) == pytest.approx(
        np.linalg.norm(level["skin-h1"] - level["skin-v7"])
    )


def test_sections_have_no_sites_in_space():
    for function in (reference_sites, solid_receptor_sites):
        with pytest.raises(InputError, match=r"fingertip.solid: is missing"):
            function(change())
