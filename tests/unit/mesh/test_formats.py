"""Files of any format: errors say what is wrong, and nothing is printed."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import meshio
import numpy as np
import pytest

from fingerslip.errors import MeshError, ResultError
from fingerslip.mesh.formats import read_file, write_file

TRIANGLE = meshio.Mesh(np.eye(3), [("triangle", np.array([[0, 1, 2]]))])


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".vtu", ".msh"])
def test_what_is_written_is_read_back(tmp_path: Path, suffix: str, capfd: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / f"triangle{suffix}"
    write_file(file, TRIANGLE, ".stl")
    np.testing.assert_allclose(read_file(file, "needs a file").points, np.eye(3))
    assert capfd.readouterr() == ("", "")


def test_stl_is_binary_and_msh_of_version_two(tmp_path: Path) -> None:
    write_file(tmp_path / "a.stl", TRIANGLE, ".stl")
    assert not (tmp_path / "a.stl").read_bytes().startswith(b"solid")
    write_file(tmp_path / "a.msh", TRIANGLE, ".msh")
    assert b"2.2" in (tmp_path / "a.msh").read_bytes()[:30]


def test_missing_and_damaged_files_are_named(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(MeshError, match=r"none\.stl: no such file, needs a surface"):
        read_file(tmp_path / "none.stl", "needs a surface")
    (tmp_path / "bad.stl").write_text("nothing")
    with pytest.raises(MeshError, match=r"bad\.stl: cannot be read \(.+\), needs a surface"):
        read_file(tmp_path / "bad.stl", "needs a surface")
    (tmp_path / "empty.stl").touch()
    with pytest.raises(MeshError, match=r"empty\.stl: is empty, needs a surface; look whether it is whole, and export"):
        read_file(tmp_path / "empty.stl", "needs a surface")
    (tmp_path / "bad.nix").write_text("nothing")
    with pytest.raises(MeshError, match=r"bad\.nix: cannot be read"):
        read_file(tmp_path / "bad.nix", "needs a surface")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n"),
        ("a.off", b"OFF\n# made by\n"),
        ("a.nas", b"CEND\nBEGIN BULK\n"),
        ("a.mdpa", b"Begin Nodes\n1 0 0 0\n"),
        ("a.node", b"# nodes\n"),
        ("a.msh", b'(1 "meshio")\n(2 3)\n(10 (1 1 8 1 3)('),
        ("a.msh", b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n$NodeData\n99999999999\n"),
    ],
)
def test_a_file_that_ends_in_its_header_is_refused(tmp_path: Path, name: str, content: bytes) -> None:
    for file in {tmp_path / name, (tmp_path / name).with_suffix(".ele" if name == "a.node" else Path(name).suffix)}:
        file.write_bytes(content)
    with pytest.raises(MeshError, match=r"cannot be read \(.*it ends too early.*look whether it is whole"):
        read_file(tmp_path / name, "needs a mesh")


def test_a_text_of_triangles_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    triangles = ", ".join(["((0.125 0.25 0.5, 1.125 0.25 0.5, 0.125 1.25 0.5, 0.125 0.25 0.5))"] * 30)
    (tmp_path / "whole.wkt").write_text(f"TIN ({triangles})")
    assert len(read_file(tmp_path / "whole.wkt", "").cells_dict["triangle"]) == 30
    (tmp_path / "cut.wkt").write_text(f"TIN ({triangles}")
    with pytest.raises(MeshError, match=r"cannot be read"):
        read_file(tmp_path / "cut.wkt", "needs a mesh")


def test_unknown_suffixes_and_folders_are_named(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"a\.nix: cannot be written .*, needs a suffix such as \.stl, \.ply"):
        write_file(tmp_path / "a.nix", TRIANGLE, ".stl, .ply")
    with pytest.raises(MeshError, match="the folder does not exist"):
        write_file(tmp_path / "none" / "a.stl", TRIANGLE, ".stl")


@pytest.mark.parametrize("name", ["a.stl", "a.xdmf"])
def test_a_file_that_is_not_written_to_its_end_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    write_file(tmp_path / name, TRIANGLE, ".stl")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    write = meshio.write

    def full(file: Path, data: meshio.Mesh, **options: object) -> None:
        write(file, meshio.Mesh(2.0 * data.points, data.cells), **options)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(meshio, "write", full)
    with pytest.raises(ResultError, match=r"No space left on device.*free some space"):
        write_file(tmp_path / name, TRIANGLE, ".stl")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    assert len(before) == (2 if name == "a.xdmf" else 1)


CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


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
def test_numbers_that_do_not_fit_together_are_named(tmp_path: Path, points, nodes, message: str) -> None:
    meshio.write(tmp_path / "bad.vtu", meshio.Mesh(points, [("triangle", [nodes])]))
    with pytest.raises(MeshError, match=rf"bad\.vtu: {message}"):
        read_file(tmp_path / "bad.vtu", "needs a mesh file")


def test_a_point_that_no_cell_uses_may_be_anything(tmp_path: Path) -> None:
    points = np.vstack([CORNERS, np.full(3, np.nan)])
    meshio.write(tmp_path / "good.vtu", meshio.Mesh(points, [("triangle", [[0, 1, 2]])]))
    assert len(read_file(tmp_path / "good.vtu", "").points) == 4
