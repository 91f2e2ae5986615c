"""A basis on disk is read back as it was, or not at all."""

from __future__ import annotations

import logging
import os
import threading
from pathlib import Path

import numpy as np
import pytest

from fingerslip.study.storage import bases
from fingerslip.study.storage.bases import BasisFolder

ARRAYS = {"eigenvalues": np.array([1.0, 2.5]), "interface": np.array([3, 4]), "shapes": np.zeros((4, 0))}


@pytest.fixture
def folder(tmp_path: Path) -> BasisFolder:
    return BasisFolder(tmp_path / "study" / ".bases")


def test_arrays_are_read_back_as_they_were(folder: BasisFolder) -> None:
    folder.save("one", ARRAYS)
    found = folder.load("one")
    assert found is not None
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(found[name], array)
        assert found[name].dtype == array.dtype


def test_an_unknown_key_has_nothing_and_makes_no_folder(folder: BasisFolder) -> None:
    assert folder.load("other") is None
    assert not folder.folder.exists()


@pytest.mark.parametrize(
    "damage", [lambda b: b[:-3], lambda b: b[:100] + b"x" + b[101:], lambda _: b"", lambda _: b"\xff" * 200]
)
def test_a_damaged_file_is_not_used_and_replaced(folder: BasisFolder, damage, caplog: pytest.LogCaptureFixture) -> None:
    folder.save("one", ARRAYS)
    (file,) = folder.folder.iterdir()
    file.write_bytes(damage(file.read_bytes()))
    caplog.set_level(logging.WARNING, "fingerslip")
    assert folder.load("one") is None
    assert str(file) in caplog.text
    assert "the basis is made again" in caplog.text
    folder.save("one", ARRAYS)
    assert folder.load("one") is not None


def test_only_the_newest_are_kept(folder: BasisFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bases, "_KEPT", 2)
    for age, key in enumerate(["a", "b", "c"]):
        folder.save(key, ARRAYS)
        os.utime(folder.folder / f"{key}.basis", (1e9 + age, 1e9 + age))
    folder.save("d", ARRAYS)
    assert sorted(path.name for path in folder.folder.iterdir()) == ["c.basis", "d.basis"]


def test_a_folder_that_cannot_be_written_is_told_and_no_error(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "file").write_text("")
    caplog.set_level(logging.WARNING, "fingerslip")
    BasisFolder(tmp_path / "file" / "inside").save("one", ARRAYS)
    assert "the basis is not kept" in caplog.text


def test_whoever_makes_a_basis_is_alone(folder: BasisFolder) -> None:
    inside, came = threading.Event(), list[bool]()

    def take() -> None:
        with folder.alone("one"):
            came.append(inside.is_set())

    with folder.alone("one"):
        waiting = threading.Thread(target=take)
        waiting.start()
        waiting.join(0.2)
        assert waiting.is_alive()
        inside.set()
    waiting.join(10.0)
    assert came == [True]
    assert not folder.folder.exists()


def test_where_no_lock_can_be_had_nobody_waits(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with BasisFolder(tmp_path / "file" / "inside").alone("one"):
        assert (tmp_path / "file").is_file()
