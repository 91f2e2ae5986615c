"""Scans become layered meshes: names, volumes, depths, distances from the scan."""

import contextlib
import dataclasses
from typing import Any

import numpy as np
import pytest

from fingerslip.errors import MeshError
from fingerslip.mesh.scan.layered import LayerSizes, build_from_surfaces
from places import ROOT, run_page
from unit.ellipsoids import ellipsoid, together
from unit.scans import SCAN


@pytest.fixture(scope="module")
def example() -> dict[str, Any]:
    """What the example of the page leaves, run as it is printed."""
    before = set(ROOT.iterdir())
    with contextlib.chdir(ROOT):
        names = run_page(ROOT / "docs" / "surfaces.md")
    names["left_behind"] = set(ROOT.iterdir()) - before
    return names


@pytest.mark.slow
def test_the_example_repairs_and_meshes_a_scan_that_slips(example):
    """Off by the tolerance, and by the decimation that goes before, at most; no files are left behind."""
    scan, layers, events = example["scan"], SCAN.layers, example["events"]
    skin, phalanx = scan.repairs.values()
    assert len(skin.closed_holes) == len(skin.open_holes) == len(phalanx.open_holes) == 1
    assert (skin.turned_triangles > 50, phalanx.turned_triangles) == (True, 0)
    assert [deviation.boundary for deviation in scan.deviations] == ["skin", "phalanx_surface"]
    for found in scan.deviations:
        assert 0 < found.mean < 0.5 * layers.tolerance
        assert found.largest < 2 * layers.tolerance
    least, mean, largest = scan.thickness
    assert mean == pytest.approx(1e-3, rel=0.03)
    assert 1e-3 - 2 * layers.tolerance < least < largest < 1e-3 + 2 * layers.tolerance
    assert [layer.region for layer in scan.layers] == ["skin", "tissue", "phalanx"]
    assert min(layer.least_radius_ratio for layer in scan.layers) > 0.02
    assert min(layer.mean_radius_ratio for layer in scan.layers) > 0.6
    assert max(layer.longest_edge for layer in scan.layers) < 2 * layers.bulk_size
    # The slide begins at 0.2 s; the edge lets go first, the whole pad before the end.
    assert 0.2 < events.incipient < events.three_quarter < events.overall < 1.0
    assert not example["left_behind"]


SKIN = ellipsoid(points=250, name="skin.stl")
PHALANX = ellipsoid((7e-3, 3e-3, 3e-3), points=120, name="phalanx.stl")
SIZES = LayerSizes(1.2e-3, contact_size=2e-3, bulk_size=4e-3, contact_reach=3e-3, tolerance=0.2e-3, cut=14e-3)
COARSE = dataclasses.replace(SIZES, contact_size=4e-3, bulk_size=6e-3, tolerance=0.3e-3)
CUT = 12e-3 - 14e-3


def cap(half_axes: tuple[float, float, float]) -> float:
    """Volume of an ellipsoid distal of the cut [m^3]."""
    a, b, c = half_axes
    return np.pi * b * c * (a * (1 - 1 / 3) - CUT + CUT**3 / (3 * a**2))


@pytest.fixture(scope="module")
def mesh():
    return build_from_surfaces(SKIN, PHALANX, COARSE)


def volumes(mesh) -> dict[str, float]:
    corners = mesh.p[:, mesh.t].transpose(2, 1, 0)
    a, b, c = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 0)
    size = np.abs(np.sum(np.cross(a, b) * c, axis=1)) / 6
    return {name: size[cells].sum() for name, cells in mesh.subdomains.items()}


