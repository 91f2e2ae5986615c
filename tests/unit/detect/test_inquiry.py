from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.detect.inquiry import Levels, curve_sizes, inquire, vary, write_inquiry
from fingerslip.detect.session import Choices
from fingerslip.errors import InputError

CHOICES = Choices(rest_frames=20, window=5, samples="20,6,2,20")
FEW = Levels(lost="0,0.6", noise="", slower="2")


def test_an_inquiry_has_a_table_and_a_figure_of_each(trials_folder: Path, tmp_path: Path) -> None:
    found = inquire(trials_folder, "logistic", CHOICES, FEW)
    assert list(found.tables) == list(found.figures) == ["learning-curve", "importance", "robustness"]
    assert [row[0] for row in found.tables["learning-curve"].rows] == [4, 9, 19]
    assert [row[0] for row in found.tables["importance"].rows] == [0, 1, 2, 3, 4]
    assert [row[:2] for row in found.tables["robustness"].rows] == [("lost", 0.0), ("lost", 0.6), ("slower", 2.0)]
    write_inquiry(found, tmp_path)
    names = {"learning-curve", "importance", "robustness"}
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}.{end}" for name in names for end in ("csv", "png")}


@pytest.mark.slow
def test_a_classifier_without_markers_has_no_importance_of_rings(trials_folder: Path) -> None:
    assert "importance" not in inquire(trials_folder, "time_threshold", CHOICES, FEW).tables


def test_all_trials_and_halves_of_them_make_a_curve() -> None:
    assert curve_sizes(256) == (4, 8, 16, 32, 64, 128, 256)
    assert curve_sizes(1) == (1,)


def test_levels_are_numbers(trials_folder: Path) -> None:
    with pytest.raises(InputError, match=r"--noise: got '0;1', needs numbers with commas; write --noise 0,0\.1,0\.2"):
        inquire(trials_folder, "logistic", CHOICES, Levels(noise="0;1"))


@pytest.mark.slow
def test_what_is_assumed_has_a_table_and_a_figure_and_conditions_have_tables(
    trials_folder: Path, tmp_path: Path
) -> None:
    found = vary(trials_folder, ["time_threshold"], CHOICES, folds=2, conditions=["indentation"])
    assert list(found.tables) == ["assumptions", "by-indentation"]
    assert len(found.tables["assumptions"].rows) >= 9
    assert found.tables["assumptions"].rows[0][0] == "as in the data set"
    write_inquiry(found, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"assumptions.csv", "assumptions.png", "by-indentation.csv"}
