"""Checking studies: what running them would do, without doing it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fingerslip.errors import InputError
from fingerslip.study.inspection.check import check_studies
from fingerslip.study.running.cost import estimated_seconds
from fingerslip.study.running.runner import run_study
from unit.study.block import block_values, changed

Write = Callable[..., Path]


@pytest.fixture(autouse=True)
def compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have nothing to compile, whatever is kept on this machine."""
    monkeypatch.setattr("fingerslip.study.running.cost._has_cache", lambda _: True)


def test_every_run_is_counted_with_its_size(write_study: Write) -> None:
    table = check_studies([write_study()])
    # 9 x 5 nodes with two unknowns; 60 ms in steps of 2 ms.
    assert [row[:6] for row in table.rows] == [
        ("block.yaml", f"friction_coefficient-{friction}", "to do", 90, 30, 30) for friction in (0.2, 0.4, 0.6)
    ]
    assert [row[6] for row in table.rows] == [estimated_seconds(90, 30)] * 3
    assert table.note.startswith(
        "3 runs, about 0.1 min of computing in one process. Each process takes about 0.4 GB. WARNING: "
    )


def test_what_is_too_coarse_to_be_right_is_said(write_study: Write) -> None:
    table = check_studies([write_study()])
    assert table.title == "Checked: no mistakes found, 3 warnings"
    assert "block.yaml: programme.0: the press takes 10 steps, and fewer than 25 are too coarse" in table.note
    fine = check_studies([write_study(block_values() | {"time": {"step": "0.5 ms"}})])
    assert "steps" not in fine.note


@pytest.mark.parametrize(("scheme", "fewest"), [("hht_alpha", 30), ("quasi_static", 60)])
def test_steps_that_control_their_error_are_told_from_records(write_study: Write, scheme: str, fewest: int) -> None:
    path = write_study(block_values() | {"time": {"step": "auto", "output": "2 ms", "scheme": scheme}})
    table = check_studies([path])
    assert [row[4:6] for row in table.rows] == [(30, f"at least {fewest}")] * 3
    assert [row[6] for row in table.rows] == [estimated_seconds(90, fewest)] * 3
    assert table.note.startswith(
        "3 runs, at least 0.1 min of computing in one process. Each process takes about 0.4 GB. With step: auto"
    )


@pytest.mark.usefixtures("simulated", "reports")
def test_finished_runs_cost_nothing(write_study: Write, tmp_path: Path) -> None:
    run_study(write_study(), results_dir=tmp_path / "results", workers=1)
    values = block_values() | {"sweep": {"contact.friction_coefficient": [0.4, 0.8]}}
    path = write_study(values | {"time": {"step": "2 ms"}})
    table = check_studies([path], tmp_path / "results")
    assert [row[2] for row in table.rows] == ["finished", "to do"]


def test_time_is_that_of_what_is_to_do(write_study: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fingerslip.study.inspection.check.estimated_seconds", lambda *_: 60.0)
    assert check_studies([write_study()]).note.startswith("3 runs, about 3.0 min")


@pytest.mark.usefixtures("reports", "simulated")
def test_time_of_finished_runs_is_not_counted(
    write_study: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_study()
    run_study(path, results_dir=tmp_path / "results", workers=1)
    monkeypatch.setattr("fingerslip.study.inspection.check.estimated_seconds", lambda *_: 60.0)
    assert check_studies([path], tmp_path / "results").note.startswith("3 runs, about 0.1 min")


def test_the_first_mistake_of_any_study_is_told(write_study: Write) -> None:
    good = write_study()
    bad = write_study(changed("contact.boundary", "pulp"), name="bad")
    with pytest.raises(InputError, match=r"bad\.yaml.*boundary 'pulp' not in mesh"):
        check_studies([good, bad])


def test_groups_with_one_matrix_are_told(write_study: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fingerslip.dynamics.step.sharing._WORTH_SHARING", {2: 0, 3: 0})
    assert "3 of those to do are computed in 1 group with one matrix each." in check_studies([write_study()]).note
