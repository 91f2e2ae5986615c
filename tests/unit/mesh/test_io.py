"""Mesh files in and out: every name and cell comes back, and a faulty file is one clear error."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import gmsh
import meshio
import numpy as np
import pytest
import skfem

from fingerslip.errors import InputError, MeshError
from fingerslip.fe.space import build_space
from fingerslip.mesh import io
from fingerslip.mesh.io import read_mesh, write_mesh
from fingerslip.specimens.fingertip.meshing.sources import build_section
from places import ROOT
from unit.fingers import change


@pytest.fixture(scope="module", params=["Q4", "T3", "T6"])
def finger(request):
    return build_section(change(ridges={"enabled": False}), contact_size=0.5e-3, bulk_size=1e-3, element=request.param)


def cell_sets(mesh, names):
    """Corner coordinates of the members of groups, so that numbering does not matter."""
    return {
        name: {tuple(sorted(map(tuple, mesh.p[:, mesh.t[:, c]].T.round(9).tolist()))) for c in mesh.subdomains[name]}
        for name in names
    }


def facet_sets(mesh, names):
    return {
        name: {
            tuple(sorted(map(tuple, mesh.p[:, mesh.facets[:, f]].T.round(9).tolist()))) for f in mesh.boundaries[name]
        }
        for name in names
    }


def assert_same(first, second):
    assert type(first) is type(second)
    assert first.doflocs.shape == second.doflocs.shape
    assert set(first.subdomains) == set(second.subdomains)
    assert set(first.boundaries) == set(second.boundaries)
    assert cell_sets(first, first.subdomains) == cell_sets(second, first.subdomains)
    assert facet_sets(first, first.boundaries) == facet_sets(second, first.boundaries)


@pytest.mark.parametrize("suffix", [".msh", ".vtu", ".xdmf"])
def test_round_trip_keeps_cells_and_names(finger, suffix, tmp_path, capfd):
    path = tmp_path / f"finger{suffix}"
    write_mesh(finger, path)
    again = read_mesh(path)
    assert_same(finger, again)
    assert not any(isinstance(facets, skfem.generic_utils.OrientedBoundary) for facets in again.boundaries.values())
    assert capfd.readouterr() == ("", "")


def test_middle_nodes_survive_the_round_trip(tmp_path):
    mesh = skfem.MeshTri2.init_circle(1)
    mesh = mesh.with_subdomains({"disc": np.arange(mesh.t.shape[1])})
    write_mesh(mesh, tmp_path / "disc.msh")
    again = read_mesh(tmp_path / "disc.msh")
    rim = again.doflocs[:, again.dofs.get_facet_dofs(again.boundary_facets()).flatten()]
    assert np.linalg.norm(rim, axis=0) == pytest.approx(1.0)


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize(("kind", "order"), [("quad", 1), ("triangle", 1), ("triangle6", 2)])
def test_files_of_gmsh_with_physical_groups(version, kind, order, tmp_path):
    path = tmp_path / "block.msh"
    draw_block(path, version, kind, order)
    mesh = read_mesh(path)
    expected = {"quad": skfem.MeshQuad1, "triangle": skfem.MeshTri1, "triangle6": skfem.MeshTri2}[kind]
    assert type(mesh) is expected
    assert set(mesh.subdomains) == {"lower", "upper"}
    middle = mesh.p[:, mesh.facets].mean(axis=1)
    assert middle[1, mesh.boundaries["contact"]] == pytest.approx(0.0)
    assert middle[1, mesh.boundaries["between"]] == pytest.approx(0.5)
    assert np.all(mesh.f2t[1, mesh.boundaries["between"]] >= 0)
    sides = np.sort(np.isin(mesh.f2t[:, mesh.boundaries["between"]], mesh.subdomains["upper"]), axis=0)
    assert np.array_equal(np.unique(sides, axis=1).ravel(), [False, True])


def draw_block(path, version, kind, order):
    """Write a unit square of two layers by Gmsh, the upper one drawn clockwise."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        geo = gmsh.model.geo
        points = [geo.addPoint(x, y, 0, 0.3) for x, y in ((0, 0), (1, 0), (1, 0.5), (0, 0.5), (1, 1), (0, 1))]
        pairs = ((0, 1), (1, 2), (2, 3), (3, 0), (2, 4), (4, 5), (5, 3))
        lines = [geo.addLine(points[a], points[b]) for a, b in pairs]
        lower = geo.addPlaneSurface([geo.addCurveLoop(lines[:4])])
        upper = geo.addPlaneSurface([geo.addCurveLoop([lines[2], -lines[6], -lines[5], -lines[4]])])
        geo.synchronize()
        for dimension, tag, name in (
            (2, lower, "lower"),
            (2, upper, "upper"),
            (1, lines[0], "contact"),
            (1, lines[2], "between"),
        ):
            gmsh.model.addPhysicalGroup(dimension, [tag], name=name)
        if kind == "quad":
            for line in lines:
                gmsh.model.mesh.setTransfiniteCurve(line, 4)
            for surface in (lower, upper):
                gmsh.model.mesh.setTransfiniteSurface(surface)
                gmsh.model.mesh.setRecombine(2, surface)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(order)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


