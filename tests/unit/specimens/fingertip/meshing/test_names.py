"""Names of a finger's mesh, on a strip of layers: skin below, phalanx above, cut at the left."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.specimens.fingertip.meshing.names import DERMIS, EPIDERMIS, NAIL, PHALANX, TISSUE, with_names


def strip(dim: int) -> tuple[skfem.Mesh, np.ndarray, np.ndarray]:
    """Return four layers of one cell each, their regions, and which nodes of the lowest row are fine."""
    grid = [np.linspace(0.0, 1.0, 4)] * (dim - 1)
    kind = skfem.MeshQuad1 if dim == 2 else skfem.MeshTet1
    mesh = kind.init_tensor(*grid, np.linspace(0.0, 4.0, 5))
    # In 3D the layers lie above each other along y, as in a finger.
    points = mesh.p if dim == 2 else mesh.p[[0, 2, 1]]
    order = np.argsort(points[1] > 0.0, kind="stable")
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    mesh = kind(np.ascontiguousarray(points[:, order]), np.ascontiguousarray(number[mesh.t]))
    height = mesh.p[1, mesh.t].mean(axis=0)
    region = np.select([height < 1, height < 2, height < 3], [EPIDERMIS, DERMIS, TISSUE], PHALANX)
    lowest = mesh.p[:, : np.count_nonzero(mesh.p[1] == 0.0)]
    return mesh, region, lowest[0] < 0.4


@pytest.mark.parametrize("dim", [2, 3])
def test_regions_and_interfaces_are_named(dim: int) -> None:
    mesh, region, fine = strip(dim)
    named = with_names(mesh, region, fine)
    assert list(named.subdomains) == ["epidermis", "dermis", "tissue", "phalanx"]
    for name, height in (("epidermis_dermis", 1.0), ("dermis_tissue", 2.0), ("phalanx_surface", 3.0)):
        assert np.all(named.p[1, named.facets[:, named.boundaries[name]]] == height)


@pytest.mark.parametrize("dim", [2, 3])
def test_skin_comes_first_and_the_rest_of_the_outside_is_the_cut(dim: int) -> None:
    mesh, region, fine = strip(dim)
    named = with_names(mesh, region, fine)
    assert np.all(named.p[1, named.facets[:, named.boundaries["skin"]]] == 0.0)
    outside = np.concatenate([named.boundaries["skin"], named.boundaries["base"]])
    np.testing.assert_array_equal(np.sort(outside), np.sort(mesh.boundary_facets()))
    assert set(named.boundaries["pad"]) < set(named.boundaries["skin"])
    assert np.all(named.p[0, named.facets[:, named.boundaries["pad"]]] < 0.4)
    assert np.all(named.p[1, named.facets[:, named.boundaries["phalanx_base"]]] >= 3.0)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_phalanx_above_the_tissue_faces_down_on_it(dim: int) -> None:
    mesh, region, fine = strip(dim)
    named = with_names(mesh, region, fine)
    np.testing.assert_array_equal(named.boundaries["phalanx_palmar"], named.boundaries["phalanx_surface"])
    assert "phalanx_dorsal" not in named.boundaries
    upside_down = with_names(mesh, np.array([PHALANX, TISSUE, DERMIS, EPIDERMIS])[region], fine)
    np.testing.assert_array_equal(upside_down.boundaries["phalanx_dorsal"], upside_down.boundaries["phalanx_surface"])


def test_a_nail_is_a_region_with_its_part_of_the_skin() -> None:
    mesh, region, fine = strip(2)
    nailed = with_names(mesh, np.where(region == EPIDERMIS, NAIL, region), fine)
    assert set(nailed.subdomains) == {"dermis", "tissue", "phalanx", "nail"}
    np.testing.assert_array_equal(nailed.boundaries["nail"], nailed.boundaries["skin"])
