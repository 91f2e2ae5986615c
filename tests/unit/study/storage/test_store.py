"""The folder of a run and its bases: what tells inputs apart, which programs made it, what is read back."""

from __future__ import annotations

import dataclasses
import json
import logging
import os
import platform
import shutil
import subprocess
import threading
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skfem

from fingerslip.errors import ResultError
from fingerslip.history import read_history
from fingerslip.results import RUN
from fingerslip.slip import find_events, measures
from fingerslip.slip.measures import Measure
from fingerslip.study.running.plan import plan_study
from fingerslip.study.storage import store
from fingerslip.study.storage.store import (
    BasisFolder,
    commit,
    identity,
    mesh_hash,
    mesh_size,
    read_run,
    versions,
    write_run,
)
from unit.study.block import block_mesh, block_values
from unit.synthetic import Process, make

Write = Callable[..., Path]


@pytest.fixture
def folder(write_study: Write, tmp_path: Path) -> Path:
    """Return the folder of a run that was written without computing it."""
    run = plan_study(write_study()).runs[1]
    folder = tmp_path / run.name
    folder.mkdir()
    write_run(folder, run, make(Process()), inputs="abc", mesh=block_mesh(), seconds=1.2345)
    return folder


def test_what_is_written_is_read_back_with_all_values(folder: Path) -> None:
    result = read_run(folder, {"slip.overall": 0.01})
    assert sorted(path.name for path in folder.iterdir()) == ["events.json", "history.nc", "run.yaml"]
    assert (result.name, result.identity, result.seconds) == ("friction_coefficient-0.4", "abc", 1.234)
    assert result.swept == {"contact.friction_coefficient": 0.4}
    assert result.events == find_events(read_history(folder / "history.nc"))
    assert result.values["programme.0.press.depth"] == "0.0001 m"
    assert result.values["materials.block.poisson_ratio"] == 0.3
    assert result.uncertainty == {"slip.overall": 0.01}
    assert result.mesh_hash == mesh_hash(block_mesh())
    assert result.mesh_size == mesh_size(block_mesh()) == pytest.approx(32 ** (-1 / 2))


def test_a_changed_run_yaml_is_not_taken_for_that_of_the_run(folder: Path) -> None:
    text = (folder / RUN).read_text()
    (folder / RUN).write_text(text.replace("0.0001 m", "0.0002 m"))
    with pytest.raises(ResultError, match=r"friction_coefficient-0\.4/run\.yaml: is damaged.*; run the study again"):
        read_run(folder, {})


@pytest.mark.parametrize("name", ["events.json", "history.nc"])
def test_a_run_that_lacks_a_file_is_no_finished_run(folder: Path, name: str) -> None:
    (folder / name).unlink()
    with pytest.raises(ResultError, match=r"friction_coefficient-0\.4: holds no finished run; run the study again"):
        read_run(folder, {})


def test_a_damaged_run_yaml_is_named(folder: Path) -> None:
    (folder / RUN).write_text("a: [")
    with pytest.raises(ResultError, match=r"friction_coefficient-0\.4/run\.yaml"):
        read_run(folder, {})