@pytest.mark.parametrize("suffix", [".msh", ".vtu"])
@pytest.mark.parametrize("kind", [skfem.MeshTet1, skfem.MeshTet2])
def test_tetrahedra_that_fold_over_their_neighbours_are_refused(kind, suffix, tmp_path):
    block = skfem.MeshTet1().refined(2)
    points = block.p.copy()
    points[:, (points == 0.5).all(axis=0)] += [[0.4], [0.35], [0.3]]
    folded = kind.from_mesh(skfem.MeshTet1(points, block.t)) if kind is skfem.MeshTet2 else kind(points, block.t)
    write_mesh(folded.with_subdomains({"block": np.arange(block.nelements)}), tmp_path / f"block{suffix}")
    with pytest.raises(MeshError, match=rf"block\{suffix}: has cells that fold over each other: .* needs .* a face"):
        read_mesh(tmp_path / f"block{suffix}")


def test_regions_that_overlap_do_not_fit_a_msh_file(tmp_path):
    mesh = skfem.MeshQuad1().refined(1).with_subdomains({"all": np.arange(4), "one": np.array([0])})
    with pytest.raises(MeshError, match="region 'one' shares cells with another"):
        write_mesh(mesh, tmp_path / "a.msh")
    write_mesh(mesh, tmp_path / "a.vtu")
    assert read_mesh(tmp_path / "a.vtu").subdomains["one"].tolist() == [0]


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem == "wang2014-3d"))
        for path in sorted((ROOT / "meshes").glob("*.msh"))
    ],
)
def test_shipped_meshes_are_read(path):
    mesh = read_mesh(path)
    assert mesh.subdomains
    assert mesh.boundaries


@pytest.mark.parametrize("suffix", [".msh", ".vtu"])
@pytest.mark.parametrize("kind", [skfem.MeshTet1, skfem.MeshTet2])
def test_tetrahedra_go_out_and_come_back(kind, suffix, tmp_path):
    block = skfem.MeshTet1().refined(2).with_subdomains({"low": lambda x: x[2] < 0.5, "high": lambda x: x[2] > 0.5})
    block = block.with_boundaries({"plate": lambda x: x[2] == 0.0})
    inside = np.flatnonzero((block.p[2, block.facets] == 0.5).all(axis=0)).astype(np.int32)
    mesh = block if kind is skfem.MeshTet1 else skfem.MeshTet2.from_mesh(block)
    mesh = dataclasses.replace(mesh, _subdomains=block.subdomains, _boundaries={**block.boundaries, "middle": inside})
    file = tmp_path / f"block{suffix}"
    write_mesh(mesh, file)
    back = read_mesh(file)
    assert type(back) is kind
    assert np.allclose(back.doflocs, mesh.doflocs)
    for name in ("plate", "middle"):
        assert np.array_equal(np.sort(back.boundaries[name]), np.sort(mesh.boundaries[name]))
    for name in ("low", "high"):
        assert np.array_equal(np.sort(back.subdomains[name]), np.sort(mesh.subdomains[name]))
    assert build_space(back).n_dofs == 3 * mesh.doflocs.shape[1]


