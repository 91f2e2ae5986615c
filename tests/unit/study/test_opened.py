"""A study that was run, opened from its folder."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

import fingerslip as fs
from fingerslip.errors import DamagedError, InputError, ResultError
from fingerslip.study.running.runner import run_study
from unit.study.block import FRICTIONS

NAMES = tuple(f"friction_coefficient-{friction}" for friction in FRICTIONS)

pytestmark = pytest.mark.usefixtures("reports", "simulated")


@pytest.fixture
def folder(write_study: Callable[..., Path]) -> Path:
    path = write_study()
    return run_study(path, results_dir=path.parent / "results", workers=1).folder


def test_results_are_a_data_frame_with_a_row_for_each_run(folder: Path) -> None:
    study = fs.open_study(folder)
    assert study.names == NAMES
    frame = study.to_dataframe()
    assert frame["contact.friction_coefficient"].tolist() == FRICTIONS
    assert (frame["overall_s"].diff().dropna() > 0.0).all()
    assert repr(study) == f"<OpenedStudy 'Block on a plate': 3 runs in {folder}>"
    assert NAMES[1] in study._repr_html_()


def test_histories_are_read_when_they_are_asked_for(folder: Path) -> None:
    (folder / NAMES[0] / "history.nc").write_bytes(b"damaged")
    study = fs.open_study(folder)
    assert study.history(NAMES[1]).sizes["time"] > 1
    with pytest.raises(ResultError, match="cannot be read as a history"):
        study.history(NAMES[0])
    shutil.copy(folder / NAMES[1] / "history.nc", folder / NAMES[0] / "history.nc")
    assert [name for name, _ in study.histories()] == list(NAMES)


def test_a_run_has_all_its_values(folder: Path) -> None:
    assert fs.open_study(folder).run(NAMES[2]).values["contact.friction_coefficient"] == 0.6
    with pytest.raises(InputError, match=r"run: 'x' is not a finished run, needs one of friction_coefficient-0\.2"):
        fs.open_study(folder).run("x")


def test_damaged_and_missing_results_are_refused(folder: Path) -> None:
    events = folder / NAMES[1] / "events.json"
    events.write_text(events.read_text(encoding="utf-8").replace("0.4", "0.5"), encoding="utf-8")
    with pytest.raises(DamagedError, match=r"events\.json"):
        fs.open_study(folder)
    with pytest.raises(ResultError):
        fs.open_study(folder / "nothing")