def test_an_added_measure_is_in_the_file_and_in_the_log(
    write_study: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    added = Measure("slides", "number of slides", lambda history: int((history["phase_kind"] == "slide").sum()))
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    with caplog.at_level(logging.INFO, "fingerslip"):
        write_run(
            tmp_path, plan_study(write_study()).runs[0], make(Process()), inputs="a", mesh=block_mesh(), seconds=1.0
        )
    assert json.loads((tmp_path / "events.json").read_text())["numbers"]["slides"] == 1
    assert "number of slides: 1" in caplog.messages
    assert "largest normal force: 0.4 N" in caplog.messages


def test_contact_at_a_free_edge_is_a_warning_in_the_log(
    write_study: Write, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    run = plan_study(write_study()).runs[0]
    history = make(Process())
    ending = history.assign_coords(contact_edge_distance=("contact_node", np.zeros(history.sizes["contact_node"])))
    write_run(tmp_path, run, ending, inputs="a", mesh=block_mesh(), seconds=1.0)
    (record,) = (record for record in caplog.records if record.levelno == logging.WARNING)
    assert "friction_coefficient-0.2 ('skin' from" in record.getMessage()
    assert json.loads((tmp_path / "events.json").read_text())["edge_contact"]["distance_m"] == 0.0
    caplog.clear()
    write_run(tmp_path, run, history, inputs="a", mesh=block_mesh(), seconds=1.0)
    assert not [record for record in caplog.records if record.levelno == logging.WARNING]


def test_identity_changes_with_values_and_mesh_but_not_with_the_title(write_study: Write) -> None:
    def first(values: dict[str, object], **more: float) -> str:
        return identity(plan_study(write_study(block_values() | values, **more)).runs[0])

    base = first({})
    assert first({"title": "another"}) == base
    assert len({base, first({"depth": "2 mm"}), first({}, curvature=1.0)}) == 3


def test_mesh_hash_sees_points_and_cells_and_nothing_else() -> None:
    mesh = block_mesh()
    assert mesh_hash(mesh) == mesh_hash(block_mesh())
    assert mesh_hash(mesh.with_boundaries({"other": np.array([0])})) == mesh_hash(mesh)
    moved = mesh.p.copy()
    moved[1, 7] += 1e-8  # a millionth of the size
    assert mesh_hash(skfem.MeshQuad(moved, mesh.t)) != mesh_hash(mesh)
    assert mesh_hash(skfem.MeshQuad(mesh.p, mesh.t[:, ::-1])) != mesh_hash(mesh)


def test_a_mesh_has_one_hash_on_processors_that_round_otherwise() -> None:
    mesh = skfem.MeshTri().refined(4).scaled(7e-3)
    hashes = {mesh_hash(dataclasses.replace(mesh, doflocs=points)) for points in (mesh.p, np.nextafter(mesh.p, 1.0))}
    assert len(hashes) == 1
    assert mesh_hash(dataclasses.replace(mesh, doflocs=mesh.p * [[1.0], [1.001]])) not in hashes


def test_versions_are_those_that_run() -> None:
    found = versions()
    assert found["python"] == platform.python_version()
    assert found["numpy"] == np.__version__
    assert found["fingerslip"] == metadata.version("fingerslip")
    assert {"scikit-fem", "gmsh", "scipy", "xarray"} <= set(found)


def test_packages_that_are_not_installed_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = metadata.version

    def version(name: str) -> str:
        if name == "mkl":
            raise metadata.PackageNotFoundError(name)
        return whole(name)

    monkeypatch.setattr(metadata, "version", version)
    found = store.versions.__wrapped__()
    assert "mkl" not in found
    assert "scipy" in found


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a git repository with one commit in which the package seems to be."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    module = tmp_path / "src" / "fingerslip" / "study" / "storage" / "store.py"
    module.parent.mkdir(parents=True)
    module.write_text("")
    who = ["-c", "user.name=nobody", "-c", "user.email=nobody@example.org", "-c", "commit.gpgsign=false"]
    for arguments in (["init", "-q"], ["add", "."], [*who, "commit", "-q", "-m", "first"], ["tag", "v1.0"]):
        subprocess.run(["git", "-C", str(tmp_path), *arguments], check=True)
    monkeypatch.setattr(store, "__file__", str(module))
    return tmp_path


def test_commit_is_the_whole_hash_and_says_when_files_were_changed(checkout: Path) -> None:
    """A tag on the commit must not stand in for its hash."""
    command = ["git", "-C", str(checkout), "rev-parse", "HEAD"]
    head = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    assert commit() == head
    (checkout / "src" / "fingerslip" / "study" / "storage" / "store.py").write_text("changed")
    assert commit() == f"{head}-dirty"


def test_outside_a_checkout_there_is_no_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "__file__", str(tmp_path / "a" / "b" / "c" / "store.py"))
    assert commit() is None


@pytest.mark.parametrize("error", [FileNotFoundError("git"), subprocess.TimeoutExpired("git", 10)])
def test_without_a_git_that_answers_there_is_no_commit(
    checkout: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def run(*_: object, **__: object) -> Any:
        raise error

    monkeypatch.setattr(subprocess, "run", run)
    assert commit() is None


ARRAYS = {"eigenvalues": np.array([1.0, 2.5]), "interface": np.array([3, 4]), "shapes": np.zeros((4, 0))}


@pytest.fixture
def bases(tmp_path: Path) -> BasisFolder:
    return BasisFolder(tmp_path / "study" / ".bases")


def test_arrays_are_read_back_as_they_were(bases: BasisFolder) -> None:
    bases.save("one", ARRAYS)
    found = bases.load("one")
    assert found is not None
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(found[name], array)
        assert found[name].dtype == array.dtype


def test_an_unknown_key_has_nothing_and_makes_no_folder(bases: BasisFolder) -> None:
    assert bases.load("other") is None
    assert not bases.folder.exists()


@pytest.mark.parametrize(
    "damage", [lambda b: b[:-3], lambda b: b[:100] + b"x" + b[101:], lambda _: b"", lambda _: b"\xff" * 200]
)
def test_a_damaged_file_is_not_used_and_replaced(bases: BasisFolder, damage, caplog: pytest.LogCaptureFixture) -> None:
    bases.save("one", ARRAYS)
    (file,) = bases.folder.iterdir()
    file.write_bytes(damage(file.read_bytes()))
    caplog.set_level(logging.WARNING, "fingerslip")
    assert bases.load("one") is None
    assert str(file) in caplog.text
    assert "the basis is made again" in caplog.text
    bases.save("one", ARRAYS)
    assert bases.load("one") is not None


def test_only_the_newest_are_kept(bases: BasisFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "_MOST_BASES", 2)
    for age, key in enumerate(["a", "b", "c"]):
        bases.save(key, ARRAYS)
        os.utime(bases.folder / f"{key}.basis", (1e9 + age, 1e9 + age))
    bases.save("d", ARRAYS)
    assert sorted(path.name for path in bases.folder.iterdir()) == ["c.basis", "d.basis"]


def test_a_folder_that_cannot_be_written_is_told_and_no_error(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "file").write_text("")
    caplog.set_level(logging.WARNING, "fingerslip")
    BasisFolder(tmp_path / "file" / "inside").save("one", ARRAYS)
    assert "the basis is not kept" in caplog.text


def test_whoever_makes_a_basis_is_alone(bases: BasisFolder) -> None:
    inside, came = threading.Event(), list[bool]()

    def take() -> None:
        with bases.alone("one"):
            came.append(inside.is_set())

    with bases.alone("one"):
        waiting = threading.Thread(target=take)
        waiting.start()
        waiting.join(0.2)
        assert waiting.is_alive()
        inside.set()
    waiting.join(10.0)
    assert came == [True]
    assert not bases.folder.exists()


def test_where_no_lock_can_be_had_nobody_waits(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with BasisFolder(tmp_path / "file" / "inside").alone("one"):
        assert (tmp_path / "file").is_file()
