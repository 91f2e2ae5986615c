"""Receptors at their places in the skin."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens.fingertip import outline_curve, preset
from fingerslip.specimens.fingertip.sites import receptor_sites
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
