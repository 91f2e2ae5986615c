"""Triangles among quadrilaterals and prisms among hexahedra: they are what they would be alone, and all else runs."""

from types import SimpleNamespace

import meshio
import numpy as np
import pytest
import pyvista
import skfem
from scipy.sparse.linalg import spsolve

import fingerslip as fs
from fingerslip.contact.candidates import automatic_penalty
from fingerslip.dynamics.system.checks import contact_penalties
from fingerslip.fe.cell_materials import cell_materials, finite_cell_materials
from fingerslip.fe.finite.bulk import large_strain
from fingerslip.fe.forms import mass_matrix, stiffness_matrix
from fingerslip.fe.recovery import cell_recovery, cells_around
from fingerslip.fe.space import boundary_nodes, build_space, free_edge_nodes, nodal_areas
from fingerslip.mesh.facets import are_degenerate, outward_normals
from fingerslip.mesh.io import read_mesh, write_mesh

LAW = fs.NeoHookean(50e3, 0.45, 1000.0)
SIZE = 4


def grid(dim, split=lambda i, j: (i + 2 * j) % 3, seed=1, size=SIZE):
    """Return points, quadrilaterals and triangles, in 3D what two layers over them make, all nodes shuffled."""
    random = np.random.default_rng(seed)
    axis = np.linspace(0.0, 1.0, size + 1)
    points = np.array([(x, y) for y in axis for x in axis])
    inside = ((points > 0.0) & (points < 1.0)).all(axis=1)
    points[inside] += random.uniform(-0.05, 0.05, (inside.sum(), 2))

    def corner(i, j):
        return j * (size + 1) + i

    quads, triangles = [], []
    for j in range(size):
        for i in range(size):
            a, b, c, d = corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)
            kind = split(i, j)
            quads += [(a, b, c, d)] if kind == 0 else []
            triangles += {0: [], 1: [(a, b, c), (c, d, a)], 2: [(d, a, b), (b, c, d)]}[kind]
    cells = {
        "quad": np.array(quads, dtype=int).reshape(-1, 4),
        "triangle": np.array(triangles, dtype=int).reshape(-1, 3),
    }
    if dim == 3:
        count = len(points)
        points = np.vstack([np.column_stack([points, np.full(count, z)]) for z in (0.0, 0.4, 1.0)])
        layers = {
            kind: [np.hstack([base + k * count, base + (k + 1) * count]) for k in (0, 1)]
            for kind, base in cells.items()
        }
        cells = {{"quad": "hexahedron", "triangle": "wedge"}[kind]: np.vstack(two) for kind, two in layers.items()}
    order = random.permutation(len(points))
    shuffled = np.empty_like(points)
    shuffled[order] = points
    return shuffled, {kind: order[nodes] for kind, nodes in cells.items()}


def saved(path, dim, **options):
    """Write a mixed mesh with a region `pad`, and as a boundary its side at the end of the last axis."""
    points, cells = grid(dim, **options)
    sides = {}
    faces = {"quad": ((0, 1), (1, 2), (2, 3), (3, 0)), "triangle": ((0, 1), (1, 2), (2, 0))}
    faces |= {"hexahedron": ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))}
    faces |= {"wedge": ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))}
    for kind, nodes in cells.items():
        for face in (nodes[:, list(corners)] for corners in faces[kind]):
            wanted = (points[face][:, :, -1] == 1.0).all(axis=1)
            sides.setdefault({2: "line", 3: "triangle", 4: "quad"}[face.shape[1]], []).append(face[wanted])
    blocks = [*cells.items(), *((kind, np.vstack(rows)) for kind, rows in sides.items())]
    tags = [np.full(len(nodes), 1 if kind in cells else 2) for kind, nodes in blocks]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    names = {"pad": np.array([1, dim]), "top": np.array([2, dim - 1])}
    spatial = np.column_stack([points, np.zeros(len(points))]) if dim == 2 else points
    blocks = [(kind, nodes) for kind, nodes in blocks]
    meshio.write(path, meshio.Mesh(spatial, blocks, cell_data=data, field_data=names), file_format="gmsh22")
    return path


