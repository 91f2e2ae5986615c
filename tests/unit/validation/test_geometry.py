"""What the unknown geometry allows: intervals beside published times, stored and read back."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest

from fingerslip.results import StudyResult
from fingerslip.study.definition.spec import read_study
from fingerslip.tables.table import texts, to_markdown
from fingerslip.validation import rows as geometry
from fingerslip.validation.measures import SOLID_READINGS
from fingerslip.validation.rows import (
    GEOMETRY,
    GeometryRow,
    allowed_geometry,
    geometry_rows,
    geometry_table,
    rows_mapping,
)
from places import ROOT
from unit.sampled import study_of

ROWS = (
    GeometryRow("overall slip", "Table 2", 1.71, (1.5, 1.55, 1.6, 1.7, 1.8), "within, at 97 %", 50, 50),
    GeometryRow("incipient slip", "Table 2", (1.63, 1.65), None, "", 0, 50),
)


def section(folder: Path) -> StudyResult:
    return dataclasses.replace(study_of(), folder=folder / "wang2014_geometry")


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[list[Path]]:
    """Replace the runs of both studies by the samples of the section."""
    asked: list[list[Path]] = []

    def fake(paths: list[Path], **_: Any) -> tuple[StudyResult, ...]:
        asked.append(paths)
        return (section(tmp_path),)

    monkeypatch.setattr(geometry, "run_studies", fake)
    return asked


def test_rows_name_model_and_reading(tmp_path: Path) -> None:
    rows = geometry_rows(section(tmp_path))
    assert [row.quantity for row in rows] == [
        f"{time}, original, section (accumulated slip)" for time in ("incipient slip", "overall slip", "latency")
    ]
    overall = rows[1]
    assert overall.published == 1.71
    assert overall.interval is not None
    assert list(overall.interval) == sorted(overall.interval)
    assert (overall.found, overall.samples) == (12, 12)


def test_runs_in_space_are_read_at_the_reference_nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Path] = []

    def fake(folder: Path, run: Any) -> Any:
        read.append(folder)
        return type("Measured", (), {"run": run})

    monkeypatch.setattr(geometry, "solid_measures", fake)
    study = dataclasses.replace(study_of(compare="wang2014-solid"), folder=tmp_path / "wang2014_geometry_3d")
    rows = geometry_rows(study)
    assert read == [study.folder / run.name for run in study.runs]
    assert rows[0].quantity == f"incipient slip, in 3D ({SOLID_READINGS['slip']})"


@pytest.mark.usefixtures("ran")
def test_computed_rows_are_stored_and_read_back(tmp_path: Path, ran: list[list[Path]]) -> None:
    made = allowed_geometry(ROOT / "studies", tmp_path, compute=True)
    assert [path.stem for path in ran[0]] == list(GEOMETRY)
    again = allowed_geometry(ROOT / "studies", tmp_path)
    assert (made.rows, made.computed) == (again.rows, True)
    assert (len(ran), again.computed) == (1, False)


def test_table_has_a_row_for_each_published_time() -> None:
    table = geometry_table(ROWS, "Stored.")
    assert texts(table) == [
        ["overall slip", "Table 2", "1.71", "1.500", "1.550", "1.600", "1.700", "1.800", "within, at 97 %", "50 of 50"],
        ["incipient slip", "Table 2", "1.63 to 1.65", *["none"] * 5, "n/a", "0 of 50"],
    ]
    assert "below '5 %'" in table.note
    assert table.note.endswith("Stored.")
    assert json.loads(json.dumps(rows_mapping(ROWS)))[1]["published"] == [1.63, 1.65]


@pytest.mark.parametrize("name", GEOMETRY)
def test_every_range_of_the_shipped_studies_has_its_reason(name: str) -> None:
    path = ROOT / "studies" / f"{name}.yaml"
    sample = read_study(path).sample
    assert sample is not None
    lines = path.read_text(encoding="utf-8").splitlines()
    numbers = [lines.index(next(line for line in lines if line.strip().startswith(f"{one}:"))) for one in sample.ranges]
    without = [lines[number] for number in numbers if not lines[number - 1].strip().startswith("#")]
    assert [line.split(":")[0].strip() for line in without] in ([], ["fingertip.ridges.limiting_height"])
    assert sample.count >= len(sample.ranges) + 15


def test_reference_tables_and_intervals_are_the_same() -> None:
    rows = allowed_geometry(ROOT / "studies", ROOT / "results").rows
    assert rows
    page = (ROOT / "results" / "reference" / "geometry.md").read_text(encoding="utf-8")
    assert to_markdown(geometry_table(rows)) in page