def hexahedra():
    """Return a block of two layers of hexahedra, sheared and bulged, with boundaries outside and inside."""
    flat = skfem.MeshHex.init_tensor(*(np.linspace(0.0, 1.0, 4 + n) for n in range(2)), np.linspace(0.0, 1.0, 5))
    facets = {"plate": flat.facets_satisfying(lambda x: x[2] < 1e-9)}
    facets["middle"] = flat.facets_satisfying(lambda x: np.isclose(x[2], 0.5))
    cells = {
        "low": flat.elements_satisfying(lambda x: x[2] < 0.5),
        "high": flat.elements_satisfying(lambda x: x[2] > 0.5),
    }
    x, y, z = flat.p
    mesh = skfem.MeshHex(np.array([x + 0.3 * z, y + 0.1 * x * z, z]), flat.t)
    return mesh.with_subdomains(cells).with_boundaries(facets)


@pytest.mark.parametrize("suffix", [".msh", ".vtu", ".xdmf"])
def test_hexahedra_go_out_and_come_back(suffix, tmp_path):
    mesh = hexahedra()
    write_mesh(mesh, tmp_path / f"block{suffix}")
    back = read_mesh(tmp_path / f"block{suffix}")
    assert_same(mesh, back)
    assert build_space(back).element == "H8"


def test_hexahedra_of_gmsh(tmp_path):
    path = tmp_path / "block.msh"
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        bottom = gmsh.model.occ.addRectangle(0, 0, 0, 2, 1)
        swept = gmsh.model.occ.extrude([(2, bottom)], 0, 0, 1, numElements=[3], recombine=True)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.setRecombine(2, bottom)
        gmsh.model.mesh.setTransfiniteSurface(bottom)
        gmsh.model.addPhysicalGroup(3, [tag for dim, tag in swept if dim == 3], name="block")
        gmsh.model.addPhysicalGroup(2, [bottom], name="plate")
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    mesh = read_mesh(path)
    space = build_space(mesh)
    assert space.element == "H8"
    assert space.full.dx.sum() == pytest.approx(2.0)
    assert mesh.p[2, mesh.facets[:, mesh.boundaries["plate"]]].max() == pytest.approx(0.0)


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("mm", 1e-3), ("um", 1e-6)])
def test_lengths_of_a_file_have_a_unit(unit, metres, tmp_path):
    mesh = hexahedra()
    write_mesh(mesh, tmp_path / "block.vtu")
    back = read_mesh(tmp_path / "block.vtu", unit)
    np.testing.assert_allclose(np.ptp(back.p, axis=1), metres * np.ptp(mesh.p, axis=1), rtol=1e-12)
    assert set(back.boundaries) == set(mesh.boundaries)
    with pytest.raises(InputError, match=r"unit: got 'inch', needs one of m, cm, mm, um"):
        read_mesh(tmp_path / "block.vtu", "inch")


def test_groups_that_do_not_fit_the_cells_of_a_file_are_refused(tmp_path, monkeypatch):
    write_mesh(read_mesh(ROOT / "meshes" / "block.msh"), tmp_path / "own.vtu")

    def misfit(_):
        raise IndexError("index 128 is out of bounds")

    monkeypatch.setattr(io, "from_meshio", misfit)
    with pytest.raises(MeshError, match=r"own\.vtu: is damaged: its groups do not fit its cells \(index 128 is out"):
        read_mesh(tmp_path / "own.vtu")


SQUARE = skfem.MeshQuad1().refined(1)


@pytest.mark.parametrize("suffix", [".msh", ".vtu", ".xdmf"])
@pytest.mark.parametrize(
    "name", ["a b", "a'b", "=1+1", "ü", "a\\b", 'a"b', "a\nb", "a<b>&", "a:b", "a\\", "a\\\\b", "x/y", "[0]", "#", "%s"]
)
def test_names_are_read_back_as_they_are_or_refused_before_anything_is_written(
    tmp_path: Path, name: str, suffix: str
) -> None:
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


SQUARES = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], dtype=float)
CELLS = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
CUBE = np.vstack([np.column_stack([SQUARES[[0, 1, 4, 3]], np.full(4, z)]) for z in (0.0, 1.0)])


def save(path, *, points=SQUARES, cells=CELLS, kind="quad", tags=None, lines=((0, 1),)):
    """Write a small file with a region `block`, others of further tags, and a boundary `contact`, faults included."""
    points = np.column_stack([points, np.zeros(len(points))]) if points.shape[1] == 2 else points
    tags = [np.array(tags or [1] * len(cells)), np.full(len(lines), 2)]
    blocks = [(kind, np.asarray(cells)), *([("line", np.asarray(lines))] if lines else [])]
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