def facet_areas(mesh, name: str) -> np.ndarray:
    a, b, c = np.moveaxis(mesh.p[:, mesh.facets[:, mesh.boundaries[name]]].transpose(2, 1, 0), 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


@pytest.mark.slow
def test_layers_have_the_volumes_of_the_shapes_and_share_out_the_cells(mesh):
    found = volumes(mesh)
    whole, phalanx = cap((12e-3, 8e-3, 7e-3)), cap((7e-3, 3e-3, 3e-3))
    assert sum(found.values()) == pytest.approx(whole, rel=0.05)
    assert found["phalanx"] == pytest.approx(phalanx, rel=0.15)
    # To first order the skin is its thickness times the area of the scan distal of the cut.
    distal = SKIN.areas[SKIN.corners[:, :, 0].mean(axis=1) > CUT].sum()
    assert 0.75 < found["skin"] / (distal * SIZES.skin_thickness) < 1.0
    assert set(found) == {"skin", "tissue", "phalanx"}
    assert sorted(np.concatenate(list(mesh.subdomains.values()))) == list(range(mesh.t.shape[1]))


@pytest.mark.slow
def test_outside_is_skin_on_the_scan_and_interfaces_lie_between_their_regions(mesh):
    outside = np.concatenate([mesh.boundaries["skin"], mesh.boundaries["base"]])
    assert sorted(outside) == sorted(mesh.boundary_facets())
    assert np.abs(mesh.p[0, mesh.facets[:, mesh.boundaries["base"]]] - CUT).max() <= 2 * SIZES.tolerance
    assert facet_areas(mesh, "base").sum() == pytest.approx(np.pi * 56e-6 * (1 - (CUT / 12e-3) ** 2), rel=0.05)
    x = mesh.p[:, np.unique(mesh.facets[:, mesh.boundaries["skin"]])] / np.array([[12e-3], [8e-3], [7e-3]])
    # The radius of the scaled shape is off by less than the tolerance and the chords of a coarse scan together.
    assert np.abs(np.linalg.norm(x, axis=0) - 1).max() < 0.06
    assert set(mesh.boundaries["pad"]) < set(mesh.boundaries["skin"])
    bottom = mesh.p[1].min()
    assert mesh.p[1, mesh.facets[:, mesh.boundaries["pad"]]].max() <= bottom + SIZES.contact_reach
    assert bottom == pytest.approx(-8e-3, abs=0.3e-3)
    region = np.zeros(mesh.t.shape[1], dtype=int)
    for number, name in enumerate(("skin", "tissue", "phalanx")):
        region[mesh.subdomains[name]] = number
    for name, pair in {"skin_tissue": {0, 1}, "phalanx_surface": {1, 2}}.items():
        sides = region[mesh.f2t[:, mesh.boundaries[name]]]
        assert {frozenset(side) for side in sides.T.tolist()} == {frozenset(pair)}
    depth = 1 - np.linalg.norm(mesh.p[:, mesh.facets[:, mesh.boundaries["skin_tissue"]]].mean(axis=1).T, axis=1)
    assert depth.min() > 0


@pytest.mark.slow
def test_pad_is_finer_than_the_rest():
    sizes = dataclasses.replace(SIZES, contact_size=0.7e-3, tolerance=0.1e-3)
    mesh = build_from_surfaces(SKIN, None, sizes)
    above = mesh.boundaries["skin"][mesh.p[1, mesh.facets[:, mesh.boundaries["skin"]]].min(axis=0) > 3e-3]
    top = mesh.with_boundaries({"top": above})
    assert facet_areas(mesh, "pad").mean() < 0.5 * facet_areas(top, "top").mean()


@pytest.mark.slow
def test_phalanx_as_a_hole():
    mesh = build_from_surfaces(SKIN, PHALANX, dataclasses.replace(COARSE, phalanx="hole"))
    assert set(mesh.subdomains) == {"skin", "tissue"}
    named = [mesh.boundaries[name] for name in ("skin", "base", "phalanx_surface")]
    assert sorted(np.concatenate(named)) == sorted(mesh.boundary_facets())
    on_phalanx = mesh.p[:, np.unique(mesh.facets[:, mesh.boundaries["phalanx_surface"]])].T / [7e-3, 3e-3, 3e-3]
    assert np.abs(np.linalg.norm(on_phalanx, axis=1) - 1).mean() < 0.1


@pytest.mark.slow
def test_surface_that_crosses_itself_is_its_union():
    bump = ellipsoid((3e-3, 3e-3, 3e-3), (0.0, -7e-3, 0.0), 200)
    meshes = (
        build_from_surfaces(skin, None, dataclasses.replace(SIZES, cut=None)) for skin in (SKIN, together(SKIN, bump))
    )
    plain, bumpy = (sum(volumes(mesh).values()) for mesh in meshes)
    ball = np.random.default_rng(1).uniform(-3e-3, 3e-3, (200_000, 3))
    ball = ball[np.linalg.norm(ball, axis=1) < 3e-3] + [0.0, -7e-3, 0.0]
    outside = np.mean(np.linalg.norm(ball / [12e-3, 8e-3, 7e-3], axis=1) > 1)
    assert (bumpy - plain) / bump.volume == pytest.approx(outside, rel=0.15)


@pytest.mark.slow
def test_empty_contact_patch():
    with pytest.raises(MeshError, match=r"pad: no facet of the skin lies within 0.0001 mm.*larger contact_reach"):
        build_from_surfaces(SKIN, None, dataclasses.replace(COARSE, contact_reach=0.1e-6))
