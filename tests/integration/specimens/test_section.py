"""The mesh of a section: names, areas, sizes, quality, and the same mesh every time."""

from __future__ import annotations

import functools

import numpy as np
import pytest
import skfem

from fingerslip.mesh.quality import quality_table
from fingerslip.specimens.fingertip import at_depth, interface_depth, outline_curve, phalanx_contour, preset
from fingerslip.specimens.fingertip.meshing.sources import build_section
from unit.fingers import SECTIONS, VARIANTS, change, shoelace

ELEMENTS = ("Q4", "T3", "T6")
CORNERS = {"Q4": skfem.MeshQuad1, "T3": skfem.MeshTri1, "T6": skfem.MeshTri2}


def areas(mesh):
    """Area of every cell by the shoelace formula on its corners."""
    x, y = mesh.p[:, mesh.t]
    return np.abs(0.5 * np.sum(x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0), axis=0))


@functools.cache
def built(element):
    return build_section(preset("wang2014-2d"), element=element)


@pytest.fixture(scope="module")
def finger():
    return built("Q4")


def test_default_mesh_has_the_intended_size(finger):
    assert type(finger) is skfem.MeshQuad1
    assert 7000 < finger.p.shape[1] < 7800
    assert 120 < len(finger.boundaries["pad"]) + 1 < 160


def test_names_of_regions_and_boundaries(finger):
    assert list(finger.subdomains) == ["epidermis", "dermis", "tissue", "phalanx"]
    assert set(finger.boundaries) == {
        "skin", "pad", "base", "phalanx_base", "epidermis_dermis", "dermis_tissue", "phalanx_surface",
        "phalanx_palmar", "phalanx_dorsal"
    }  # fmt: skip
    across = build_section(change(section="transverse"))
    assert not {"base", "phalanx_base"} & set(across.boundaries)


def test_regions_share_out_all_cells(finger):
    cells = np.concatenate(list(finger.subdomains.values()))
    assert np.array_equal(np.sort(cells), np.arange(finger.t.shape[1]))


def test_skin_and_base_are_the_whole_outside(finger):
    outside = np.concatenate([finger.boundaries["skin"], finger.boundaries["base"]])
    assert np.array_equal(np.sort(outside), np.sort(finger.boundary_facets()))


@pytest.mark.parametrize("element", ELEMENTS)
def test_interfaces_are_shared_by_the_cells_of_both_sides(element):
    mesh = built(element)
    assert type(mesh) is CORNERS[element]
    region = np.empty(mesh.t.shape[1], dtype=int)
    for number, cells in enumerate(mesh.subdomains.values()):
        region[cells] = number
    for name, pair in (("epidermis_dermis", (0, 1)), ("dermis_tissue", (1, 2)), ("phalanx_surface", (2, 3))):
        sides = np.sort(region[mesh.f2t[:, mesh.boundaries[name]]], axis=0)
        assert np.array_equal(np.unique(sides, axis=1).ravel(), pair)
    assert len(np.unique(mesh.p.round(10), axis=1).T) == mesh.p.shape[1]


# Every section and every variant of the phalanx is in a fast case.
FAST = (("sagittal", "original"), ("transverse", "flattened"), ("sagittal", "scaled"))


@pytest.mark.parametrize(
    ("section", "variant"),
    [
        pytest.param(section, variant, marks=[pytest.mark.slow] * ((section, variant) not in FAST))
        for variant in VARIANTS
        for section in SECTIONS
    ],
)
def test_areas_of_the_regions_are_those_of_the_curves(section, variant):
    fingertip = change(section=section, phalanx={"variant": variant})
    mesh = build_section(fingertip, contact_size=0.1e-3, bulk_size=0.25e-3)
    curve = outline_curve(fingertip)

    def inside(depth):
        points = at_depth(curve, curve.arc_length, depth)
        if section == "transverse":
            return shoelace(points[:-1])
        kept = points[points[:, 0] >= -16e-3]
        return shoelace(kept)

    phalanx = shoelace(phalanx_contour(fingertip))
    levels = [inside(0.0), inside(interface_depth(fingertip, curve.arc_length)), inside(1.5e-3), phalanx, 0.0]
    expected = [-np.diff(levels)[k] for k in range(4)]
    measured = [areas(mesh)[cells].sum() for cells in mesh.subdomains.values()]
    assert measured == pytest.approx(expected, rel=0.01)
    assert areas(mesh).sum() == pytest.approx(levels[0], rel=5e-4)


