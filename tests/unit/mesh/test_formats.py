"""Files of any format: errors say what is wrong, and nothing is printed."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from fingerslip.errors import MeshError
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
    (tmp_path / "bad.nix").write_text("nothing")
    with pytest.raises(MeshError, match=r"bad\.nix: cannot be read"):
        read_file(tmp_path / "bad.nix", "needs a surface")
    assert capfd.readouterr() == ("", "")


def test_unknown_suffixes_and_folders_are_named(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"a\.nix: cannot be written .*, needs a suffix such as \.stl, \.ply"):
        write_file(tmp_path / "a.nix", TRIANGLE, ".stl, .ply")
    with pytest.raises(MeshError, match="the folder does not exist"):
        write_file(tmp_path / "none" / "a.stl", TRIANGLE, ".stl")
