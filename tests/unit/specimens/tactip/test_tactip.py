"""The sensor with pins: its shape, markers, presets and meshes."""

import dataclasses
from functools import partial

import numpy as np
import pytest

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.facets import site_nodes
from fingerslip.mesh.quality import quality_table
from fingerslip.specimens.protocol import ModelUse
from fingerslip.specimens.tactip.meshing import mesh_sensor_section, size_function
from fingerslip.specimens.tactip.numbers import GROUPS, marker_sites, modelled_places
from fingerslip.specimens.tactip.parts import Dome, Markers, Ridges, Skin, place_points, skin_lines
from fingerslip.specimens.tactip.tactip import PRESETS, SensorSectionSizes, SensorSolidSizes

SENSOR = PRESETS.read("tactip-ridged-2d")


def test_flanks_are_upright_for_high_ridges_and_rods_begin_in_the_crowns():
    assert Ridges(True, 3.3e-3, 3e-3, 4).steepness == pytest.approx(np.pi / 2)
    low = Ridges(True, 3.3e-3, 0.5e-3, 4)
    assert 2 * low.bend_radius * (1 - np.cos(low.steepness)) == pytest.approx(0.5e-3)
    assert (SENSOR.rod_depth, SENSOR.marker_depth) == (pytest.approx(0.5e-3), pytest.approx(6e-3))


def changed(**changes):
    return PRESETS.changed({"preset": "tactip-ridged-2d", **changes})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Skin(1.7e-3, Ridges(True, 3.3e-3, 3e-3, 4)), "fills its grooves"),
        *((partial(Markers, "rings", rings, 1, 1e-3), "needs 1 on the axis") for rings in ((), (2, 8), (1, 7))),
        (lambda: changed(rods={"embedding": "1 mm"}), "rods.embedding: got 1 mm"),
        (lambda: changed(rods={"radius": "1.3 mm"}), "inside its ridge"),
        (lambda: changed(rods={"length": "10 mm"}), "make the rods shorter or thinner"),
        (lambda: changed(rods={"length": "16 mm"}), r"needs < 20 mm \(dome.radius\)"),
        (lambda: changed(markers={"layout": "hexagonal"}), "needs rings, as a rod begins in the crown.* smooth skin"),
        (lambda: changed(markers={"spacing": "3 mm"}), "as a ridge has each ring"),
        (lambda: changed(markers={"rings": [1, 8, 16, 24, 32, 40]}), "has 5 rings"),
        (lambda: changed(dome={"height": "4 mm"}), "from crowns to its inside"),
        (lambda: SENSOR.sites(("FA-I",), 2), "a tactip has no 'FA-I', needs some of internal_markers"),
        (lambda: SENSOR.sites(("internal_markers",), 3), "got the sites of a section for 3 dimensions"),
    ],
)
def test_what_does_not_fit_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize("name", PRESETS.names)
def test_what_the_paper_prints_and_what_it_does_not_comes_first_with_a_range(name):
    sensor = PRESETS.read(name)
    ridges = sensor.skin.ridges
    assert (ridges.pitch, ridges.height, sensor.skin.thickness) == (3.3e-3, 3e-3, 1e-3)
    assert sum(sensor.markers.rings) == 81
    assert ridges.enabled == ("ridged" in name)
    assert (sensor.part == "section") == name.endswith("2d")
    rows = PRESETS.table(name)
    sources = [row.source for row in rows]
    assert sources == sorted(sources, key=lambda source: source != "assumed")
    notes = {row.path: row.note for row in rows if row.source == "assumed"}
    for path in ("dome.radius", "materials.gel.youngs_modulus", "materials.skin.youngs_modulus", "rods.radius"):
        assert "range" in notes[path]


DOME, FLAT = Dome(20e-3, 20e-3), Dome(5e-3, 8e-3, 15e-3)
RIDGES = Ridges(True, 3.3e-3, 3e-3, 4)


def test_points_of_a_dome_lie_on_circles_and_a_flat_sensor_is_flat_then_turns_then_rises():
    along = np.linspace(0.0, 30e-3, 7)
    points = place_points(DOME, along, np.full(7, 2e-3)) - [0.0, 20e-3]
    assert np.hypot(*points.T) == pytest.approx(18e-3)
    along = np.array([10e-3, 15e-3 + 2.5e-3 * np.pi, 15e-3 + 2.5e-3 * np.pi + 1e-3])
    expected = np.array([[10e-3, 0.0], [20e-3, 5e-3], [20e-3, 6e-3]])
    assert place_points(FLAT, along, np.zeros(3)) == pytest.approx(expected)


