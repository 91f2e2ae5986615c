"""Cells that fold over their neighbours are refused with their places, and facets face away from their cells."""

import re

import numpy as np
import pytest
import skfem
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fingerslip.errors import MeshError
from fingerslip.fe.space import build_space
from fingerslip.mesh.facets import are_between, outward_normals
from fingerslip.mesh.joining import join_meshes
from fingerslip.mesh.quality import check_folds, turned_cells
from fingerslip.verification.meshes import box, dimension, jiggle
from problems.blocks import EVERY_ELEMENT, distorted

GRID = np.linspace(0.0, 1.0, 4)


def check(mesh) -> None:
    check_folds(mesh, turned_cells(mesh))


def grid(element, **options):
    return box(element, *[GRID] * dimension(element), **options)


def refused(mesh, *refusals, match="fold over each other"):
    for refuse in refusals or (check,):
        with pytest.raises(MeshError, match=match):
            refuse(mesh)


def through_a_facet(points):
    """Return the points of a grid, the one nearest to its centre moved beyond its neighbours."""
    middle = np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=0).argmin()
    moved = points.copy()
    moved[:, middle] += 0.41 * (points.max(axis=1) - points.min(axis=1)) * np.linspace(1.0, 0.9, len(points))
    return moved


@pytest.mark.parametrize("element", ["T3", "T6", "T4", "T10"])
def test_a_node_that_is_moved_through_a_facet_is_refused(element):
    message = r"^mesh: has cells that fold over each other: \d+ and \d+ at x = .* mm"
    refused(grid(element, shift=through_a_facet), check, build_space, match=message)


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_every_neighbour_of_a_cell_that_is_turned_is_told(element):
    """Where the others pass, in meshes that are distorted, sheared and mirrored."""
    cell, dim = 7, dimension(element)
    shear, mirror = np.eye(dim) + 0.3 * np.eye(dim, k=1), np.diag([-1.0, *np.ones(dim - 1)])
    for mesh in (
        distorted(element),
        *(grid(element, shift=lambda points, of=of: of @ points) for of in (shear, mirror)),
    ):
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


@pytest.mark.parametrize("element", ["T3", "T4"])
def test_the_order_of_corners_says_nothing(element):
    mesh = distorted(element)
    orders = np.random.default_rng(0).permuted(mesh.t, axis=0)
    for is_sorted in (True, False):
        shuffled = type(mesh)(mesh.p, orders, sort_t=is_sorted)
        assert np.array_equal(shuffled.t, orders) != is_sorted
        check(shuffled)
        refused(type(mesh)(through_a_facet(mesh.p), orders, sort_t=is_sorted))


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


@pytest.mark.parametrize("element", ["Q4", "T3", "T6", "T4"])
def test_facets_between_regions_and_their_normals_are_those_of_the_interface(element):
    halves = {"low": lambda c: c[-1] < 0.5, "high": lambda c: c[-1] > 0.5}
    mesh = box(element, *[np.linspace(0.0, 1.0, 5)] * dimension(element), regions=halves)
    region = np.zeros(mesh.nelements, dtype=int)
    region[mesh.subdomains["high"]] = 1
    between = are_between(mesh, region, 0, 1)
    np.testing.assert_array_equal(between, are_between(mesh, region, 1, 0))
    np.testing.assert_array_equal(between, np.isclose(mesh.p[-1, mesh.facets], 0.5).all(axis=0))
    assert not are_between(mesh, region, 1, 2).any()
    facets = np.flatnonzero(between)
    first, second = mesh.f2t[:, facets]
    below = np.where(region[first] == 0, first, second)
    upwards = outward_normals(mesh, facets, below)
    np.testing.assert_allclose(upwards[-1], 1.0)
    np.testing.assert_allclose(outward_normals(mesh, facets, first + second - below), -upwards)


def test_normals_of_the_outside_close():
    """The integral of the outward normal over a closed surface is zero."""
    mesh = grid("T4")
    outside = mesh.boundary_facets()
    normals = outward_normals(mesh, outside, mesh.f2t[0, outside])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=0), 1.0)
    np.testing.assert_allclose(normals.sum(axis=1), 0.0, atol=1e-12)
    assert np.sum(normals * mesh.p[:, mesh.facets[:, outside]].mean(axis=1)) > 0.0
