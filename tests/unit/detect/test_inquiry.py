import numpy as np
import pytest

from fingerslip.detect import inquiry
from fingerslip.detect.inquiry import Levels, curve_sizes, inquire, vary, write_inquiry
from fingerslip.detect.labels import Onsets
from fingerslip.detect.session import Choices
from fingerslip.detect.trials import TrialSet
from fingerslip.errors import InputError

CHOICES = Choices(rest_frames=20, window=5, samples="20,6,2,20")
FEW = Levels(lost="0,0.6", noise="", slower="2")


def test_an_inquiry_has_a_table_and_a_figure_of_each(trials_folder, tmp_path):
    found = inquire(trials_folder, "logistic", CHOICES, FEW)
    assert list(found.tables) == list(found.figures) == ["learning-curve", "importance", "robustness"]
    assert [row[0] for row in found.tables["learning-curve"].rows] == [4, 9, 19]
    assert [row[0] for row in found.tables["importance"].rows] == [0, 1, 2, 3, 4]
    assert [row[:2] for row in found.tables["robustness"].rows] == [("lost", 0.0), ("lost", 0.6), ("slower", 2.0)]
    write_inquiry(found, tmp_path)
    names = {"learning-curve", "importance", "robustness"}
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}.{end}" for name in names for end in ("csv", "png")}


@pytest.mark.slow
def test_a_classifier_without_markers_has_no_importance_of_rings(trials_folder):
    assert "importance" not in inquire(trials_folder, "time_threshold", CHOICES, FEW).tables


def test_all_trials_and_halves_of_them_make_a_curve_and_levels_are_numbers(trials_folder):
    assert curve_sizes(256) == (4, 8, 16, 32, 64, 128, 256)
    assert curve_sizes(1) == (1,)
    with pytest.raises(InputError, match=r"--noise: got '0;1', needs numbers with commas; write --noise 0,0\.1,0\.2"):
        inquire(trials_folder, "logistic", CHOICES, Levels(noise="0;1"))


@pytest.mark.slow
def test_what_is_assumed_has_a_table_and_a_figure_and_conditions_have_tables(trials_folder, tmp_path):
    more = {"conditions": ["indentation"], "each": ["indentation"], "output": tmp_path / "tables"}
    found = vary(trials_folder, ["time_threshold"], CHOICES, folds=2, **more)
    assert list(found.tables) == ["assumptions", "by-indentation"]
    rows = found.tables["assumptions"].rows
    assert len(rows) >= 11
    assert rows[0][0] == "as in the data set"
    assert [row[1] for row in rows[-2:]] == ["indentation: 3 mm", "indentation: 4 mm"]
    assert [path.name for path in tmp_path.iterdir()] == ["tables"]
    tmp_path = tmp_path / "tables"
    assert {path.name for path in tmp_path.iterdir()} == {"assumptions.csv", "assumptions.png", "by-indentation.csv"}


def test_a_label_that_never_comes_leaves_nothing(trials_folder, tmp_path, monkeypatch):
    def told(*_given, store, **_more):
        store.write("assumption", 1, {"median onsets": np.zeros(2)})
        raise InputError("trial slide-0000", "has no gross slip", "needs both onsets here")

    monkeypatch.setattr(inquiry, "sensitivity_of", told)
    with pytest.raises(InputError, match="has no gross slip"):
        vary(trials_folder, ["time_threshold"], CHOICES, output=tmp_path / "tables")
    assert list(tmp_path.iterdir()) == []


def test_labels_that_do_not_come_in_every_trial_are_no_assumption(trials, monkeypatch):
    asked = []

    def noted(_trials, assumptions, *_, **__):
        asked.extend(one.labels for one in assumptions)
        raise InputError("trials", "are not asked here", "needs nothing")

    monkeypatch.setattr(inquiry, "sensitivity_of", noted)
    for labels in (trials.labels(trials.names[0]), {"contact": Onsets(1.0, None)}):
        monkeypatch.setattr(TrialSet, "labels", lambda *_, found=labels: found)
        with pytest.raises(InputError, match="are not asked here"):
            vary(trials.folder, ["time_threshold"], CHOICES)
    assert asked.count("contact") == 1
