"""Rows that are stored and read back: one way for all parts of the validation."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import pytest

from fingerslip.errors import DamagedError, ResultError
from fingerslip.storage.files import write_json
from fingerslip.validation.rows import RowFile, stored_rows
from places import ROOT


@dataclass(frozen=True)
class One:
    """A row."""

    name: str
    span: tuple[float, float]


FILE = RowFile("ones.json", "ones", "fingerslip validate --ones", "an hour", ("wang2014_friction",), One)
ROWS = (One("a", (1.0, 2.0)),)


def test_computed_rows_are_stored_and_read_back(tmp_path: Path) -> None:
    made = stored_rows(FILE, ROOT / "studies", tmp_path, lambda: ROWS)
    assert (made.rows, made.origin, made.computed) == (ROWS, "", True)
    again = stored_rows(FILE, ROOT / "studies", tmp_path)
    assert (again.rows, again.computed) == (ROWS, False)
    assert again.origin.startswith(f"Ones are stored in {tmp_path / 'ones.json'} by fingerslip")
    assert "the studies are the same" in again.origin


def test_rows_say_that_studies_have_changed(tmp_path: Path) -> None:
    stored_rows(FILE, ROOT / "studies", tmp_path, lambda: ROWS)
    (tmp_path / "wang2014_friction.yaml").write_text("title: another\n")
    assert "the studies have changed since" in stored_rows(FILE, tmp_path, tmp_path).origin


def test_rows_say_that_runs_are_read_in_another_way(tmp_path: Path) -> None:
    read = dataclasses.replace(FILE, reading={"tolerance [m]": 50e-6})
    stored_rows(read, ROOT / "studies", tmp_path, lambda: ROWS)
    assert "the studies are the same" in stored_rows(read, ROOT / "studies", tmp_path).origin
    for reading in ({"tolerance [m]": 20e-6}, {}):
        other = dataclasses.replace(FILE, reading=reading)
        assert "how their runs are read has changed since" in stored_rows(other, ROOT / "studies", tmp_path).origin
    (tmp_path / "wang2014_friction.yaml").write_text("title: another\n")
    assert "the studies have changed since" in stored_rows(read, tmp_path, tmp_path).origin


def test_own_rows_come_before_those_that_ship(tmp_path: Path) -> None:
    (tmp_path / "reference").mkdir()
    stored_rows(FILE, ROOT / "studies", tmp_path / "reference", lambda: ROWS)
    assert str(tmp_path / "reference") in stored_rows(FILE, ROOT / "studies", tmp_path).origin
    stored_rows(FILE, ROOT / "studies", tmp_path, lambda: ROWS)
    assert str(tmp_path / "ones.json") in stored_rows(FILE, ROOT / "studies", tmp_path).origin


def test_nothing_stored_says_what_to_do(tmp_path: Path) -> None:
    found = stored_rows(FILE, tmp_path, tmp_path)
    assert found.rows == ()
    assert found.origin == "No ones are stored; fingerslip validate --ones computes them, which takes an hour."


@pytest.mark.parametrize("text", ["{broken", "{}"])
def test_damaged_files_say_what_makes_them_again(tmp_path: Path, text: str) -> None:
    (tmp_path / "ones.json").write_text(text)
    with pytest.raises(DamagedError, match="run fingerslip validate --ones"):
        stored_rows(FILE, tmp_path, tmp_path)


@pytest.mark.parametrize(
    "content",
    [
        {"rows": [{"name": "alone"}], "made": {"version": "0", "inputs": {}}},
        {"rows": [], "made": "fingerslip validate --ones"},
        {"made": {"version": "0", "inputs": {}}},
    ],
)
def test_rows_of_another_version_are_refused(tmp_path: Path, content: dict[str, object]) -> None:
    write_json(tmp_path / "ones.json", content)
    with pytest.raises(ResultError, match=r"ones.json: is of another version \(.*\); run fingerslip validate --ones"):
        stored_rows(FILE, tmp_path, tmp_path)
