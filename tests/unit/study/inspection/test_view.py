"""From the folder of a result to a picture."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from fingerslip.errors import InputError, ResultError
from fingerslip.history import write_history
from fingerslip.study.inspection.view import view_result
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    (folder / "run").mkdir()
    write_history(block_history(), folder / "run" / "history.nc")
    return folder


@pytest.mark.parametrize("target", ["", pytest.param("run", marks=pytest.mark.slow), "run/history.nc"])
def test_a_run_is_found_in_its_study_its_folder_and_its_file(study: Path, target: str, tmp_path: Path) -> None:
    picture = tmp_path / "p.png"
    assert view_result(study / target, {"scalar": "region"}, time="50 ms", screenshot=picture) == (picture,)
    with Image.open(picture) as shown:
        assert shown.size == (1200, 900)


def test_of_several_runs_one_has_to_be_named(study: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "history.nc").write_bytes((study / "run" / "history.nc").read_bytes())
    with pytest.raises(InputError, match="holds 2 runs, needs one of a, b"):
        view_result(tmp_path, {}, screenshot=tmp_path / "p.png")


def test_a_folder_without_runs_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="holds no run"):
        view_result(tmp_path, {}, screenshot=tmp_path / "p.png")


@pytest.mark.parametrize(
    ("options", "time", "message"),
    [
        ({"scalar": "stress"}, "", "view: scalar"),
        ({"cut": "q"}, "", "view: cut"),
        ({}, "1.2", "view: --time"),
        ({}, "1.2 mm", "view: --time"),
    ],
)
def test_wrong_options_are_refused_before_anything_is_drawn(
    study: Path, tmp_path: Path, options: dict[str, str], time: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        view_result(study, options, time=time, screenshot=tmp_path / "p.png")
    assert list(tmp_path.iterdir()) == []
