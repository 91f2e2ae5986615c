"""The specimen of a study or of a preset: its mesh and its picture."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

from fingerslip.errors import InputError, ResultError
from fingerslip.mesh.io import read_mesh
from fingerslip.mesh.quality import quality_table
from fingerslip.study.inspection.check import draw_specimen, save_mesh
from unit.scans import mesh_of_a_scan, scan_values
from unit.study.block import block_values

Write = Callable[..., Path]


def test_mesh_of_the_first_run_of_a_study(write_study: Write, tmp_path: Path) -> None:
    (table,) = save_mesh(str(write_study()), tmp_path / "copy.msh")
    mesh = read_mesh(tmp_path / "copy.msh")
    assert mesh.p.shape[1] == 45
    assert set(mesh.boundaries) == {"bottom", "top"}
    assert table.note == "45 nodes, 32 cells; boundaries: bottom, top"
    # Rectangles of 1.25 mm by 1.25 mm.
    ((region, cells, jacobian, smallest, largest, aspect),) = table.rows
    assert (region, cells) == ("block", 32)
    assert (jacobian, smallest, largest, aspect) == pytest.approx((1.0, 90.0, 90.0, 1.0))


def test_mesh_of_a_preset_goes_to_its_own_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (table,) = save_mesh("wang2014-2d")
    mesh = read_mesh(tmp_path / "meshes" / "wang2014-2d.msh")
    assert table.title == str(Path("meshes") / "wang2014-2d.msh")
    assert [row[0] for row in table.rows] == ["epidermis", "dermis", "tissue", "phalanx"]
    for row, known in zip(table.rows, quality_table(mesh), strict=True):
        assert row[3:5] == pytest.approx(np.degrees([known.smallest_angle, known.largest_angle]))


def test_mesh_of_a_study_goes_to_the_name_of_the_study(
    write_study: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    save_mesh(str(write_study(block_values() | {"sweep": {}}, name="mine")))
    assert (tmp_path / "meshes" / "mine.msh").is_file()


def test_what_is_neither_a_study_nor_a_preset_is_refused() -> None:
    with pytest.raises(InputError, match=r"mesh wang2014-2e: is neither .*; did you mean 'wang2014-2d'"):
        save_mesh("wang2014-2e")
    with pytest.raises(InputError, match=r"mesh nix: is neither a preset nor a study file, .*; presets: wang2014-2d"):
        save_mesh("nix")


def test_a_place_that_cannot_be_written_is_named(write_study: Write, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ResultError, match=r"file/copy\.msh: cannot be written"):
        save_mesh(str(write_study()), tmp_path / "file" / "copy.msh")


def test_mesh_of_a_scan_is_written_for_paraview_with_its_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = mesh_of_a_scan()
    for name in ("skin.stl", "phalanx.stl"):
        (tmp_path / name).write_text(name)
    monkeypatch.setattr("fingerslip.mesh.scan.build.mesh_scan", lambda _: made)
    monkeypatch.setattr("fingerslip.mesh.scan.build.scan_cells", lambda _: 1e4)
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "finger.yaml"
    path.write_text(yaml.safe_dump(scan_values()), encoding="utf-8")
    tables = save_mesh(str(path))
    assert [table.title for table in tables][1:] == ["Distance of the mesh from the scan", "Repairs"]
    assert tables[0].title == str(Path("meshes") / "finger.vtu")
    back = read_mesh(tmp_path / "meshes" / "finger.vtu")
    assert set(back.boundaries) == {"skin"}
    assert len(back.subdomains["tissue"]) == 5


def test_preset_and_study_are_drawn(tmp_path: Path) -> None:
    study = tmp_path / "study.yaml"
    study.write_text("fingertip: {preset: wang2014-2d}\ntime: {step: 5 ms, end: 10 ms}\n", encoding="utf-8")
    for number, target in enumerate(("wang2014-3d", "tactip-ridged-3d", str(study))):
        picture = tmp_path / "new" / f"{number}.png"
        draw_specimen(target, picture)
        assert picture.read_bytes().startswith(b"\x89PNG")


def test_what_cannot_be_drawn_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"needs a file that ends in \.png, \.svg, \.pdf"):
        draw_specimen("wang2014-3d", tmp_path / "finger.doc")
    with pytest.raises(InputError, match="preset: 'nobody' is not known"):
        draw_specimen("nobody", tmp_path / "finger.png")
