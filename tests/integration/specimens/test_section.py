"""The mesh of a section: names, areas, sizes, quality, and the same mesh every time."""

import functools
import itertools

import numpy as np
import pytest
import skfem

from fingerslip.mesh.quality import quality_table
from fingerslip.specimens.fingertip.fingertip import build_section, preset
from fingerslip.specimens.fingertip.outline import at_depth, interface_depth, outline_curve
from fingerslip.specimens.fingertip.phalanx import phalanx_contour
from integration.conftest import cases
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


def test_default_mesh_has_the_intended_size_and_names():
    finger, across = built("Q4"), build_section(change(section="transverse"))
    assert type(finger) is skfem.MeshQuad1
    assert 7000 < finger.p.shape[1] < 7800
    assert 120 < len(finger.boundaries["pad"]) + 1 < 160
    assert set(finger.boundaries) == {
        "skin", "pad", "base", "phalanx_base", "epidermis_dermis", "dermis_tissue", "phalanx_surface",
        "phalanx_palmar", "phalanx_dorsal"
    }  # fmt: skip
    assert not {"base", "phalanx_base"} & set(across.boundaries)
    cells = np.concatenate(list(finger.subdomains.values()))
    assert np.array_equal(np.sort(cells), np.arange(finger.t.shape[1]))


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
    if element == "T6":
        middle = mesh.doflocs[:, mesh.dofs.facet_dofs[0]]
        assert middle == pytest.approx(mesh.p[:, mesh.facets].mean(axis=1), abs=1e-12)


# Every section and every variant of the phalanx is in a fast case.
PAIRS = list(itertools.product(SECTIONS, VARIANTS))
FAST = (("sagittal", "original"), ("transverse", "flattened"), ("sagittal", "scaled"))


@pytest.mark.parametrize(("section", "variant"), cases(PAIRS, FAST))
def test_areas_of_the_regions_are_those_of_the_curves(section, variant):
    fingertip = change(section=section, phalanx={"variant": variant})
    mesh = build_section(fingertip, contact_size=0.1e-3, bulk_size=0.25e-3)
    curve = outline_curve(fingertip)

    def inside(depth):
        points = at_depth(curve, curve.arc_length, depth)
        return shoelace(points[:-1] if section == "transverse" else points[points[:, 0] >= -16e-3])

    phalanx = shoelace(phalanx_contour(fingertip))
    levels = [inside(0.0), inside(interface_depth(fingertip, curve.arc_length)), inside(1.5e-3), phalanx, 0.0]
    measured = [areas(mesh)[cells].sum() for cells in mesh.subdomains.values()]
    assert measured == pytest.approx(-np.diff(levels), rel=0.01)
    assert areas(mesh).sum() == pytest.approx(levels[0], rel=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("section", "variant"), cases(PAIRS, set(zip(SECTIONS, VARIANTS, strict=False))))
def test_all_variants_mesh_with_good_cells(section, variant):
    cases = [(c, e, True) for c in (0.08e-3, 0.15e-3) for e in ("Q4", "T3")]
    cases += [(0.6e-3, "Q4", False), (0.3e-3, "T6", False)]
    for contact_size, element, detail in cases:
        fingertip = change(
            section=section, phalanx={"variant": variant}, ridges={"enabled": detail}, fingerprint={"enabled": detail}
        )
        mesh = build_section(fingertip, contact_size=contact_size, bulk_size=max(0.5e-3, contact_size), element=element)
        assert min(row.scaled_jacobian for row in quality_table(mesh)) > 0.3
