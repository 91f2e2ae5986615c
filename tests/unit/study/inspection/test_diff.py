"""Two runs side by side."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fingerslip.errors import ResultError
from fingerslip.study.inspection.show import diff_runs
from fingerslip.study.running.runner import run_study
from fingerslip.study.storage import reporting
from fingerslip.tables.table import Measured, Missing, Table
from unit.study.block import block_values

Write = Callable[..., Path]
FIRST, SECOND = "friction_coefficient-0.2", "friction_coefficient-0.6"


@pytest.fixture
def folder(write_study: Write, simulated: list[float], reports: list[tuple[str, ...]], tmp_path: Path) -> Path:
    """Return the results of a study of three runs; overall slip comes at 1.4 s + 0.5 s per unit of friction."""
    return run_study(write_study(), results_dir=tmp_path / "results", workers=1).folder


def rows_of(table: Table) -> dict[str, tuple[object, ...]]:
    return {str(row[0]): row[1:] for row in table.rows}


def test_only_the_values_that_differ_are_shown(folder: Path) -> None:
    values, _ = diff_runs(folder / FIRST, folder / SECOND)
    assert rows_of(values) == {"contact.friction_coefficient": ("0.2", "0.6")}
    assert values.note == f"A: {folder / FIRST}; B: {folder / SECOND}."


def test_results_stand_beside_their_differences(folder: Path) -> None:
    _, results = diff_runs(folder / FIRST, folder / SECOND)
    rows = rows_of(results)
    unit, first, second, difference = rows["overall slip (accumulated slip)"]
    assert unit == "s"
    assert (first, second) == (pytest.approx(1.5, abs=0.02), pytest.approx(1.7, abs=0.02))
    assert difference == pytest.approx(second - first, rel=1e-12)
    assert rows["latency (accumulated slip)"][0] == "ms"
    assert rows["friction over normal force at the end of the slide"][3] == pytest.approx(0.4)
    assert rows["records"][1:] == (401, 401, 0.0)
    assert results.marked == (), "without uncertainties no difference is clear"


def test_a_missing_result_has_no_difference(folder: Path) -> None:
    _, results = diff_runs(folder / FIRST, folder / SECOND)
    assert rows_of(results)["smallest distance from the contact to a free edge"] == (
        "mm", Missing.NOT_DEFINED, Missing.NOT_DEFINED, None,
    )  # fmt: skip


def test_differences_beyond_the_uncertainties_of_both_stand_out(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = {"slip.overall": 3e-3, "slip.incipient": 0.4, "slip_margin_incipient": 0.01}
    monkeypatch.setattr(reporting, "read_uncertainties", lambda _, runs: dict.fromkeys(runs, known))
    _, results = diff_runs(folder / FIRST, folder / SECOND)
    rows = rows_of(results)
    difference = rows["overall slip (accumulated slip)"][3]
    assert isinstance(difference, Measured)
    assert difference.uncertainty == pytest.approx(3e-3 * 2**0.5)
    marked = {results.rows[number][0] for number in results.marked}
    assert "overall slip (accumulated slip)" in marked
    assert "incipient slip (accumulated slip)" not in marked
    assert "bold" in results.note


def test_a_run_does_not_differ_from_itself(folder: Path) -> None:
    values, results = diff_runs(folder / FIRST, folder / FIRST)
    assert values.rows == ()
    assert "same values" in values.note
    assert {row[-1] for row in results.rows} <= {0.0, None}


def test_runs_of_two_studies_may_have_other_values(folder: Path, write_study: Write, tmp_path: Path) -> None:
    law = {"static_kinetic": {"static": 0.6, "kinetic": 0.5, "decay_speed": "1 mm/s"}}
    path = write_study(block_values() | {"contact": {"boundary": "bottom", "friction": law}, "sweep": {}}, name="drop")
    other = run_study(path, results_dir=tmp_path / "results", workers=1)
    values, _ = diff_runs(folder / SECOND, other.folder / other.runs[0].name)
    rows = rows_of(values)
    assert rows["contact.friction_coefficient"] == ("0.6", Missing.NOT_DEFINED)
    assert rows["contact.friction.static_kinetic.decay_speed"] == (Missing.NOT_DEFINED, "1 mm/s")
    assert "title" not in rows


def test_a_folder_that_is_no_run_is_refused(folder: Path) -> None:
    with pytest.raises(ResultError, match="needs the folder of one of its runs"):
        diff_runs(folder, folder / SECOND)
