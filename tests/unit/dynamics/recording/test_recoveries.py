"""Sites are read from the coordinates once for motions of one body."""

from __future__ import annotations

import numpy as np

import fingerslip as fs
from fingerslip.dynamics.recording.recoveries import Recoveries
from fingerslip.dynamics.system.system import build_system
from fingerslip.fe.recovery import site_recovery
from problems.reduced import SITES, deep_push_and_slide


def test_motion_and_strain_at_sites_are_those_of_the_mesh():
    system = build_system(deep_push_and_slide())
    regions = [site.region for site in SITES]
    at_sites = Recoveries(system).at_sites(system.site_nodes, regions)
    field = np.random.default_rng(0).normal(size=system.mass.shape[0])
    taken, on_mesh = at_sites.near.read(field), system.coordinates.on_mesh(field)
    expected = on_mesh.reshape(-1, 2)[system.site_nodes]
    np.testing.assert_array_equal((at_sites.motion @ taken).reshape(expected.shape), expected)
    strains = site_recovery(system.space, system.materials, system.site_nodes, regions).strains(on_mesh)
    assert at_sites.strain_shape == strains.shape
    np.testing.assert_allclose(at_sites.strain @ taken, strains.ravel(), rtol=1e-12)


def test_the_same_sites_are_worked_out_once():
    system = build_system(deep_push_and_slide())
    recoveries, regions = Recoveries(system), [site.region for site in SITES]
    known = recoveries.at_sites(system.site_nodes, regions)
    assert recoveries.at_sites(system.site_nodes.copy(), list(regions)) is known
    assert recoveries.at_sites(system.site_nodes, [None] * len(regions)) is not known


def test_no_strains_are_read_of_sites_at_large_strain():
    system = build_system(deep_push_and_slide(kinematics="finite", materials={"bulk": fs.NeoHookean(1e5, 0.3, 1000.0)}))
    at_sites = Recoveries(system).at_sites(system.site_nodes, [site.region for site in SITES])
    assert at_sites.strain_shape == (0, 3)
    assert at_sites.motion.shape[0] == 2 * len(SITES)