@pytest.mark.parametrize("section", [pytest.param("sagittal", marks=pytest.mark.slow), "transverse"])
def test_ridges_do_not_change_the_mean_thickness_of_the_epidermis(section):
    with_ridges, without = (
        build_section(change(section=section, ridges={"enabled": enabled}), contact_size=0.1175e-3)
        for enabled in (True, False)
    )
    thickness = [areas(m)[m.subdomains["epidermis"]].sum() for m in (with_ridges, without)]
    assert thickness[0] == pytest.approx(thickness[1], rel=5e-3)


def test_every_ridge_tip_is_a_node(finger):
    fingertip = preset("wang2014-2d")
    s = np.arange(-20, 11) * 0.235e-3
    tips = at_depth(outline_curve(fingertip), s, interface_depth(fingertip, s))
    nodes = finger.p[:, np.unique(finger.facets[:, finger.boundaries["epidermis_dermis"]])].T
    nearest = np.linalg.norm(tips[:, None] - nodes[None], axis=2).min(axis=1)
    assert nearest.max() < 1e-8


def test_fingerprint_shapes_the_outer_surface():
    rippled = build_section(change(fingerprint={"enabled": True}))
    lowest = [m.p[1].min() for m in (built("Q4"), rippled)]
    assert lowest[0] - lowest[1] == pytest.approx(0.05e-3, abs=1e-9)


def test_boundaries_of_the_phalanx_face_down_and_up(finger):
    middle = finger.p[:, finger.facets].mean(axis=1)
    assert middle[1, finger.boundaries["phalanx_palmar"]].max() < 0.5e-3
    assert middle[1, finger.boundaries["phalanx_dorsal"]].min() > 2.5e-3
    assert np.all(finger.p[0, finger.facets[:, finger.boundaries["phalanx_base"]]] == pytest.approx(-16e-3))


def test_pad_is_the_low_part_of_the_skin(finger):
    height = finger.p[1, finger.facets[:, finger.boundaries["pad"]]]
    # 2 mm above the lowest point, at -7 mm: the default contact_reach.
    assert height.max() == pytest.approx(-5e-3, abs=0.1e-3)
    assert set(finger.boundaries["pad"]) < set(finger.boundaries["skin"])


def test_elements_grow_from_the_contact_into_the_bulk():
    mesh = build_section(preset("wang2014-2d"), contact_size=0.12e-3, bulk_size=0.5e-3)
    size = np.sqrt(areas(mesh))
    middle = mesh.p[:, mesh.t].mean(axis=1)
    contact = size[(middle[1] < -5.5e-3)]
    assert contact.max() < 0.16e-3
    assert size[mesh.subdomains["phalanx"]].max() > 3 * contact.max()
    assert size.max() < 0.7e-3


@pytest.mark.parametrize("element", ELEMENTS)
def test_same_input_gives_the_same_mesh_bit_by_bit(element):
    first, second = built(element), build_section(preset("wang2014-2d"), element=element)
    assert first.doflocs.tobytes() == second.doflocs.tobytes()
    assert first.t.tobytes() == second.t.tobytes()


@pytest.mark.parametrize(
    ("section", "variant"),
    [
        pytest.param(section, variant, marks=[pytest.mark.slow] * (variant != VARIANTS[number]))
        for number, section in enumerate(SECTIONS)
        for variant in VARIANTS
    ],
)
def test_all_variants_mesh_with_good_cells(section, variant):
    cases = [(c, e, True) for c in (0.08e-3, 0.15e-3) for e in ("Q4", "T3")] + [
        (0.6e-3, "Q4", False),
        (0.3e-3, "T6", False),
    ]
    for contact_size, element, detail in cases:
        fingertip = change(
            section=section, phalanx={"variant": variant}, ridges={"enabled": detail}, fingerprint={"enabled": detail}
        )
        mesh = build_section(fingertip, contact_size=contact_size, bulk_size=max(0.5e-3, contact_size), element=element)
        assert min(row.scaled_jacobian for row in quality_table(mesh)) > 0.3


def test_quadratic_triangles_have_their_middle_nodes_on_the_edges():
    mesh = built("T6")
    edges = mesh.facets
    middle = mesh.doflocs[:, mesh.dofs.facet_dofs[0]]
    assert middle == pytest.approx(mesh.p[:, edges].mean(axis=1), abs=1e-12)
