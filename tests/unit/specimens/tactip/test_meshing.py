"""Meshes of a TacTip: sizes, curves, names, the section and the solid."""

import dataclasses

import numpy as np
import pytest

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.facets import site_nodes
from fingerslip.mesh.quality import quality_table
from fingerslip.specimens.tactip.meshing import mesh_sensor_section, size_function
from fingerslip.specimens.tactip.numbers import GROUPS
from fingerslip.specimens.tactip.tactip import PRESETS, SensorSectionSizes, SensorSolidSizes


def test_a_section_is_no_solid_and_refinement_scales_both_sizes():
    with pytest.raises(InputError, match=r"part: got section with mesh.element T4"):
        SensorSolidSizes().build(PRESETS.read("tactip-ridged-2d"))
    with pytest.raises(InputError, match=r"part: got half with mesh.element Q4"):
        SensorSectionSizes().build(PRESETS.read("tactip-ridged-3d"))
    finer = SensorSectionSizes().refined(0.5)
    assert (finer.contact_size, finer.bulk_size) == (0.15e-3, 0.6e-3)


def test_sizes_at_skin_rod_gel_and_far_away():
    sensor, sizes = PRESETS.read("tactip-smooth-2d"), SensorSectionSizes(0.3e-3, 2e-3)
    size = size_function(sensor, sizes, np.array([[0.0, 0.5e-3]]), np.array([[0.0, 3e-3]]), 0.7 * sensor.rods.radius)
    assert size(3e-3, 0.6e-3, 0.0) == pytest.approx(0.3e-3)
    assert size(0.0, 2.5e-3, 0.0) == pytest.approx(0.3e-3)
    assert 0.3e-3 < size(4e-3, 4e-3, 0.0) < 2e-3
    assert size(0.0, 18e-3, 0.0) == pytest.approx(2e-3)
    assert size(19.5e-3, 19e-3, 0.0) == pytest.approx(0.6e-3, rel=0.1)


SIZES = SensorSectionSizes(contact_size=0.5e-3, bulk_size=2e-3)


@pytest.fixture(scope="module")
def ridged():
    return mesh_sensor_section(PRESETS.read("tactip-ridged-2d"), SIZES)


def areas(mesh, region):
    x, y = mesh.p[:, mesh.t[:, mesh.subdomains[region]]]
    return 0.5 * np.abs(np.sum(x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0), axis=0))


@pytest.mark.slow
def test_names_quality_and_every_marker_is_a_node(ridged):
    """Regions share nodes and leave no gaps: outside are the skin and three sides of the window."""
    assert set(ridged.subdomains) == {"skin", "gel", "rods", "window"}
    assert set(ridged.boundaries) == {"contact", "window_face"}
    at = {name: ridged.p[:, ridged.facets[:, facets]] for name, facets in ridged.boundaries.items()}
    assert np.ptp(at["window_face"][1]) == 0.0
    assert at["contact"][1].min() == pytest.approx(0.0, abs=1e-9)
    assert all(row.scaled_jacobian > 0.25 for row in quality_table(ridged))
    assert_nodes(ridged, PRESETS.read("tactip-ridged-2d").sites(tuple(GROUPS), 2))
    outer = ridged.boundary_facets()
    edges = ridged.p[:, ridged.facets[:, outer]]
    window, skin = (np.isin(ridged.f2t[0, outer], ridged.subdomains[name]) for name in ("window", "skin"))
    assert (window | skin).all()
    assert np.linalg.norm(edges[:, 0] - edges[:, 1], axis=0)[window].sum() == pytest.approx(34e-3 + 6e-3)
    assert areas(ridged, "rods").sum() == pytest.approx(9 * 1e-3 * 5.5e-3, rel=1e-3)


def assert_nodes(mesh, sites):
    places = np.array([site.position for site in sites])
    assert pytest.approx(places, abs=1e-9) == mesh.p[:, site_nodes(mesh, sites)].T


def test_smooth_skin_is_a_half_ring():
    mesh = mesh_sensor_section(PRESETS.read("tactip-smooth-2d"), SensorSectionSizes(0.4e-3, 1e-3, element="T3"))
    ring = 0.5 * np.pi * (20e-3**2 - 19e-3**2) - 9 * 1e-3 * 0.5e-3
    assert areas(mesh, "skin").sum() == pytest.approx(ring, rel=5e-3)


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


@pytest.fixture(scope="module")
def small():
    changes = {"markers": {"rings": [1, 4]}, "dome": {"radius": "10 mm", "height": "8 mm"}}
    return PRESETS.changed({"preset": "tactip-smooth-3d", **changes})


@pytest.fixture(scope="module")
def mesh(small):
    return SensorSolidSizes(1e-3, 2e-3).build(small)


@pytest.mark.slow
def test_half_of_a_dome(small, mesh):
    assert set(mesh.boundaries) == {"contact", "window_face", "symmetry"}
    assert mesh.p[2].min() == 0.0
    outer = mesh.boundary_facets()
    flat = outer[(mesh.p[2, mesh.facets[:, outer]] == 0.0).all(axis=0)]
    assert set(mesh.boundaries["symmetry"]) == set(flat)
    assert not np.isin(mesh.boundaries["contact"], flat).any()
    corners = mesh.p[:, mesh.t].transpose(2, 1, 0)
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    below = volume[np.concatenate([mesh.subdomains[name] for name in ("skin", "gel", "rods")])].sum()
    cap = np.pi * 8e-3**2 * (10e-3 - 8e-3 / 3) / 2
    assert below == pytest.approx(cap, rel=0.02)
    rods = volume[mesh.subdomains["rods"]].sum()
    # One on the axis and two in 2D are halves, one is whole.
    assert rods == pytest.approx(2.5 * np.pi * 0.5e-3**2 * 2.5e-3, rel=0.01)
    assert_nodes(mesh, small.sites(("internal_markers", "external_markers"), 3))


@pytest.mark.slow
def test_the_whole_is_its_half_and_the_mirror_image_of_it(small, mesh):
    sensor = dataclasses.replace(small, part="whole")
    whole = SensorSolidSizes(1e-3, 2e-3).build(sensor)
    assert set(whole.boundaries) == {"contact", "window_face"}
    assert whole.nelements == 2 * mesh.nelements
    assert whole.p.shape[1] == 2 * mesh.p.shape[1] - np.count_nonzero(mesh.p[2] == 0.0)
    corners = whole.p[:, whole.t].transpose(2, 1, 0)
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1])
    assert (volume > 0.0).all() or (volume < 0.0).all()
    assert_nodes(whole, sensor.sites(("internal_markers", "external_markers"), 3))
