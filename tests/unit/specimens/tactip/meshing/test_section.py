"""The mesh of a section: conforming, of good quality, with names, nodes at markers."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.errors import MeshError
from fingerslip.mesh.quality import quality_table
from fingerslip.mesh.site_nodes import site_nodes
from fingerslip.specimens.tactip.meshing.section import mesh_sensor_section
from fingerslip.specimens.tactip.meshing.source import SensorSectionSizes
from fingerslip.specimens.tactip.sites import GROUPS
from fingerslip.specimens.tactip.tactip import PRESETS

SIZES = SensorSectionSizes(contact_size=0.5e-3, bulk_size=2e-3)


@pytest.fixture(scope="module")
def ridged():
    return mesh_sensor_section(PRESETS.read("tactip-ridged-2d"), SIZES, "Q4")


def area(mesh, region):
    x, y = mesh.p[:, mesh.t[:, mesh.subdomains[region]]]
    return 0.5 * np.sum(x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0))


def test_names_and_quality(ridged):
    assert set(ridged.subdomains) == {"skin", "gel", "rods", "window"}
    assert set(ridged.boundaries) == {"contact", "window_face"}
    assert all(row.scaled_jacobian > 0.25 for row in quality_table(ridged))


def test_every_marker_is_a_node(ridged):
    sensor = PRESETS.read("tactip-ridged-2d")
    sites = sensor.sites(tuple(GROUPS), 2)
    nodes = site_nodes(ridged, sites)
    assert pytest.approx(np.array([site.position for site in sites]), abs=1e-9) == ridged.p[:, nodes].T


def test_regions_share_nodes_and_leave_no_gaps(ridged):
    outer = ridged.boundary_facets()
    edges = ridged.p[:, ridged.facets[:, outer]]
    # Outside are the skin and three sides of the window.
    window = np.isin(ridged.f2t[0, outer], ridged.subdomains["window"])
    skin = np.isin(ridged.f2t[0, outer], ridged.subdomains["skin"])
    assert (window | skin).all()
    assert np.linalg.norm(edges[:, 0] - edges[:, 1], axis=0)[window].sum() == pytest.approx(34e-3 + 6e-3)
    assert area(ridged, "rods") == pytest.approx(9 * 1e-3 * 5.5e-3, rel=1e-3)


def test_a_smooth_skin_is_a_half_ring():
    mesh = mesh_sensor_section(PRESETS.read("tactip-smooth-2d"), SensorSectionSizes(0.4e-3, 1e-3, element="T3"), "T3")
    cells = mesh.t[:, mesh.subdomains["skin"]]
    a, b, c = mesh.p[:, cells].transpose(1, 2, 0)
    sides = b - a, c - a
    skin = 0.5 * np.abs(sides[0][:, 0] * sides[1][:, 1] - sides[0][:, 1] * sides[1][:, 0]).sum()
    ring = 0.5 * np.pi * (20e-3**2 - 19e-3**2) - 9 * 1e-3 * 0.5e-3
    assert skin == pytest.approx(ring, rel=5e-3)


def with_rods(radius):
    sensor = PRESETS.read("tactip-ridged-2d")
    return dataclasses.replace(sensor, rods=dataclasses.replace(sensor.rods, radius=radius))


@pytest.mark.slow
@pytest.mark.parametrize("radius", [0.4e-3, 0.6e-3])
def test_what_is_refused_is_meshed_again_somewhat_finer(radius):
    sizes = SensorSectionSizes(contact_size=0.4e-3, bulk_size=1.6e-3)
    assert all(row.scaled_jacobian > 0.25 for row in quality_table(sizes.build(with_rods(radius))))


@pytest.mark.slow
def test_rods_that_nearly_fill_a_ridge_are_refused_with_what_fits():
    with pytest.raises(MeshError, match=r"^tactip\.rods\.radius: got 0\.3 mm, which leaves a sliver of gel") as caught:
        SIZES.build(with_rods(0.3e-3))
    assert caught.value.allowed == "needs at least 0.325 mm, or at most 0.225 mm"
