"""A study that was run, opened from its folder."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

import fingerslip as fs
from fingerslip.errors import DamagedError, InputError, ResultError
from fingerslip.results import Quantity
from fingerslip.storage.files import read_json, write_json
from fingerslip.study.running.runner import run_study
from fingerslip.study.storage.summary import RunConvergence, write_convergences
from fingerslip.uncertainty import Convergence, Series
from unit.study.block import FRICTIONS, block_values

NAMES = tuple(f"friction_coefficient-{friction}" for friction in FRICTIONS)

pytestmark = pytest.mark.usefixtures("reports", "simulated")


@pytest.fixture
def folder(finished: Path) -> Path:
    return finished


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


def test_derived_quantities_are_stored_with_the_study_and_in_its_summary(write_study: Callable[..., Path]) -> None:
    derived = {"travel": "overall_slip * slide.speed", "never": "sqrt(-overall_slip)"}
    path = write_study(block_values() | {"derived": derived})
    folder = run_study(path, results_dir=path.parent / "results", workers=1).folder
    study = fs.open_study(folder)
    for run in study.result.runs:
        # The slide of the study goes at 5 mm/s.
        assert run.derived["travel"] == Quantity("travel", "m", pytest.approx(5e-3 * run.events.overall))
        assert run.derived["never"] == Quantity("never", "s^0.5", None)
    frame = pd.read_csv(folder / "summary.csv")
    assert frame["travel_m"].tolist() == pytest.approx([run.derived["travel"].value for run in study.result.runs])
    assert study.to_dataframe()["travel_m"].tolist() == pytest.approx(frame["travel_m"].tolist())
    assert frame.filter(like="never").isna().all().all()


def test_known_uncertainties_come_with_the_runs(folder: Path) -> None:
    identity = fs.open_study(folder).result.runs[0].identity
    series = {"step": Series("step", (1.0, 0.5, 0.25), (2.0, 1.25, 1.0625))}
    found = {"slip.overall": Convergence("overall slip (accumulated slip)", "s", 2.0, series)}
    write_convergences(folder, {NAMES[0]: RunConvergence(NAMES[0], identity, found)})
    first, second, _ = fs.open_study(folder).result.runs
    assert first.uncertainty == {"slip.overall": pytest.approx(1.25)}
    assert second.uncertainty == {}


@pytest.mark.parametrize("changed", [{"compare": None}, {"runs": 3}, {"runs": {"a": {}}}, {"title": None}])
def test_results_of_another_version_are_refused(folder: Path, changed: dict[str, object]) -> None:
    write_json(folder / "manifest.json", read_json(folder / "manifest.json", "") | changed)
    with pytest.raises(
        ResultError, match=r"manifest\.json: is of another version, or damaged at [\w.]+; run the study again"
    ):
        fs.open_study(folder)


def test_what_is_no_path_is_refused() -> None:
    with pytest.raises(InputError, match="open_study: got 3, needs the path of a folder"):
        fs.open_study(3)  # type: ignore[arg-type]
