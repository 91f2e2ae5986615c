"""Facets and nodes: cells that fold over each other are refused, bodies are joined, nodes stand for sites."""

import dataclasses
import re

import numpy as np
import pytest
import skfem
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import fingerslip as fs
from fingerslip.errors import InputError, MeshError
from fingerslip.fe.space import build_space
from fingerslip.mesh.facets import site_nodes
from fingerslip.mesh.joining import join_meshes
from fingerslip.mesh.quality import check_folds, turned_cells
from fingerslip.parameters import from_mapping
from fingerslip.sites import Site
from fingerslip.verification.meshes import box, dimension, jiggle
from problems.blocks import EVERY_ELEMENT, distorted
from problems.held import held
from problems.pushed import curved, push_and_slide

GRID = np.linspace(0.0, 1.0, 4)


def check(mesh):
    check_folds(mesh, turned_cells(mesh))


def grid(element, **options):
    return box(element, *[GRID] * dimension(element), **options)


def refused(mesh, *refusals, match="fold over each other"):
    for refuse in refusals or (check,):
        with pytest.raises(MeshError, match=match):
            refuse(mesh)


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_every_neighbour_of_a_cell_that_is_turned_is_told(element):
    """Where the others pass, in meshes that are distorted, sheared and mirrored."""
    cell, dim = 7, dimension(element)
    shear, mirror = np.eye(dim) + 0.3 * np.eye(dim, k=1), np.diag([-1.0, *np.ones(dim - 1)])
    images = (grid(element, shift=lambda points, of=of: of @ points) for of in (shear, mirror))
    for mesh in (distorted(element), *images):
        turned = turned_cells(mesh)
        check_folds(mesh, turned)
        turned[cell] = not turned[cell]
        neighbours = np.count_nonzero(mesh.f2t[1, mesh.t2f[:, cell]] >= 0)
        with pytest.raises(MeshError, match="fold over each other") as caught:
            check_folds(mesh, turned)
        fault = caught.value.found
        assert len(re.findall(rf"\b{cell} and \d|\d and {cell} at", fault)) == min(neighbours, 3)
        assert (f"({neighbours} pairs in all)" in fault) == (neighbours > 3)


def test_the_message_has_cells_places_and_what_to_do():
    cells = np.array([[0, 1, 2], [1, 2, 3]]).T
    points = np.array([[0.0, 2.0, 0.0, 2.0], [0.0, 0.0, 2.0, 2.0]]) * 1e-3
    check(skfem.MeshTri1(points, cells))
    folded = skfem.MeshTri1(np.where(np.arange(4) == 3, 0.1e-3, points), cells)
    with pytest.raises(MeshError) as caught:
        check_folds(folded, turned_cells(folded), "pad.msh")
    assert str(caught.value) == (
        "pad.msh: has cells that fold over each other: 0 and 1 at x = 1 mm, y = 1 mm, needs at most one cell on either "
        "side of an edge; move their nodes back, take out a cell that is there twice, or mesh the body again"
    )


@pytest.mark.parametrize("element", ["Q4", "H8"])
def test_cells_that_all_turn_the_same_way_may_still_be_folded(element):
    """A square, or a cube, and one that is laid back over it from its right side."""
    points = np.array([[0.0, 1.0, 1.0, 0.0, 0.3, 0.3], [0.0, 0.0, 1.0, 1.0, 0.2, 0.8]])
    low = np.array([[0, 1, 2, 3], [1, 2, 5, 4]]).T
    mesh, high = skfem.MeshQuad1(points, low), low + 6
    if element == "H8":
        solid = np.hstack([np.vstack([points, np.full(6, height)]) for height in (0.0, 1.0)])
        order = np.array([high[2], low[2], high[1], high[3], low[1], low[3], high[0], low[0]])
        mesh = skfem.MeshHex1(solid, order)
    assert len(set(turned_cells(mesh).tolist())) == 1
    refused(mesh, build_space, match=r"0 and 1 at x = 1000 mm, y = 500 mm")