def laws(space):
    formulation = "solid" if space.dim == 3 else "plane_strain"
    return cell_materials(space, {"pad": LAW}, formulation), finite_cell_materials(space, {"pad": LAW}, formulation)


def test_a_mesh_of_triangles_alone_among_quadrilaterals_is_that_of_triangles(tmp_path):
    points, cells = grid(2, split=lambda i, j: 1 + (i + j) % 2)
    corners = cells["triangle"]
    alone = skfem.MeshTri1(points.T, corners.T).with_subdomains({"pad": np.arange(len(corners))})
    same = skfem.MeshQuad1(points.T, corners[:, [0, 1, 2, 2]].T).with_subdomains({"pad": np.arange(len(corners))})
    moved = np.random.default_rng(0).normal(0.0, 0.01, 2 * len(points))
    of_triangles, of_both = ([], [])
    for mesh, results in ((alone, of_triangles), (same, of_both)):
        space = build_space(mesh)
        small, finite = laws(space)
        bulk = large_strain(space, finite, 0.1, "full")
        state = bulk.deformed(moved)
        results += [stiffness_matrix(space, small, 0.1, "full"), mass_matrix(space, small, 0.1)]
        results += [bulk.tangent(state), bulk.force(state)[:, None], cell_recovery(space, small).strains(moved)]
        results += [cells_around(space, np.arange(len(points)), [None] * len(points))]
    for expected, result in zip(of_triangles, of_both, strict=True):
        assert abs(result - expected).max() <= 1e-12 * abs(expected).max()


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("integration", ["selective", "full"])
def test_mixed_cells_pass_the_patch_test(tmp_path, dim, integration):
    space = build_space(read_mesh(saved(tmp_path / "a.msh", dim)))
    stiffness = stiffness_matrix(space, laws(space)[0], 1.0, integration)
    slope = np.array([[0.01, 0.02, -0.005], [0.004, -0.02, 0.01], [0.02, 0.01, 0.03]])[:dim, :dim]
    exact = (space.positions @ slope.T).ravel()
    inside = np.repeat(((space.positions > 0.0) & (space.positions < 1.0)).all(axis=1), dim)
    solved = exact.copy()
    solved[inside] = spsolve(stiffness[inside][:, inside], -stiffness[inside][:, ~inside] @ exact[~inside])
    assert inside.sum() == dim * (SIZE - 1) ** 2
    np.testing.assert_allclose(solved, exact, atol=1e-12)
    strains = cell_recovery(space, laws(space)[0]).strains(solved)
    np.testing.assert_allclose(strains[:, :dim], np.broadcast_to(np.diag(slope), (len(strains), dim)), atol=1e-12)


@pytest.mark.parametrize("suffix", [".msh", ".vtu"])
@pytest.mark.parametrize("dim", [2, 3])
def test_mixed_meshes_are_read_and_written_with_their_names(tmp_path, dim, suffix):
    mesh = read_mesh(saved(tmp_path / "a.msh", dim))
    write_mesh(mesh, tmp_path / f"b{suffix}")
    kinds = {block.type: len(block.data) for block in meshio.read(tmp_path / f"b{suffix}").cells if block.dim == dim}
    assert kinds == {2: {"quad": 6, "triangle": 20}, 3: {"hexahedron": 12, "wedge": 40}}[dim]
    for read in (mesh, read_mesh(tmp_path / f"b{suffix}")):
        space = build_space(read)
        assert space.element == {2: "Q4", 3: "H8"}[dim]
        assert space.full.dx.sum() == pytest.approx(1.0)
        assert read.subdomains["pad"].size == {2: 26, 3: 52}[dim]
        top = boundary_nodes(space, "top")
        assert (space.positions[top, -1] == 1.0).all()
        assert top.size == (SIZE + 1) ** (dim - 1)
        facets = read.boundaries["top"]
        normals = outward_normals(read, facets, read.f2t[0, facets]).T
        np.testing.assert_allclose(normals, np.broadcast_to(np.eye(dim)[-1], normals.shape), atol=1e-12)
        # Each side is there once, triangles of prisms as well.
        assert nodal_areas(space, "top", 1.0).sum() == pytest.approx(1.0)
        assert (space.full.dx > 0.0).all()
        held = np.zeros((len(space.positions), dim), dtype=bool)
        edge = space.positions[free_edge_nodes(space, "top", held)]
        assert len(edge) == {2: 2, 3: 4 * SIZE}[dim]
        assert ((edge[:, :-1] == 0.0) | (edge[:, :-1] == 1.0)).any(axis=1).all()


