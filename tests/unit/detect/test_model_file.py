from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skops.io
from sklearn.preprocessing import FunctionTransformer

from fingerslip.detect import model_file
from fingerslip.detect.model_file import read_detector, write_detector
from fingerslip.detect.smoothing import Hysteresis
from fingerslip.detect.training import Detector, detect, train
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import DamagedError, InputError, ResultError
from fingerslip.files import read_json, write_json
from unit.detect.conftest import MOTION, SAMPLING


@pytest.fixture(scope="module")
def made(trials: TrialSet) -> Detector:
    return train(trials, trials.onsets(), "time_threshold", motion=MOTION, sampling=SAMPLING)


@pytest.fixture
def folder(made: Detector, tmp_path: Path) -> Iterator[Path]:
    write_detector(made, tmp_path / "detector")
    yield tmp_path / "detector"
    assert {path.name for path in tmp_path.iterdir()} <= {"detector"}, "nothing half written is left"


def change(folder: Path, **values: Any) -> None:
    path = folder / "detector.json"
    write_json(path, read_json(path, "") | values)


@pytest.mark.parametrize("name", ["forest", "boosting", pytest.param("svm_linear", marks=pytest.mark.slow), "logistic"])
def test_a_detector_says_the_same_after_it_was_read_back(name: str, trials: TrialSet, tmp_path: Path) -> None:
    some = trials.names[:8]
    first = train(trials, trials.onsets(), name, motion=MOTION, sampling=SAMPLING, names=some)
    write_detector(first, tmp_path / "d")
    found = read_detector(tmp_path / "d")
    assert dataclasses.replace(found, estimator=None) == dataclasses.replace(first, estimator=None)
    tracks = trials.tracks(trials.names[-1])
    assert np.array_equal(detect(found, tracks)[1], detect(first, tracks)[1])


def test_the_card_says_what_it_is(folder: Path, trials: TrialSet) -> None:
    card = (folder / "README.md").read_text()
    assert "# Slip detector: time_threshold" in card
    assert "guarantees nothing" in card
    assert trials.digest in card


def test_hysteresis_is_kept_and_other_smoothers_are_refused(made: Detector, tmp_path: Path) -> None:
    write_detector(dataclasses.replace(made, smoother=Hysteresis(7)), tmp_path / "d")
    assert read_detector(tmp_path / "d").smoother == Hysteresis(7)
    with pytest.raises(InputError, match="detector: smoother: got object"):
        write_detector(dataclasses.replace(made, smoother=object()), tmp_path / "e")  # type: ignore[arg-type]
    assert not (tmp_path / "e").exists()


def test_other_versions_of_scikit_learn_are_refused(folder: Path) -> None:
    change(folder, scikit_learn="0.24.1")
    with pytest.raises(InputError, match=r"was made with scikit-learn 0\.24\.1, needs the installed version"):
        read_detector(folder)


def test_a_model_for_other_features_is_refused(folder: Path) -> None:
    change(folder, features=["time/seconds", "mean/displacement"])
    with pytest.raises(DamagedError, match="sees 1 features and 3 classes, not 2 and 3"):
        read_detector(folder)


@pytest.mark.parametrize(("name", "value"), [("format", 2), ("classes", ["slip", "none"])])
def test_other_forms_are_refused(name: str, value: object, folder: Path) -> None:
    change(folder, **{name: value})
    with pytest.raises(DamagedError, match="train the detector again"):
        read_detector(folder)


def test_a_classifier_that_was_changed_or_is_none_is_refused(folder: Path) -> None:
    path = folder / "classifier.skops"
    content = path.read_bytes()
    path.write_bytes(content + b" ")
    with pytest.raises(DamagedError, match=r"is not the file that detector\.json names"):
        read_detector(folder)
    path.write_bytes(b"no zip")
    with pytest.raises(DamagedError, match="cannot be read"):
        read_detector(folder)
    path.unlink()
    with pytest.raises(ResultError, match="cannot be read"):
        read_detector(folder)


def test_types_that_are_not_trusted_are_refused(folder: Path) -> None:
    from fingerslip.digest import file_digest

    path = folder / "classifier.skops"
    path.write_bytes(skops.io.dumps(FunctionTransformer(func=json.loads)))
    change(folder, sha256=file_digest(path))
    with pytest.raises(InputError, match=r"holds the type .*needs types that are trusted"):
        read_detector(folder)


def test_files_that_are_too_large_are_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_file, "LARGEST", 100)
    with pytest.raises(InputError, match=r"has 0 MB, needs at most 0 MB"):
        read_detector(folder)


def test_trees_whose_branches_lead_nowhere_are_refused(made: Detector, folder: Path) -> None:
    from fingerslip.detect.model_file import _check_estimator, _trees

    described = read_json(folder / "detector.json", "")
    _check_estimator(folder, described, made.estimator)
    assert [nodes for nodes, _, _ in _trees(made.estimator)] == [5]

    class Broken:
        n_features_in_, classes_ = 1, np.arange(3)

        class tree_:  # noqa: N801  named as in scikit-learn
            node_count = 2
            children_left, children_right, feature = np.array([1, 7]), np.array([-1, -1]), np.array([0, -2])

    with pytest.raises(DamagedError, match="branches that lead nowhere"):
        _check_estimator(folder, described, Broken())


def test_a_folder_without_a_detector_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"has no detector\.json"):
        read_detector(tmp_path)