def test_region_drawn_clockwise_is_turned_round(tmp_path):
    mesh = read_mesh(save(tmp_path / "a.msh", cells=CELLS[:, ::-1]))
    x, y = mesh.p[:, mesh.t]
    assert np.all(np.sum(x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0), axis=0) > 0)


@pytest.mark.parametrize("order", [[4, 5, 6, 7, 0, 1, 2, 3], [3, 2, 1, 0, 7, 6, 5, 4]], ids=["upside down", "reversed"])
def test_hexahedra_inside_out_are_turned_round(order, tmp_path):
    path = save(tmp_path / "block.msh", points=CUBE, cells=[order], kind="hexahedron", lines=())
    assert build_space(read_mesh(path)).full.dx.sum() == pytest.approx(1.0)


RAISED = np.column_stack([SQUARES, np.arange(6.0)])
CROSSED = {"cells": np.array([[0, 1, 4, 3], [1, 5, 2, 4]])}
# Each region is drawn one way round, and so turned round as a whole; where they meet tells that one is folded.
FLAP = {
    "points": np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.2, 0.2]]),
    "cells": np.array([[0, 1, 2], [1, 2, 3]]),
    "kind": "triangle",
    "tags": [1, 3],
}
FLAT = {
    "points": np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]),
    "cells": np.array([[0, 1, 2, 3], [0, 1, 2, 4]]),
    "kind": "tetra",
    "lines": (),
}
TWISTED = {"points": CUBE, "cells": [[0, 1, 2, 3, 5, 4, 7, 6]], "kind": "hexahedron", "lines": ()}


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
        (
            {"cells": np.arange(6)[None], "kind": "wedge"},
            "m",
            "has cells of type wedge, needs cells of one of the types",
        ),
        (FLAP, "m", "has cells that fold over each other: 0 and 1 at x = 500 mm, y = 500 mm, "),
        (FLAP, "mm", "has cells that fold over each other: 0 and 1 at x = 0.5 mm, y = 0.5 mm, "),
        (FLAT, "m", r"cell 1 at x = 500 mm, y = 500 mm, z = 0 mm is inverted or flat, .* volume"),
        (TWISTED, "m", r"cell 0 at x = 500 mm, y = 500 mm, z = 500 mm is inverted or flat, .* volume"),
    ],
)
def test_faulty_meshes_are_one_clear_error(change, unit, message, tmp_path):
    path = save(tmp_path / "faulty.msh", **change)
    with pytest.raises(MeshError, match=rf"faulty.msh: .*{message}"):
        read_mesh(path, unit)


def test_inverted_cell_in_a_file_of_our_own(tmp_path):
    crossed = skfem.MeshQuad1(SQUARES.T, CROSSED["cells"].T).with_subdomains({"all": np.array([0, 1])})
    write_mesh(crossed, tmp_path / "a.vtu")
    with pytest.raises(MeshError, match="cell 1 at x = 1500 mm"):
        read_mesh(tmp_path / "a.vtu")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.msh", None, "no such file"),
        *((name, "no mesh", "cannot be read") for name in ("a.msh", "a.xyz", "a.vtu")),
        ("a.vtk", {}, r"has no named groups.*in Gmsh as physical groups"),
        ("a.vtk", {"cells": CELLS[:1], "kind": "quad", "lines": ()}, "has no named groups"),
    ],
)
def test_files_that_hold_no_mesh(name, content, message, tmp_path, capfd):
    if isinstance(content, str):
        (tmp_path / name).write_text(content)
    elif content is not None:
        save(tmp_path / name, **content)
    with pytest.raises(MeshError, match=rf"{name}: {message}"):
        read_mesh(tmp_path / name)
    assert capfd.readouterr() == ("", "")


def test_mixed_cells_are_refused(tmp_path):
    blocks = [("quad", CELLS[:1]), ("triangle", np.array([[1, 2, 4]]))]
    meshio.write(tmp_path / "a.vtk", meshio.Mesh(np.column_stack([SQUARES, np.zeros(6)]), blocks))
    with pytest.raises(MeshError, match="has cells of type quad, triangle, needs"):
        read_mesh(tmp_path / "a.vtk")


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
    mesh = SQUARE.with_subdomains({name: np.arange(SQUARE.nelements)})
    with pytest.raises(MeshError, match=message):
        write_mesh(mesh, tmp_path / file)