@pytest.mark.parametrize("element", ["T3", "T4"])
def test_three_cells_at_a_facet_and_a_cell_that_is_there_twice_are_refused(element):
    mesh = grid(element)
    twice = type(mesh)(mesh.p, np.hstack([mesh.t, mesh.t[:, 4:5]]))
    refused(twice, match=rf"4 and {mesh.nelements} at")
    facet = np.flatnonzero(mesh.f2t[1] >= 0)[0]
    apex = mesh.p[:, mesh.facets[:, facet]].mean(axis=1) + 0.01 * np.arange(1, mesh.dim() + 1)
    corners = np.append(mesh.facets[:, facet], mesh.nvertices)
    third = type(mesh)(np.column_stack([mesh.p, apex]), np.column_stack([mesh.t, corners]))
    refused(third, match=rf"and {mesh.nelements} at")


@pytest.mark.parametrize("element", ["Q4", "T3", "H8", "T4"])
def test_bodies_may_lie_over_each_other_where_each_has_its_own_nodes(element):
    """As both sides of a crack do once it is closed, and bodies that touch."""
    mesh = distorted(element)
    check(join_meshes({"left": mesh, "right": mesh}))
    refused(type(mesh)(mesh.p, np.hstack([mesh.t, mesh.t])))


def test_curved_cells_count_as_their_mapping_turns():
    """The lower edge of the first cell bulges by more than its third corner lies below the ends of that edge."""
    corners = np.array([[0.0, 2.0, 1.0, 1.0], [0.0, 0.0, -0.05, -3.0]])
    mesh = skfem.MeshTri2.from_mesh(skfem.MeshTri1(corners, np.array([[0, 1, 2], [0, 1, 3]]).T))
    points = mesh.doflocs.copy()
    for facet, middle in (([0, 1], (1.0, -1.0)), ([0, 2], (0.45, -0.2)), ([1, 2], (1.55, -0.2))):
        points[:, mesh.nvertices + mesh.facets.T.tolist().index(facet)] = middle
    curved = skfem.MeshTri2(points, mesh.t)
    build_space(curved)
    refused(curved)


def areas(points, cells):
    """Return the areas or volumes of simplices in the order of their corners, times two or six."""
    corners = points[:, cells].transpose(2, 1, 0)
    return np.linalg.det(corners[:, 1:] - corners[:, :1])


@pytest.mark.parametrize("element", ["T3", "T4"])
@given(data=st.data())
def test_what_is_refused_are_areas_that_change_their_sign(element, data):
    """In a mesh whose cells were all of positive area in the order of their corners, inner nodes moved at random."""
    before = grid(element, shift=jiggle(0.1))
    cells = before.t.copy()
    turned = areas(before.p, cells) < 0.0
    cells[:2, turned] = cells[1::-1, turned]
    assert areas(before.p, cells).min() > 0.0
    inner = ((before.p > 0.0) & (before.p < 1.0)).all(axis=0)
    points = before.p.copy()
    points[:, inner] += data.draw(arrays(float, points[:, inner].shape, elements=st.floats(-0.25, 0.25)))
    after = areas(points, cells)
    assume(np.abs(after).min() > 1e-9)
    mesh = type(before)(points, cells)
    if after.min() > 0.0:
        check(mesh)
        build_space(mesh)
    else:
        refused(mesh, check, build_space)


def body(element, start):
    """Return a block that begins at `start` along x, in 2D with a curved lower side."""
    dim = dimension(element)
    axes = np.linspace(start, start + 1.0, 3), *[np.linspace(0.0, 1.0, 3)] * (dim - 1)
    return box(element, *axes, shift=curved(4.0) if dim == 2 else None)


def in_order(points):
    return points[np.lexsort(points.T)]


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_bodies_keep_their_points_cells_and_names(element):
    parts = {"left": body(element, 0.0), "right": body(element, 1.0)}
    joined = fs.join_meshes(parts)
    assert type(joined) is type(parts["left"])
    spaces = [build_space(mesh) for mesh in (*parts.values(), joined)]
    apart = np.vstack([own.positions for own in spaces[:2]])
    assert len(spaces[2].positions) == len(apart), "nodes that touch stay two"
    np.testing.assert_array_equal(in_order(spaces[2].positions), in_order(apart))
    for name, mesh in parts.items():
        for own, facets in mesh.boundaries.items():
            of_part = mesh.p[:, mesh.facets[:, np.asarray(facets)]]
            found = np.asarray(joined.boundaries[f"{name}_{own}"])
            np.testing.assert_array_equal(joined.p[:, joined.facets[:, found]], of_part)
        cells = joined.subdomains[f"{name}_bulk"]
        np.testing.assert_array_equal(joined.p[:, joined.t[:, cells]], mesh.p[:, mesh.t])
    assert len(joined.boundaries) == 2 * len(parts["left"].boundaries)


