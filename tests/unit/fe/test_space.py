"""The displacement space: nodes, areas, orientation, free edges and rigid motions."""

import meshio
import numpy as np
import pytest
import pyvista
import skfem

from fingerslip.errors import MeshError
from fingerslip.fe.space import (
    Space,
    boundary_nodes,
    build_space,
    cell_nodes,
    free_edge_distances,
    free_edge_nodes,
    free_pieces,
    nodal_areas,
    region_nodes,
    vector_dofs,
)
from fingerslip.verification.meshes import box, dimension
from problems.blocks import ELEMENTS, EVERY_ELEMENT, distorted


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_degrees_of_freedom_are_numbered_node_by_node(element):
    """As in scikit-fem's vector bases, with which loads and errors are integrated elsewhere."""
    space = build_space(distorted(element, 2))
    vector = skfem.Basis(space.mesh, skfem.ElementVector(space.scalar_element))
    assert space.element == element
    assert space.n_dofs == space.dim * len(space.positions) == vector.N
    dofs = vector_dofs(np.arange(len(space.positions)), space.dim)
    for axis in range(space.dim):
        np.testing.assert_array_equal(vector.doflocs[:, dofs[:, axis]].T, space.positions)


@pytest.mark.parametrize("element", ELEMENTS)
def test_vertices_come_before_the_middles_of_sides_and_the_centre_basis_has_one_point_at_the_centroid(element):
    """scikit-fem takes an integration order of zero for none given, and then integrates fully."""
    mesh = distorted(element)
    space, count = build_space(mesh), mesh.nvertices
    np.testing.assert_allclose(space.positions[:count], mesh.p.T[:count], atol=1e-15)
    middles = mesh.p[:, mesh.facets].mean(axis=1).T if element == "T6" else np.zeros((0, 2))
    np.testing.assert_allclose(space.positions[count:], middles, atol=1e-15)
    assert space.centre.X.shape == (2, 1)
    np.testing.assert_allclose(space.centre.X[:, 0], 0.5 if element == "Q4" else 1 / 3, rtol=1e-14)


@pytest.mark.parametrize("element", ELEMENTS)
def test_region_nodes_are_those_of_its_cells(element):
    halves = {"low": lambda c: c[1] < 0.5, "high": lambda c: c[1] > 0.5}
    grid = np.linspace(0.0, 1.0, 5)
    space = build_space(box(element, grid, grid, regions=halves))
    np.testing.assert_array_equal(region_nodes(space, "low"), np.flatnonzero(space.positions[:, 1] < 0.5 + 1e-12))


@pytest.mark.parametrize(
    ("element", "shares"), [("Q4", [1 / 2, 1 / 2]), ("T3", [1 / 2, 1 / 2]), ("T6", [1 / 6, 4 / 6, 1 / 6])]
)
def test_nodal_areas_of_one_facet_are_the_integrals_of_its_shape_functions(element, shares):
    space = build_space(box(element, [0.0, 2.0], [0.0, 1.0]))
    areas = nodal_areas(space, "bottom", depth=0.5)
    nodes = boundary_nodes(space, "bottom")
    nodes = nodes[np.argsort(space.positions[nodes, 0])]
    np.testing.assert_allclose(areas[nodes], np.array(shares) * 2.0 * 0.5, rtol=1e-14)
    assert not np.delete(areas, nodes).any()


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_nodal_areas_integrate_linear_functions_exactly(element):
    grid = np.linspace(0.0, 1.0, 4) ** 1.5
    space = build_space(box(element, *[grid] * dimension(element)))
    depth = 3.0 if space.dim == 2 else 1.0
    areas = nodal_areas(space, "right", depth)
    assert areas.sum() == pytest.approx(depth, rel=1e-12)
    assert areas @ space.positions[:, -1] == pytest.approx(0.5 * depth, rel=1e-12)


@pytest.mark.parametrize("element", ["Q4", "T6", "H8", "T10"])
@pytest.mark.parametrize("distance", [0.3, 100.0])
def test_nodal_areas_do_not_depend_on_where_the_mesh_is(element, distance):
    mesh = distorted(element)
    mesh = mesh.scaled(1e-3 / np.ptp(mesh.p))
    away = mesh.translated((distance,) * mesh.dim())
    areas, there = (nodal_areas(build_space(own), "top", 1.0) for own in (mesh, away))
    np.testing.assert_allclose(there, areas, atol=1e-15 * distance / 1e-3 * 10 * areas.max())


VTK = {"H8": "hexahedron", "T4": "tetra", "T10": "tetra10", "Q4": "quad", "T3": "triangle", "T6": "triangle6"}