def test_prisms_have_a_volume_above_zero_where_vtk_measures_it_and_are_read_in_either_order(tmp_path):
    mesh = read_mesh(saved(tmp_path / "a.msh", 3))
    write_mesh(mesh, tmp_path / "b.vtu")
    volumes = pyvista.read(tmp_path / "b.vtu").compute_cell_sizes()["Volume"]
    assert (volumes.min() > 0.0, volumes.sum()) == (True, pytest.approx(1.0))
    # meshio, and what follows the manual of VTK, write the triangles of prisms the other way round.
    data = meshio.read(tmp_path / "b.vtu")
    prisms = next(block for block in data.cells if block.type == "wedge")
    prisms.data = prisms.data[:, [0, 2, 1, 3, 5, 4]]
    meshio.write(tmp_path / "c.vtu", data)
    assert pyvista.read(tmp_path / "c.vtu").compute_cell_sizes()["Volume"].min() < 0.0
    for name in ("b", "c"):
        np.testing.assert_array_equal(read_mesh(tmp_path / f"{name}.vtu").t, mesh.t)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("dim", [2, 3])
def test_the_penalty_of_a_boundary_follows_from_sides_that_have_a_size(tmp_path, dim, seed):
    """Of triangles and one square, whose edges are about half of a millimetre or, across a square, longer."""
    mesh = read_mesh(saved(tmp_path / "a.msh", dim, split=lambda i, j: min(i + j, 1), size=2, seed=seed), "mm")
    # A test of positions takes sides without a size, too.
    nowhere = np.tile(np.flatnonzero(are_degenerate(mesh)), 9)
    mesh = mesh.with_boundaries({"top": np.append(mesh.boundaries["top"], nowhere)})
    contact = fs.Contact("top", fs.Plane(normal=(0, 1, 0)[:dim]), fs.Coulomb(0.5))
    penalty, _ = contact_penalties(SimpleNamespace(mesh=mesh, materials={"pad": LAW}), contact)
    least, largest = (automatic_penalty(LAW.stiffness, size) for size in (0.8e-3, 0.4e-3))
    assert least < penalty < largest


def test_the_quality_of_a_mixed_mesh_is_the_worst_of_both_kinds(tmp_path):
    points, cells = grid(2)
    kinds = {"quad": skfem.MeshQuad1, "triangle": skfem.MeshTri1}
    quads, triangles = (fs.quality_table(kinds[kind](points.T, nodes.T))[0] for kind, nodes in cells.items())
    (mixed,) = fs.quality_table(read_mesh(saved(tmp_path / "a.msh", 2)))
    assert mixed.cells == quads.cells + triangles.cells
    # What stands upright on them has the same angles, and right ones.
    (upright,) = fs.quality_table(read_mesh(saved(tmp_path / "b.msh", 3)))
    for name, worst in (("smallest_angle", min), ("scaled_jacobian", min), ("largest_angle", max)):
        assert getattr(mixed, name) == pytest.approx(worst(getattr(quads, name), getattr(triangles, name)))
        assert getattr(upright, name) == pytest.approx(getattr(mixed, name))


def test_the_quality_of_hexahedra_is_that_of_their_corners():
    (row,) = fs.quality_table(skfem.MeshHex().scaled((1.0, 2.0, 3.0)))
    assert (row.scaled_jacobian, row.aspect_ratio) == pytest.approx((1.0, 3.0))
    assert np.degrees([row.smallest_angle, row.largest_angle]) == pytest.approx([90.0, 90.0])
    # A corner along the axis of a cube, moved towards its middle: its three right angles become obtuse.
    points = skfem.MeshHex().p.copy()
    points[:, points.sum(axis=0) == 3.0] = 0.75
    (row,) = fs.quality_table(skfem.MeshHex(points, skfem.MeshHex().t))
    assert row.scaled_jacobian < 0.9
    assert np.degrees(row.largest_angle) > 100.0