@pytest.mark.parametrize("dome", [DOME, FLAT, Dome(20e-3, 12e-3)])
@pytest.mark.parametrize("enabled", [True, False])
def test_both_lines_run_from_the_axis_to_the_window(dome, enabled):
    lines = skin_lines(dome, Skin(1e-3, Ridges(enabled, 3.3e-3, 3e-3, 4)), 3.3e-3)
    for line in (lines.outer, lines.inner):
        assert line[0, 0] == 0.0
        assert line[-1, 1] == dome.height
        assert np.linalg.norm(np.diff(line, axis=0), axis=1).min() > 1e-6
    assert len(lines.outer) == len(lines.inner) == lines.corners[-1] + 1
    assert lines.inner[0, 1] - lines.outer[0, 1] == pytest.approx(1e-3)


def test_ridges_of_a_wide_dome_have_the_thickness_and_the_height_of_the_paper():
    lines = skin_lines(Dome(2.0, 2.0), Skin(1e-3, RIDGES), 3.3e-3)
    ridged = lines.outer[: lines.corners[-2] + 1]
    away = np.linalg.norm(lines.inner[: lines.corners[-2] + 1, None] - ridged[None], axis=2)
    low = skin_lines(DOME, Skin(0.5e-3, Ridges(True, 3.3e-3, 0.5e-3, 4)), 3.3e-3)
    assert np.linalg.norm(np.diff(low.outer, axis=0), axis=1).min() > 1e-6, "no upright flanks"
    # Splines join the points, so points alone are a little farther apart than the lines.
    assert away.min(axis=1) == pytest.approx(1e-3, rel=0.03)
    crowns, valleys = lines.outer[lines.corners[:-1:2], 1], lines.outer[lines.corners[1:-1:2], 1]
    assert valleys - crowns == pytest.approx(3e-3, rel=0.02)


def test_every_part_has_its_own_markers_and_rods_stand_upright_on_the_dome():
    for part, count in (("section", 9), ("half", 45), ("whole", 81)):
        sensor = dataclasses.replace(SENSOR, part=part)
        names = {site.name for site in marker_sites(sensor, "internal_markers")}
        assert len(modelled_places(sensor).ring) == len(names) == count
    feet, ends = (
        np.array([site.position for site in marker_sites(dataclasses.replace(SENSOR, part="whole"), group)])
        for group in ("rod_feet", "internal_markers")
    )
    assert np.linalg.norm(ends - feet, axis=1) == pytest.approx(5.5e-3)
    radius = SENSOR.dome.radius
    centre = np.array([0.0, radius, 0.0])
    assert np.cross(ends - centre, feet - centre) == pytest.approx(0.0, abs=1e-12)
    outer = marker_sites(SENSOR, "external_markers")
    away = [np.hypot(x, y - radius) for x, y in (site.position for site in outer)]
    assert away == pytest.approx([radius] * len(outer))
    assert {site.kind for site in outer} == {GROUPS["external_markers"]}


def test_a_half_is_held_at_its_plane_of_symmetry_and_meshed_by_its_part():
    half = dataclasses.replace(SENSOR, part="half")
    assert SENSOR.supports(2) == {"window": ("x", "y")}
    assert half.supports(3) == {"window": ("x", "y", "z"), "symmetry": ("z",)}
    assert (SENSOR.default_mesh.element, half.default_mesh.element) == ("Q4", "T4")
    assert not {"materials", "depth", "formulation"} & SENSOR.shape.keys()


HEXAGONAL = PRESETS.changed({"preset": "tactip-smooth-2d", "markers": {"layout": "hexagonal", "spacing": "2 mm"}})
SMOOTH = PRESETS.read("tactip-smooth-2d")


@pytest.mark.parametrize(
    ("sensor", "path", "use", "reason"),
    [
        (SENSOR, "depth", ModelUse(3), "of 2D sections only"),
        (SENSOR, "dome.radius", ModelUse(2, meshed=False), "the mesh comes from a file"),
        (SMOOTH, "skin.ridges.pitch", ModelUse(2), "switched off"),
        (SMOOTH, "skin.ridges.enabled", ModelUse(2), ""),
        (SENSOR, "markers.layers", ModelUse(2), "of the hexagonal layout only"),
        (SENSOR, "markers.rings", ModelUse(2), ""),
        (SENSOR, "skin.ridges.pitch", ModelUse(2), ""),
        (HEXAGONAL, "markers.rings", ModelUse(2), "of rings only"),
    ],
)
def test_reasons(sensor, path, use, reason):
    assert sensor.unused_reason(path, use) == reason


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