@pytest.mark.parametrize(("element", "kind"), VTK.items())
def test_cells_in_the_order_of_vtk_fill_the_body(element: str, kind: str) -> None:
    space = build_space(box(element, *[np.linspace(0.0, 1.0, 4)] * dimension(element)))
    points = np.pad(space.positions, ((0, 0), (0, 3 - space.dim)))
    grid = pyvista.from_meshio(meshio.Mesh(points, [(kind, cell_nodes(space))]))
    sizes = grid.compute_cell_sizes(length=False)["Volume" if space.dim == 3 else "Area"]
    assert sizes.sum() == pytest.approx(1.0)
    assert (sizes > 0.0).all()


SIDES = np.linspace(0.0, 1.0, 5)


def space_of(element: str) -> Space:
    """Return the space of a unit block with a boundary ``bottom``."""
    return build_space(box(element, *[SIDES] * dimension(element)))


def free(space: Space) -> np.ndarray:
    return np.zeros((len(space.positions), space.dim), dtype=bool)


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_edge_of_a_side_is_its_rim(element: str) -> None:
    space = space_of(element)
    own = boundary_nodes(space, "bottom")
    found = free_edge_nodes(space, "bottom", free(space))
    across = space.positions[own][:, :-1]
    rim = own[((across < 1e-12) | (across > 1.0 - 1e-12)).any(axis=1)]
    assert found.tolist() == rim.tolist()
    distances = free_edge_distances(space, "bottom", free(space), own)
    expected = np.minimum(across, 1.0 - across).min(axis=1)
    np.testing.assert_allclose(distances, expected, atol=0.25 if space.dim == 3 else 1e-12)
    assert not distances[np.isin(own, rim)].any()


def test_edges_at_held_faces_are_no_free_edges_and_a_closed_boundary_has_none() -> None:
    """Components that are held at different nodes do not hold a face."""
    space = space_of("Q4")
    side, held, here_and_there = np.flatnonzero(space.positions[:, 0] < 1e-12), free(space), free(space)
    held[side] = True
    assert space.positions[free_edge_nodes(space, "bottom", held)].tolist() == [[1.0, 0.0]]
    here_and_there[side[::2], 0] = here_and_there[side[1::2], 1] = True
    assert 0.0 in space.positions[free_edge_nodes(space, "bottom", here_and_there)][:, 0]
    mesh = space.mesh
    closed = build_space(mesh.with_boundaries({"all": mesh.boundary_facets()}))
    assert free_edge_nodes(closed, "all", free(closed)).size == 0
    assert np.isinf(free_edge_distances(closed, "all", free(closed), np.arange(3))).all()
    space = space_of("T4")
    held = free(space)
    held[space.positions[:, 0] < 1e-12, 0] = True
    nodes = free_edge_nodes(space, "bottom", held)
    # The corners of the symmetric side belong to the free sides beside it.
    symmetric = space.positions[nodes][:, 0] < 1e-12
    assert sorted(space.positions[nodes][symmetric][:, 1]) == pytest.approx([0.0, 1.0])
    one = free(space)
    one[0] = True
    assert free_edge_nodes(space, "bottom", one).tolist() == free_edge_nodes(space, "bottom", free(space)).tolist()


GRID = np.linspace(0.0, 4e-3, 5)

X, Y, Z = (f"translation along {axis}" for axis in "xyz")

ABOUT_X, ABOUT_Y, ABOUT_Z = (f"rotation about {axis}" for axis in "xyz")


def pieces_of(element, supports):
    """Return the free pieces of a block whose boundaries are held in some components."""
    space = build_space(box(element, *[GRID] * dimension(element)))
    held = [np.zeros(0, dtype=np.int64)]
    for name, components in supports.items():
        dofs = vector_dofs(boundary_nodes(space, name), space.dim)
        held.append(dofs[:, ["xyz".index(component) for component in components]].ravel())
    return free_pieces(space, np.setdiff1d(np.arange(space.n_dofs), np.concatenate(held)))


IN_2D = (
    ({}, (X, Y, ABOUT_Z)),
    ({"left": "x"}, (Y,)),
    ({"left": "y"}, (X, ABOUT_Z)),
    ({"left": "y", "bottom": "y"}, (X,)),
    ({"left": "xy"}, ()),
    ({"left": "x", "bottom": "y"}, ()),
)
IN_3D = (
    ({}, (X, Y, Z, ABOUT_X, ABOUT_Y, ABOUT_Z)),
    ({"left": "x"}, (Y, Z, ABOUT_X)),
    ({"left": "x", "bottom": "z"}, (Y,)),
    ({"left": "xy"}, (Z,)),
    ({"left": "xyz"}, ()),
)


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_motions_that_supports_leave_free(element):
    for supports, motions in IN_2D if dimension(element) == 2 else IN_3D:
        assert [piece.motions for piece in pieces_of(element, supports)] == ([motions] if motions else []), supports


