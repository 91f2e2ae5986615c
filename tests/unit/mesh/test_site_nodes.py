"""Nodes that stand for sites, on a block of two layers."""

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.mesh.facets import site_nodes
from fingerslip.parameters import from_mapping
from fingerslip.sites import Site
from fingerslip.verification.meshes import box, jiggle

LAYERS = {"epidermis": lambda c: c[1] < 1e-3, "tissue": lambda c: c[1] > 1e-3}
MESH = box("Q4", np.linspace(-4e-3, 4e-3, 17), np.linspace(0.0, 4e-3, 9), regions=LAYERS)


def test_the_nearest_node_of_the_region_stands_for_a_site():
    """Between two nodes, one of either layer, the region decides."""
    at = (0.1e-3, 0.8e-3)
    inner, outer = site_nodes(MESH, [Site("a", "probe", at, "tissue"), Site("b", "probe", at, "epidermis")])
    assert MESH.p[:, inner] == pytest.approx([0.0, 1e-3])
    assert MESH.p[:, outer] == pytest.approx([0.0, 1e-3])
    (deeper,) = site_nodes(MESH, [Site("a", "probe", (0.1e-3, 0.6e-3), "tissue")])
    (nearest,) = site_nodes(MESH, [Site("a", "probe", (0.1e-3, 0.6e-3))])
    assert MESH.p[:, deeper] == pytest.approx([0.0, 1e-3])
    assert MESH.p[:, nearest] == pytest.approx([0.0, 0.5e-3])


@pytest.mark.parametrize("element", ["Q4", "T3", "T6", "T4"])
def test_every_vertex_stands_for_itself(element):
    grid = np.linspace(0.0, 1e-3, 5)
    mesh = box(element, *[grid] * (3 if element == "T4" else 2), shift=jiggle(0.2))
    vertices = np.arange(mesh.nvertices)
    sites = [Site(str(number), "probe", tuple(mesh.p[:, number])) for number in vertices]
    np.testing.assert_array_equal(site_nodes(mesh, sites), vertices)


def test_site_by_coordinates_from_a_file_and_no_sites():
    site = from_mapping(Site, {"name": "mine", "kind": "probe", "position": ["0 mm", "3.9 mm"]}, "x")
    (node,) = site_nodes(MESH, [site])
    assert MESH.p[:, node] == pytest.approx([0.0, 4e-3])
    assert site_nodes(MESH, []).shape == (0,)


@pytest.mark.parametrize(
    ("site", "message"),
    [
        (
            Site("far", "probe", (0.0, -1.5e-3)),
            "site far: x = 0 mm, y = -1.5 mm is 1.5 mm from the nearest node of the mesh, needs <= 0.5 mm",
        ),
        (Site("deep", "probe", (0.0, 2e-3), "epidermis"), "is 1 mm from the nearest node of 'epidermis', needs <="),
        (Site("FA-II-01", "FA-II", (0.0, -3e-3), "tissue"), "thinner than receptors.fa_ii_depth .* or leave FA-II out"),
        (Site("nail", "probe", (0.0, 0.0), "nail"), "region 'nail' is not in the mesh, it has: epidermis, tissue"),
        (Site("flat", "probe", (0.0, 0.0, 0.0)), "site flat: got 3 coordinates, needs 2"),
    ],
)
def test_sites_outside_are_refused(site, message):
    with pytest.raises(InputError, match=message):
        site_nodes(MESH, [site])
