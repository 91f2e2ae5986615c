"""Mesh files in and out, of any format: every name and cell comes back, a faulty file is one clear error."""

import contextlib
import errno
import os
from unittest.mock import Mock

import gmsh
import meshio
import numpy as np
import pytest
import skfem

from fingerslip.errors import MeshError, ResultError
from fingerslip.fe.space import build_space
from fingerslip.mesh import io
from fingerslip.mesh.formats import read_file, write_file
from fingerslip.mesh.io import read_mesh, write_mesh
from fingerslip.mesh.quality import turned_cells
from fingerslip.verification.meshes import box, dimension
from places import ROOT
from problems.blocks import EVERY_ELEMENT

SUFFIXES = (".msh", ".vtu", ".xdmf")


def layered(element):
    """Return a sheared and bulged block of two layers, with boundaries outside and inside."""

    def shift(points):
        return points + np.outer(np.eye(len(points))[0], 0.3 * points[-1] + 0.1 * points[0] * points[1])

    grids, halves = (np.linspace(0.0, 1.0, 3 + 2 * (axis > 0)) for axis in range(dimension(element))), ("low", "high")
    sides = dict(zip(halves, (lambda x: x[-1] < 0.5, lambda x: x[-1] > 0.5), strict=True))
    mesh = box(element, *grids, shift=shift, regions=sides)
    low = np.isin(mesh.f2t, mesh.subdomains["low"])
    inside = np.flatnonzero((low[0] != low[1]) & (mesh.f2t[1] >= 0))
    return mesh.with_boundaries({"plate": mesh.boundaries["bottom"], "middle": inside}, boundaries_only=False)


def members(mesh, table, corners):
    """Return the positions of the corners of each member of named groups, so that numbering does not matter."""
    return {
        name: {tuple(sorted(map(tuple, mesh.p[:, corners[:, one]].T.round(9).tolist()))) for one in group}
        for name, group in table.items()
    }


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_meshes_go_out_and_come_back(element, suffix, tmp_path, capfd):
    mesh, path = layered(element), tmp_path / f"block{suffix}"
    assert {"plate", "middle"} <= set(mesh.boundaries)
    write_mesh(mesh, path)
    back = read_mesh(path)
    assert type(back) is type(mesh)
    assert back.doflocs.shape == mesh.doflocs.shape
    assert members(back, back.subdomains, back.t) == members(mesh, mesh.subdomains, mesh.t)
    assert members(back, back.boundaries, back.facets) == members(mesh, mesh.boundaries, mesh.facets)
    assert not any(isinstance(facets, skfem.generic_utils.OrientedBoundary) for facets in back.boundaries.values())
    assert build_space(back).element == element
    assert capfd.readouterr() == ("", "")


def test_middle_nodes_survive_the_round_trip(tmp_path):
    mesh = skfem.MeshTri2.init_circle(1)
    write_mesh(mesh.with_subdomains({"disc": np.arange(mesh.t.shape[1])}), tmp_path / "disc.msh")
    again = read_mesh(tmp_path / "disc.msh")
    rim = again.doflocs[:, again.dofs.get_facet_dofs(again.boundary_facets()).flatten()]
    assert np.linalg.norm(rim, axis=0) == pytest.approx(1.0)