def test_pieces_that_hang_apart_are_judged_one_by_one_whatever_their_size_and_place():
    one = box("Q4", GRID, GRID)
    both = skfem.MeshQuad(np.hstack([one.p, one.p + 10e-3]), np.hstack([one.t, one.t + one.p.shape[1]]))
    space = build_space(both.with_subdomains({"both": np.arange(both.nelements)}))
    second, every = np.arange(one.p.shape[1], both.p.shape[1]), np.arange(space.n_dofs)
    held = vector_dofs(np.setdiff1d(np.arange(both.p.shape[1]), second), 2).ravel()
    (piece,) = free_pieces(space, np.setdiff1d(every, held))
    assert piece.nodes.tolist() == second.tolist()
    assert piece.motions == (X, Y, ABOUT_Z)
    for node in second[[0, len(second) // 2]]:
        (piece,) = free_pieces(space, np.setdiff1d(every, [*held, 2 * node, 2 * node + 1]))
        assert piece.motions == (ABOUT_Z,)
    for scale, shift in ((1e-6, 0.0), (1e3, 0.0), (1e-3, 10.0)):
        mesh = box("Q4", scale * GRID + shift, scale * GRID - shift)
        space = build_space(mesh)
        left = vector_dofs(boundary_nodes(space, "left"), 2)[:, 0]
        (piece,) = free_pieces(space, np.setdiff1d(np.arange(space.n_dofs), left))
        assert piece.motions == (Y,)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda _: build_space(skfem.MeshLine1()), "got a MeshLine1, needs one of MeshQuad1, MeshTri1, "),
        (lambda mesh: boundary_nodes(build_space(mesh), "pulp"), "boundary 'pulp' not in mesh, it has: bottom, left, "),
        (lambda mesh: nodal_areas(build_space(mesh), "pulp", 1.0), "boundary 'pulp' not in mesh, it has: bottom, left"),
        (lambda _: boundary_nodes(build_space(skfem.MeshQuad1()), "skin"), "it has: none"),
        (
            lambda mesh: boundary_nodes(build_space(mesh.with_boundaries({"bare": np.zeros(0, dtype=int)})), "bare"),
            "boundary 'bare' is empty",
        ),
        (lambda mesh: region_nodes(build_space(mesh), "nail"), "region 'nail' not in mesh, it has: bulk"),
    ],
)
def test_names_and_meshes_that_are_not_there(call, message):
    with pytest.raises(MeshError, match=message):
        call(distorted("Q4"))


def changed(element, number, position, grid=(0.0, 1.0)):
    """Return a mesh with a node at another position."""
    mesh = box(element, list(grid), [0.0, 1.0])
    points = mesh.p.copy()
    points[:, np.atleast_1d(number(points) if callable(number) else number)] = np.reshape(position, (2, 1))
    return type(mesh)(points, mesh.t)


def with_turned_cell():
    mesh = box("Q4", np.linspace(0, 1, 5), [0.0, 1.0])
    cells = mesh.t.copy()
    cells[:, 2] = cells[::-1, 2]
    return skfem.MeshQuad1(mesh.p, cells)


def lower_middle(points):
    return np.flatnonzero((points[0] == 0.5) & (points[1] == 0.0))


FLAT = r"cell \d+ at x = .* mm, y = .* mm is inverted or flat"
NOWHERE = r"mesh: node 3 is at x = 1000 mm, y = {} mm, needs finite coordinates"
# Its Jacobian is negative at that corner alone, between the quadrature points.
PUSHED_IN = skfem.MeshQuad1(np.array([[0.0, 1.0, 0.45, 0.0], [0.0, 0.0, 0.45, 1.0]]), np.array([[0], [1], [2], [3]]))


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        *((changed(kind, lambda p: p[0] == 2.0, (1.0, 0.5), (0.0, 1.0, 2.0)), FLAT) for kind in ("Q4", "T3")),
        *((changed(kind, 3, (1.0, v)), NOWHERE.format(v)) for kind in ("Q4", "T6") for v in (np.nan, np.inf)),
        (with_turned_cell(), r"cell 2 at .* all turn the same way; repair or rebuild the mesh"),
        (changed("T6", lower_middle, (0.5, 0.9)), "inverted or flat"),
        (PUSHED_IN, r"cell 0 at .* is inverted or flat"),
    ],
)
def test_cells_and_nodes_that_cannot_be_are_refused(mesh, message):
    with pytest.raises(MeshError, match=message):
        build_space(mesh)