@pytest.mark.parametrize("turn", range(4))
def test_files_may_have_triangles_as_quadrilaterals_with_two_corners_in_one_node(tmp_path, turn):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0]])
    cells = np.array([[0, 1, 4, 3], np.roll([1, 2, 4, 4], turn)])
    tags = {"gmsh:physical": [np.ones(2, dtype=int)], "gmsh:geometrical": [np.ones(2, dtype=int)]}
    content = meshio.Mesh(points, [("quad", cells)], cell_data=tags, field_data={"pad": np.array([1, 2])})
    meshio.write(tmp_path / "a.msh", content, file_format="gmsh22")
    mesh = read_mesh(tmp_path / "a.msh")
    assert build_space(mesh).full.dx.sum(axis=1) == pytest.approx([1.0, 0.5])


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_a_mixed_pad_is_pressed_and_slides_like_one_of_quadrilaterals(tmp_path, kinematics):
    mesh = read_mesh(saved(tmp_path / "a.msh", 2, seed=2), "mm")
    # Where two corners of a triangle are one node, there is a side without a size, which such a test may find.
    mesh = mesh.with_boundaries({"bottom": lambda x: x[1] < 1e-9})
    assert mesh.boundaries["bottom"].size > SIZE
    same = skfem.MeshQuad1.init_tensor(*[np.linspace(0.0, 1e-3, SIZE + 1)] * 2)
    sides = {"bottom": lambda x: x[1] < 1e-9, "top": lambda x: x[1] > 1e-3 - 1e-9}
    same = same.with_subdomains({"pad": np.arange(SIZE**2)}).with_boundaries(sides)
    forces = []
    for body in (mesh, same):
        model = fs.Model(
            mesh=body,
            materials={"pad": LAW},
            formulation="plane_strain",
            depth=1e-3,
            supports={"top": ("x", "y")},
            contacts=(fs.Contact("bottom", fs.Plane(normal=(0, 1)), fs.Coulomb(0.5)),),
            programme=(fs.Press(5e-5, 1e-3), fs.Slide(2e-4, 1e-3)),
            time=fs.QuasiStatic(0.01),
            kinematics=kinematics,
        )
        forces.append(fs.simulate(model)["counterface_force"].values[-1, 0])
    assert forces[0] == pytest.approx(forces[1], rel=0.05)
    assert forces[0][0] == pytest.approx(0.5 * forces[0][1], rel=1e-6)


def test_a_few_triangles_among_quadrilaterals_cost_little():
    """The numbers of the page on own meshes, of a pad of 8 by 8 squares, wherever the triangles are."""
    growths = []
    for seed in (1, 2, 3):
        whole = pressing_force(split=lambda *_: 0, size=8, seed=seed)
        splits = [lambda i, j, first=first: (i + 2 * j) % 10 == first for first in (0, 3, 7)]
        growths += [pressing_force(split=split, size=8, seed=seed) / whole - 1.0 for split in splits]
    assert (min(growths), max(growths)) == pytest.approx((0.0007, 0.0048), abs=1e-4)


def pressing_force(**options):
    """Return the force of a pad that is pressed by a smooth plate."""
    points, cells = grid(2, **options)
    nodes = np.vstack([cells["quad"], cells["triangle"][:, [0, 1, 2, 2]]])
    mesh = skfem.MeshQuad1(1e-3 * points.T, nodes.T).with_subdomains({"pad": np.arange(len(nodes))})
    space = build_space(mesh)
    law = cell_materials(space, {"pad": fs.Elastic(50e3, 0.48, 1000.0)}, "plane_strain")
    stiffness = stiffness_matrix(space, law, 1e-3, "selective")
    moved = np.zeros(space.positions.shape)
    low, high = space.positions[:, 1] < 1e-9, space.positions[:, 1] > 1e-3 - 1e-9
    moved[low, 1] = 5e-5
    free = np.repeat(~(low | high), 2)
    free[0::2] |= low
    moved = moved.ravel()
    moved[free] = spsolve(stiffness[free][:, free], -stiffness[free][:, ~free] @ moved[~free])
    return (stiffness @ moved)[1::2][low].sum()