@contextlib.contextmanager
def drawn(path):
    """Mesh what is drawn in the block by Gmsh alone, and write it."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        yield gmsh.model
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


KINDS = {"quad": (skfem.MeshQuad1, 1), "triangle": (skfem.MeshTri1, 1), "triangle6": (skfem.MeshTri2, 2)}


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("kind", KINDS)
def test_files_of_gmsh_with_physical_groups(version, kind, tmp_path):
    """A unit square of two layers, the upper one drawn clockwise."""
    expected, order = KINDS[kind]
    with drawn(tmp_path / "block.msh") as model:
        geo = model.geo
        points = [geo.addPoint(x, y, 0, 0.3) for x, y in ((0, 0), (1, 0), (1, 0.5), (0, 0.5), (1, 1), (0, 1))]
        pairs = ((0, 1), (1, 2), (2, 3), (3, 0), (2, 4), (4, 5), (5, 3))
        lines = [geo.addLine(points[a], points[b]) for a, b in pairs]
        lower = geo.addPlaneSurface([geo.addCurveLoop(lines[:4])])
        upper = geo.addPlaneSurface([geo.addCurveLoop([lines[2], -lines[6], -lines[5], -lines[4]])])
        geo.synchronize()
        groups = ((2, lower, "lower"), (2, upper, "upper"), (1, lines[0], "contact"), (1, lines[2], "between"))
        for dim, tag, name in groups:
            model.addPhysicalGroup(dim, [tag], name=name)
        for line in lines if kind == "quad" else ():
            model.mesh.setTransfiniteCurve(line, 4)
        for surface in (lower, upper) if kind == "quad" else ():
            model.mesh.setTransfiniteSurface(surface)
            model.mesh.setRecombine(2, surface)
        model.mesh.generate(2)
        model.mesh.setOrder(order)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
    mesh = read_mesh(tmp_path / "block.msh")
    assert type(mesh) is expected
    assert set(mesh.subdomains) == {"lower", "upper"}
    middle = mesh.p[:, mesh.facets].mean(axis=1)
    assert middle[1, mesh.boundaries["contact"]] == pytest.approx(0.0)
    assert middle[1, mesh.boundaries["between"]] == pytest.approx(0.5)
    sides = mesh.f2t[:, mesh.boundaries["between"]]
    assert np.all(sides[1] >= 0)
    assert np.all(np.isin(sides, mesh.subdomains["upper"]).sum(axis=0) == 1)


@pytest.mark.parametrize("path", sorted((ROOT / "meshes").glob("*.msh")), ids=lambda path: path.stem)
def test_shipped_meshes_are_read(path):
    mesh = read_mesh(path)
    assert mesh.subdomains
    assert mesh.boundaries


def test_regions_that_overlap_or_do_not_fit_the_cells_of_a_file_are_refused(tmp_path, monkeypatch):
    mesh = skfem.MeshQuad1().refined(1).with_subdomains({"all": np.arange(4), "one": np.array([0])})
    with pytest.raises(MeshError, match="region 'one' shares cells with another"):
        write_mesh(mesh, tmp_path / "a.msh")
    write_mesh(mesh, tmp_path / "a.vtu")
    assert read_mesh(tmp_path / "a.vtu").subdomains["one"].tolist() == [0]
    write_mesh(read_mesh(ROOT / "meshes" / "block.msh"), tmp_path / "own.vtu")

    monkeypatch.setattr(io, "from_meshio", Mock(side_effect=IndexError("index 128 is out of bounds")))
    with pytest.raises(MeshError, match=r"own\.vtu: is damaged: its groups do not fit its cells \(index 128 is out"):
        read_mesh(tmp_path / "own.vtu")


SQUARE = skfem.MeshQuad1().refined(1)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(
    "name", ["a b", "a'b", "=1+1", "ü", "a\\b", 'a"b', "a\nb", "a<b>&", "a:b", "a\\", "a\\\\b", "x/y", "[0]", "#", "%s"]
)
def test_names_are_read_back_as_they_are_or_refused_before_anything_is_written(tmp_path, name, suffix):
    named = {name: np.arange(SQUARE.nelements)}, {f"{name}s": SQUARE.boundary_facets()}
    file = tmp_path / f"a{suffix}"
    try:
        write_mesh(SQUARE.with_subdomains(named[0]).with_boundaries(named[1]), file)
    except MeshError as error:
        assert "needs names without" in str(error)  # noqa: PT017  either is right
        assert not list(tmp_path.iterdir())
    else:
        mesh = read_mesh(file)
        assert (list(mesh.subdomains), list(mesh.boundaries)) == ([name], [f"{name}s"])


@pytest.mark.parametrize(
    ("name", "file", "message"),
    [
        ("all", "no/a.msh", "the folder does not exist"),
        ("all", "a.xyzzy", r"a.xyzzy: cannot be written.*\.msh, \.vtu"),
        *(
            (name, f"a{suffix}", rf"has the name .*needs names without .* in \{suffix}; rename it")
            for name, suffix in (('a"b', ".msh"), ('a"b', ".vtu"), ("a\nb", ".xdmf"), ("a:b", ".vtu"))
        ),
    ],
)
def test_what_cannot_be_written(tmp_path, name, file, message):
    with pytest.raises(MeshError, match=message):
        write_mesh(SQUARE.with_subdomains({name: np.arange(SQUARE.nelements)}), tmp_path / file)


SQUARES = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], dtype=float)
CELLS = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
CUBE = np.vstack([np.column_stack([SQUARES[[0, 1, 4, 3]], np.full(4, z)]) for z in (0.0, 1.0)])


def save(path, *, points=SQUARES, cells=CELLS, kind="quad", tags=None, lines=((0, 1),), more=None):
    """Write a small file with a region `block`, others of further tags, and a boundary `contact`, faults included."""
    points = np.column_stack([points, np.zeros(len(points))]) if points.shape[1] == 2 else points
    tags = [np.array(tags or [1] * len(cells)), np.full(len(lines), 2)]
    blocks = [(kind, np.asarray(cells)), *([("line", np.asarray(lines))] if lines else []), *([more] if more else [])]
    dim = 3 if kind in ("tetra", "hexahedron") else 2
    names = {"block": np.array([1, dim]), "contact": np.array([2, 1]), "other": np.array([3, dim])}
    data = {"gmsh:physical": tags[: len(blocks)], "gmsh:geometrical": tags[: len(blocks)]}
    if path.suffix == ".vtk":
        meshio.write(path, meshio.Mesh(points, blocks))
    else:
        meshio.write(path, meshio.Mesh(points, blocks, cell_data=data, field_data=names), file_format="gmsh22")
    return path


@pytest.mark.parametrize("shift", [0, 1])
def test_small_file_is_read_without_nodes_that_no_cell_has(shift, tmp_path):
    points = np.vstack([[[9.0, 9.0]] * shift, SQUARES]) if shift else SQUARES
    mesh = read_mesh(save(tmp_path / "a.msh", points=points, cells=CELLS + shift, lines=((shift, 1 + shift),)))
    assert pytest.approx(SQUARES) == mesh.p.T
    assert mesh.subdomains["block"].tolist() == [0, 1]
    assert mesh.facets[:, mesh.boundaries["contact"]].T.tolist() == [[0, 1]]


def test_cells_in_two_groups_are_not_doubled(tmp_path):
    mesh = read_mesh(save(tmp_path / "a.msh", cells=np.vstack([CELLS, CELLS[1:]]), tags=[1, 1, 3]))
    assert mesh.t.shape[1] == 2
    assert (mesh.subdomains["block"].tolist(), mesh.subdomains["other"].tolist()) == ([0, 1], [1])


@pytest.mark.parametrize(
    ("content", "size"),
    [
        ({"cells": CELLS[:, ::-1]}, 2.0),
        *(
            ({"points": CUBE, "cells": [order], "kind": "hexahedron", "lines": ()}, 1.0)
            for order in ([4, 5, 6, 7, 0, 1, 2, 3], [3, 2, 1, 0, 7, 6, 5, 4])
        ),
    ],
    ids=["clockwise", "upside down", "reversed"],
)
def test_regions_inside_out_are_turned_round(content, size, tmp_path):
    """All cells then turn as those that scikit-fem makes itself."""
    mesh = read_mesh(save(tmp_path / "block.msh", **content))
    assert build_space(mesh).full.dx.sum() == pytest.approx(size)
    assert (turned_cells(mesh) == turned_cells(type(mesh)())[0]).all()


MIXED = {"points": CUBE, "cells": [np.arange(8)], "kind": "hexahedron", "more": ("tetra", [[0, 1, 2, 4]])}
RAISED = np.column_stack([SQUARES, np.arange(6.0)])
CROSSED = {"cells": np.array([[0, 1, 4, 3], [1, 5, 2, 4]])}
# Each region is drawn one way round, and so turned round as a whole; where they meet tells that one is folded.
FLAP = {"points": np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.2, 0.2]]), "cells": [[0, 1, 2], [1, 2, 3]]}
FLAP |= {"kind": "triangle", "tags": [1, 3]}
FLAT = {"points": np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]]), "kind": "tetra", "lines": ()}
FLAT["cells"] = [[0, 1, 2, 3], [0, 1, 2, 4]]
TWISTED = {"points": CUBE, "cells": [[0, 1, 2, 3, 5, 4, 7, 6]], "kind": "hexahedron", "lines": ()}
PYRAMID = {"cells": np.arange(5)[None], "kind": "pyramid"}
FOLDED = "has cells that fold over each other: 0 and 1 at x = {} mm, y = {} mm, "


@pytest.mark.parametrize(
    ("change", "unit", "message"),
    [
        (CROSSED, "m", r"cell 1 at x = 1500 mm, y = 500 mm is inverted or flat"),
        (CROSSED, "mm", r"cell 1 at x = 1.5 mm, y = 0.5 mm is inverted or flat"),
        ({"cells": np.array([[0, 1, 4, 3], [4, 5, 2, 1]])}, "m", r"cell \d at x = .* is inverted against its region"),
        ({"cells": np.array([[0, 1, 2, 1], [1, 2, 5, 4]])}, "m", "cell 0 at x = 1000 mm, y = 0 mm is inverted or flat"),
        ({"points": RAISED}, "m", "node 5 is at .*, z = 5000 mm, needs z = 0"),
        ({"points": RAISED}, "mm", "node 5 is at x = 2 mm, y = 1 mm, z = 5 mm"),
        ({"lines": ((0, 5),)}, "m", "boundary 'contact' has lines that are no edge of a cell"),
        (PYRAMID, "m", "has cells of type pyramid, needs cells of one of the types .*; mesh the body again"),
        (FLAP, "m", FOLDED.format(500, 500)),
        (FLAP, "mm", FOLDED.format(0.5, 0.5)),
        (FLAT, "m", r"cell 1 at x = 500 mm, y = 500 mm, z = 0 mm is inverted or flat, .* volume"),
        (TWISTED, "m", r"cell 0 at x = 500 mm, y = 500 mm, z = 500 mm is inverted or flat, .* volume"),
        # In a format without names.
        (None, None, "no such file"),
        ({}, None, r"has no named groups.*in Gmsh as physical groups"),
        ({"cells": CELLS[:1], "lines": ()}, None, "has no named groups"),
        (
            {**MIXED, "lines": ()},
            None,
            "has cells of type hexahedron, tetra, .* and triangles among quadrilaterals, or prisms among hexahedra",
        ),
    ],
)
def test_faulty_meshes_are_one_clear_error(change, unit, message, tmp_path):
    path = tmp_path / ("faulty.msh" if unit else "faulty.vtk")
    if change is not None:
        save(path, **change)
    with pytest.raises(MeshError, match=rf"{path.name}: .*{message}"):
        read_mesh(path, unit or "m")


@pytest.mark.parametrize("suffix", [".msh", ".vtu"])
@pytest.mark.parametrize("element", ["T4", "T10"])
def test_tetrahedra_that_fold_over_their_neighbours_are_refused(element, suffix, tmp_path):
    def folded(points):
        return points + np.outer([0.4, 0.35, 0.3], (points == 0.5).all(axis=0))

    write_mesh(box(element, *[np.linspace(0.0, 1.0, 5)] * 3, shift=folded), tmp_path / f"block{suffix}")
    with pytest.raises(MeshError, match=rf"block\{suffix}: has cells that fold over each other: .* needs .* a face"):
        read_mesh(tmp_path / f"block{suffix}")


CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
TRIANGLE = meshio.Mesh(CORNERS, [("triangle", np.array([[0, 1, 2]]))])
# The first bytes of what each suffix is written as: binary, and Gmsh's version two.
STARTS = {".stl": b"\0", ".ply": b"ply", ".vtu": b"<?xml", ".msh": b"$MeshFormat\n2.2"}


@pytest.mark.parametrize("suffix", STARTS)
def test_what_is_written_is_read_back(tmp_path, suffix, capfd):
    file = tmp_path / f"triangle{suffix}"
    write_file(file, TRIANGLE, ".stl")
    np.testing.assert_allclose(read_file(file, "needs a file").data.points, CORNERS)
    assert capfd.readouterr() == ("", "")
    content = file.read_bytes().replace(b"\r\n", b"\n")
    assert not content.startswith(b"solid") if suffix == ".stl" else content.startswith(STARTS[suffix])


WHOLE = ", ".join(["((0.125 0.25 0.5, 1.125 0.25 0.5, 0.125 1.25 0.5, 0.125 0.25 0.5))"] * 30)
ENDS = r"cannot be read \(.*it ends too early.*look whether it is whole"


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.stl", None, "no such file, needs a surface"),
        ("bad.stl", b"nothing", r"cannot be read \(.+\), needs a surface"),
        ("empty.stl", b"", "is empty, needs a surface; look whether it is whole, and export"),
        ("bad.nix", b"nothing", "cannot be read"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n", ENDS),
        ("a.off", b"OFF\n# made by\n", ENDS),
        ("a.nas", b"CEND\nBEGIN BULK\n", ENDS),
        ("a.mdpa", b"Begin Nodes\n1 0 0 0\n", ENDS),
        ("a.node", b"# nodes\n", ENDS),
        ("a.msh", b'(1 "meshio")\n(2 3)\n(10 (1 1 8 1 3)(', ENDS),
        ("a.msh", b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n$NodeData\n99999999999\n", ENDS),
        ("cut.wkt", f"TIN ({WHOLE}".encode(), "cannot be read"),
    ],
)
def test_missing_damaged_and_cut_files_are_named(tmp_path, name, content, message, capfd):
    file = tmp_path / name
    for path in {file, file.with_suffix(".ele") if file.suffix == ".node" else file} if content is not None else ():
        path.write_bytes(content)
    with pytest.raises(MeshError, match=rf"{name}: {message}"):
        read_file(file, "needs a surface")
    assert capfd.readouterr() == ("", "")


def test_a_text_of_triangles_and_a_point_that_no_cell_uses_are_read(tmp_path):
    (tmp_path / "whole.wkt").write_text(f"TIN ({WHOLE})")
    assert len(read_file(tmp_path / "whole.wkt", "").data.cells_dict["triangle"]) == 30
    points = np.vstack([CORNERS, np.full(3, np.nan)])
    meshio.write(tmp_path / "good.vtu", meshio.Mesh(points, [("triangle", [[0, 1, 2]])]))
    assert len(read_file(tmp_path / "good.vtu", "").data.points) == 4


@pytest.mark.parametrize(("name", "count"), [("a.stl", 1), ("a.xdmf", 2)])
def test_a_file_that_is_not_written_to_its_end_leaves_the_old_one(tmp_path, monkeypatch, name, count):
    write_file(tmp_path / name, TRIANGLE, ".stl")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    write = meshio.write

    def full(file, data, **options):
        write(file, meshio.Mesh(2.0 * data.points, data.cells), **options)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(meshio, "write", full)
    with pytest.raises(ResultError, match=r"No space left on device.*free some space"):
        write_file(tmp_path / name, TRIANGLE, ".stl")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    assert len(before) == count


@pytest.mark.parametrize(
    ("points", "nodes", "message"),
    [
        (CORNERS, [0, 1, 3], "is damaged: a cell has point 3 of 3, needs points from 0 to 2"),
        (CORNERS, [0, -1, 2], "is damaged: a cell has point -1 of 3"),
        (np.full((3, 3), np.nan), [0, 1, 2], "has coordinates that are no numbers, needs finite ones"),
        (np.full((3, 3), np.inf), [0, 1, 2], "has coordinates that are no numbers"),
        (CORNERS * 1e200, [0, 1, 2], r"has a coordinate of 1e\+200, needs at most 1e\+09"),
    ],
)
def test_numbers_that_do_not_fit_together_are_named(tmp_path, points, nodes, message):
    meshio.write(tmp_path / "bad.vtu", meshio.Mesh(points, [("triangle", [nodes])]))
    with pytest.raises(MeshError, match=rf"bad\.vtu: {message}"):
        read_file(tmp_path / "bad.vtu", "needs a mesh file")


@pytest.mark.parametrize("suffix", [".vtu", ".xdmf"])
def test_regions_and_boundaries_are_plain_fields_for_other_programs(suffix, tmp_path):
    axes = np.linspace(0.0, 1e-3, 3)
    regions = {"low": lambda x: x[1] < 0.5e-3, "high": lambda x: x[1] > 0.5e-3}
    mesh = box("Q4", axes, axes, regions=regions)
    write_mesh(mesh, tmp_path / f"mesh{suffix}")
    data = meshio.read(tmp_path / f"mesh{suffix}")
    heights = mesh.p[1, mesh.t].mean(axis=0)
    np.testing.assert_array_equal(data.cell_data["region"][0], (heights > 0.5e-3).astype(int))
    np.testing.assert_array_equal(data.point_data["boundary_bottom"], data.points[:, 1] < 1e-9)
    curved = skfem.MeshTri2().refined(1).with_boundaries({"the bottom": lambda x: x[1] < 1e-9})
    write_mesh(curved, tmp_path / f"curved{suffix}")
    data = meshio.read(tmp_path / f"curved{suffix}")
    np.testing.assert_array_equal(data.point_data["boundary_the bottom"], data.points[:, 1] < 1e-9)
