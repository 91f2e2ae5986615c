"""Finished parts are read back where they are of the same inputs and undamaged, and nowhere else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.detect.evaluation.crossval import Parts, parts_beside
from fingerslip.errors import InputError

ONE = {"rows": np.arange(5), "chances": np.linspace(0.0, 1.0, 6).reshape(2, 3)}


def test_a_part_is_made_once(tmp_path: Path) -> None:
    made = []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return ONE

    parts = parts_beside(tmp_path / "tables", "data")
    first, second = (parts.part("forest", [1, "a"], make) for _ in range(2))
    assert len(made) == 1
    for found in (first, second):
        assert found.keys() == ONE.keys()
        assert all(np.array_equal(found[name], ONE[name]) for name in ONE)
    assert parts.folder == tmp_path / "tables.unfinished"
    parts.remove()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("data", "name", "inputs"), [("other", "forest", [1]), ("data", "logistic", [1]), ("data", "forest", [2])]
)
def test_other_inputs_are_another_part(tmp_path: Path, data: str, name: str, inputs: list[int]) -> None:
    parts_beside(tmp_path / "tables", "data").keep("forest", [1], ONE)
    assert parts_beside(tmp_path / "tables", "data").kept("forest", [1]) is not None
    assert parts_beside(tmp_path / "tables", data).kept(name, inputs) is None


@pytest.mark.parametrize("damage", ["cut", "changed", "foreign", "empty"])
def test_a_damaged_part_is_made_again(tmp_path: Path, damage: str) -> None:
    parts = Parts(tmp_path, "data")
    parts.keep("forest", [1], ONE)
    (path,) = tmp_path.iterdir()
    content = path.read_bytes()
    if damage == "cut":
        path.write_bytes(content[: len(content) // 2])
    elif damage == "changed":
        np.savez(path, checksum=np.array("0"), **ONE)
    else:
        path.write_bytes(b"" if damage == "empty" else b"no arrays")
    assert parts.kept("forest", [1]) is None


def test_what_would_run_when_it_is_read_is_not_read(tmp_path: Path) -> None:
    parts = Parts(tmp_path, "data")
    parts.keep("forest", [1], ONE)
    (path,) = tmp_path.iterdir()
    np.savez(path, checksum=np.array("0"), rows=np.array([print], dtype=object))
    assert parts.kept("forest", [1]) is None


def test_without_a_folder_nothing_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    parts = parts_beside(None)
    assert parts.part("forest", 1, lambda: ONE).keys() == ONE.keys()
    assert parts.kept("forest", 1) is None
    parts.remove()
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_no_folder_for_what_is_to_be_written(tmp_path: Path) -> None:
    (tmp_path / "tables").write_text("mine")
    with pytest.raises(InputError, match="is a file, needs a folder"):
        parts_beside(tmp_path / "tables")
