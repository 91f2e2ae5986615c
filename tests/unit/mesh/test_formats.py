"""Files of any format: errors say what is wrong, and nothing is printed."""

import errno
import os
from pathlib import Path

import meshio
import numpy as np
import pytest

from fingerslip.errors import MeshError, ResultError
from fingerslip.mesh.formats import read_file, write_file

CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
TRIANGLE = meshio.Mesh(CORNERS, [("triangle", np.array([[0, 1, 2]]))])
# The first bytes of what each suffix is written as: binary, and Gmsh's version two.
STARTS = {".stl": b"\0", ".ply": b"ply", ".vtu": b"<?xml", ".msh": b"$MeshFormat\n2.2"}


@pytest.mark.parametrize("suffix", STARTS)
def test_what_is_written_is_read_back(tmp_path: Path, suffix: str, capfd: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / f"triangle{suffix}"
    write_file(file, TRIANGLE, ".stl")
    np.testing.assert_allclose(read_file(file, "needs a file").points, CORNERS)
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
def test_missing_damaged_and_cut_files_are_named(
    tmp_path: Path, name: str, content: bytes | None, message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / name
    for path in {file, file.with_suffix(".ele") if file.suffix == ".node" else file} if content is not None else ():
        path.write_bytes(content)
    with pytest.raises(MeshError, match=rf"{name}: {message}"):
        read_file(file, "needs a surface")
    assert capfd.readouterr() == ("", "")


def test_a_text_of_triangles_and_a_point_that_no_cell_uses_are_read(tmp_path: Path) -> None:
    (tmp_path / "whole.wkt").write_text(f"TIN ({WHOLE})")
    assert len(read_file(tmp_path / "whole.wkt", "").cells_dict["triangle"]) == 30
    points = np.vstack([CORNERS, np.full(3, np.nan)])
    meshio.write(tmp_path / "good.vtu", meshio.Mesh(points, [("triangle", [[0, 1, 2]])]))
    assert len(read_file(tmp_path / "good.vtu", "").points) == 4


def test_unknown_suffixes_and_folders_are_named(tmp_path: Path) -> None:
    for name, message in (
        ("a.nix", r"a\.nix: cannot be written .*, needs a suffix such as \.stl, \.ply"),
        ("none/a.stl", "the folder does not exist"),
    ):
        with pytest.raises(MeshError, match=message):
            write_file(tmp_path / name, TRIANGLE, ".stl, .ply")


@pytest.mark.parametrize(("name", "count"), [("a.stl", 1), ("a.xdmf", 2)])
def test_a_file_that_is_not_written_to_its_end_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, count: int
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
def test_numbers_that_do_not_fit_together_are_named(tmp_path: Path, points, nodes, message: str) -> None:
    meshio.write(tmp_path / "bad.vtu", meshio.Mesh(points, [("triangle", [nodes])]))
    with pytest.raises(MeshError, match=rf"bad\.vtu: {message}"):
        read_file(tmp_path / "bad.vtu", "needs a mesh file")