def test_sides_of_inner_boundaries_are_kept():
    mesh = body("Q4", 0.0)
    inner = mesh.facets_satisfying(lambda x: np.abs(x[0] - 0.5) < 1e-9)
    mesh = mesh.with_boundaries({"cut": skfem.generic_utils.OrientedBoundary(inner, np.ones(inner.size, dtype=int))})
    joined = fs.join_meshes({"a": mesh, "b": mesh})
    assert joined.boundaries["b_cut"].ori.tolist() == [1, 1]


def test_a_body_in_a_joined_mesh_moves_as_by_itself():
    """The other one is held, and far away."""
    alone = push_and_slide(programme=(fs.Press(0.4e-3, 8e-3), fs.Slide(0.4e-3, 8e-3)))
    joined = dataclasses.replace(
        alone,
        mesh=fs.join_meshes({"pad": alone.mesh, "other": body("Q4", 1.0)}),
        materials=dict.fromkeys(("pad_bulk", "other_bulk"), alone.materials["bulk"]),
        supports={"pad_top": ("x", "y"), "other_bulk": ("x", "y")},
        contacts=(fs.Contact("pad_bottom", friction=fs.Coulomb(0.4)),),
    )
    expected, history = fs.simulate(alone), fs.simulate(joined)
    scale = 1e-9 * np.abs(expected.counterface_force.values).max()
    np.testing.assert_allclose(history.counterface_force.values, expected.counterface_force.values, atol=scale)
    np.testing.assert_allclose(history.support_force.values[:, :1], expected.support_force.values, atol=scale)


def test_a_body_of_two_that_nothing_holds_is_named():
    alone = {"contacts": (), "bodies": {}, "supports": {"left_left": ("x", "y")}, "support_motions": {}}
    with pytest.raises(InputError, match=r"supports: leave translation along x.*of the piece around x = 10 mm, y = 0"):
        fs.simulate(held(time=fs.QuasiStatic(1e-3, end=0.1), **alone))


ALIKE = {"a": body("Q4", 0.0).with_subdomains({"b_bulk": np.array([0])}), "a_b": body("Q4", 0.0)}


@pytest.mark.parametrize(
    ("meshes", "message"),
    [
        ({}, r"meshes: got none"),
        ({"a": body("Q4", 0.0), "b": body("T3", 0.0)}, r"got a: MeshQuad1, b: MeshTri1, needs cells of one kind"),
        (ALIKE, r"two subdomains become 'a_b_bulk', needs names that stay apart; rename a body"),
    ],
)
def test_meshes_that_cannot_be_joined_are_refused(meshes, message):
    with pytest.raises(InputError, match=message):
        fs.join_meshes(meshes)


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
    site = from_mapping(Site, {"name": "mine", "kind": "probe", "position": ["0 mm", "3.9 mm"]}, "x")
    assert MESH.p[:, site_nodes(MESH, [site])[0]] == pytest.approx([0.0, 4e-3]), "by coordinates from a file"
    assert site_nodes(MESH, []).shape == (0,)


FAR = "site far: x = 0 mm, y = -1.5 mm is 1.5 mm from the nearest node of the mesh, needs <= 0.5 mm"


@pytest.mark.parametrize(
    ("site", "message"),
    [
        (Site("far", "probe", (0.0, -1.5e-3)), FAR),
        (Site("deep", "probe", (0.0, 2e-3), "epidermis"), "is 1 mm from the nearest node of 'epidermis', needs <="),
        (Site("FA-II-01", "FA-II", (0.0, -3e-3), "tissue"), "thinner than receptors.fa_ii_depth .* or leave FA-II out"),
        (Site("nail", "probe", (0.0, 0.0), "nail"), "region 'nail' is not in the mesh, it has: epidermis, tissue"),
        (Site("flat", "probe", (0.0, 0.0, 0.0)), "site flat: got 3 coordinates, needs 2"),
    ],
)
def test_sites_outside_are_refused(site, message):
    with pytest.raises(InputError, match=message):
        site_nodes(MESH, [site])
