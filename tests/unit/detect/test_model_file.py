import contextlib
import copy
import dataclasses
import json
from functools import cache, partial

import numpy as np
import pytest
import skops.io
from sklearn.preprocessing import FunctionTransformer

from fingerslip.detect import model_file
from fingerslip.detect.model_file import read_detector, write_detector
from fingerslip.detect.training import detect, train
from fingerslip.errors import DamagedError, InputError, ResultError
from fingerslip.storage.files import file_digest, read_json, write_json
from unit.detect.conftest import MOTION, SAMPLING


@pytest.fixture(scope="module")
def learned(trials):
    """Return a function that gives the detector with a classifier, which learned once from eight trials."""
    some = trials.names[:8]
    return cache(lambda name: train(trials, trials.onsets(), name, motion=MOTION, sampling=SAMPLING, names=some))


@pytest.fixture(scope="module")
def made(learned):
    return learned("time_threshold")


@pytest.fixture
def folder(made, tmp_path):
    write_detector(made, tmp_path / "detector")
    yield tmp_path / "detector"
    assert {path.name for path in tmp_path.iterdir()} <= {"detector"}, "nothing half written is left"


def change(folder, **values):
    path = folder / "detector.json"
    write_json(path, read_json(path, "") | values)


@pytest.mark.parametrize("name", ["forest", pytest.param("boosting", marks=pytest.mark.slow), "svm", "logistic"])
def test_a_detector_says_the_same_after_it_was_read_back(name, trials, learned, tmp_path):
    first = learned(name)
    write_detector(first, tmp_path / "d")
    found = read_detector(tmp_path / "d")
    assert dataclasses.replace(found, estimator=None) == dataclasses.replace(first, estimator=None)
    tracks = trials.tracks(trials.names[-1])
    assert np.array_equal(detect(found, tracks)[1], detect(first, tracks)[1])


def test_the_card_says_what_it_is(folder, trials):
    assert read_json(folder / "detector.json", "")["frame_rate"] == read_detector(folder).frame_rate == 30.0
    card = (folder / "README.md").read_text()
    assert "# Slip detector: time_threshold" in card
    assert "no guarantee: too few trials" in card
    assert trials.digest in card


def test_a_detector_without_a_frame_rate_is_read(folder):
    described = read_json(folder / "detector.json", "")
    del described["frame_rate"], described["ranges"]
    write_json(folder / "detector.json", described)
    assert read_detector(folder).frame_rate is None


def put(folder, content):
    """Store another classifier; None adds a byte to the one that is there."""
    path = folder / "classifier.skops"
    path.write_bytes(path.read_bytes() + b" " if content is None else content)


def put_strange(folder):
    put(folder, skops.io.dumps(FunctionTransformer(func=json.loads)))
    change(folder, sha256=file_digest(folder / "classifier.skops"))


@pytest.mark.parametrize(
    ("damage", "error", "message"),
    [
        (partial(change, scikit_learn="0.24.1"), InputError, r"with scikit-learn 0\.24\.1, needs the installed"),
        (partial(change, features=["time/seconds", "a"]), DamagedError, "sees 1 features and 3 classes, not 2 and 3"),
        (partial(change, format=2), DamagedError, "train the detector again"),
        (partial(change, classes=["slip", "none"]), DamagedError, "train the detector again"),
        (partial(put, content=None), DamagedError, r"is not the file that detector\.json names"),
        (partial(put, content=b"no zip"), DamagedError, "cannot be read"),
        (lambda folder: (folder / "classifier.skops").unlink(), DamagedError, "cannot be read"),
        (put_strange, InputError, "holds the type .*needs types that are trusted"),
    ],
)
def test_a_folder_that_was_changed_is_refused(damage, error, message, folder):
    damage(folder)
    with pytest.raises(error, match=message):
        read_detector(folder)


def test_no_detector_another_classifier_and_files_that_are_too_large_are_refused(folder, learned, monkeypatch):
    with pytest.raises(InputError, match=r"has no detector\.json"):
        read_detector(folder.parent)
    with monkeypatch.context() as small:
        small.setattr(model_file, "LARGEST", 100)
        with pytest.raises(InputError, match=r"has 0 MB, needs at most 0 MB"):
            read_detector(folder)
    write_detector(dataclasses.replace(learned("forest"), classifier="boosting"), folder)
    with pytest.raises(DamagedError, match="is not the classifier boosting"):
        read_detector(folder)


def _nodes(tree):
    """Return the node arrays of a tree that a forest or boosting holds, by the names that both share here."""
    if hasattr(tree, "tree_"):
        state = tree.tree_.__getstate__()
        names = {"left": "left_child", "right": "right_child", "feature": "feature", "threshold": "threshold"}
        return {name: state["nodes"][own] for name, own in names.items()} | {"value": state["values"]}
    names = {"left": "left", "right": "right", "feature": "feature_idx", "threshold": "num_threshold"}
    return {name: tree.nodes[own] for name, own in names.items()} | {"value": tree.nodes["value"]}


def _copy(detector):
    """Return a copy of a detector that has the first few trees alone."""
    made = copy.deepcopy(detector)
    del getattr(made.estimator, "_predictors", getattr(made.estimator, "estimators_", []))[4:]
    return made


@pytest.mark.parametrize("classifier", ["forest", "boosting"])
@pytest.mark.parametrize(
    ("name", "node", "value", "message"),
    [
        ("left", 1, 0, "branches that lead nowhere"),  # a circle
        ("right", 0, 0, "branches that lead nowhere"),
        ("left", 0, 10**6, "branches that lead nowhere"),
        ("right", 0, -1, "branches that lead nowhere"),  # an only child
        ("feature", 0, -5, "a tree of other features than its "),
        ("feature", 0, 10**6, "a tree of other features than its "),
        ("threshold", 0, np.nan, "thresholds or values are no numbers"),
        ("value", 0, np.inf, "thresholds or values are no numbers"),
    ],
)
def test_trees_that_compiled_code_could_not_follow_are_refused(  # noqa: PLR0917
    classifier, name, node, value, message, learned, tmp_path
):
    detector = _copy(learned(classifier))
    tree = detector.estimator.estimators_[3] if classifier == "forest" else detector.estimator._predictors[3][1]
    nodes = _nodes(tree)
    is_unsigned = nodes[name].dtype.kind == "u" and value < 0
    nodes[name][node] = 2**32 + value if is_unsigned else value
    write_detector(detector, tmp_path / "d")
    with pytest.raises(DamagedError, match=message):
        read_detector(tmp_path / "d")


@pytest.mark.parametrize(
    ("classifier", "change_estimator", "message"),
    [
        ("forest", lambda forest: setattr(forest, "estimators_", []), "gives the probabilities"),
        ("forest", lambda forest: setattr(forest.estimators_[0], "tree_", None), "is no classifier"),
        ("forest", lambda forest: setattr(forest, "n_features_in_", None), "sees None features"),
        ("forest", lambda forest: delattr(forest, "classes_"), "is no classifier"),
        ("boosting", lambda stages: stages._predictors[0][0].nodes["is_categorical"].fill(1), "a tree of another kind"),
    ],
)
def test_an_estimator_that_was_taken_apart_is_refused(classifier, change_estimator, message, learned, tmp_path):
    detector = _copy(learned(classifier))
    change_estimator(detector.estimator)
    write_detector(detector, tmp_path / "d")
    with pytest.raises(DamagedError, match=message):
        read_detector(tmp_path / "d")


def _edited(described):
    """Yield descriptions with one entry of another value, at every depth, and whether an entry is gone or renamed."""
    for name, value in described.items():
        others = (None, True, -1, 10**400, float("nan"), "x", [], {}, [value], {"value": value})
        yield {other: held for other, held in described.items() if other != name}, True
        yield {(f"{other}s" if other == name else other): held for other, held in described.items()}, True
        yield from ((described | {name: other}, False) for other in others)
        if isinstance(value, dict):
            yield from ((described | {name: other}, is_gone) for other, is_gone in _edited(value))


@pytest.mark.slow
def test_edited_descriptions_are_refused_or_read_as_they_are(folder):
    described = read_json(folder / "detector.json", "")
    provenance, older = described["provenance"], [described.keys() - {name} for name in ("frame_rate", "ranges")]
    edited = list(_edited(described))
    assert len(edited) > 300
    for values, is_gone in edited:
        write_json(folder / "detector.json", values)
        # Where the data come from may be said in any words.
        is_wrong = is_gone and values.get("provenance") == provenance and values.keys() not in older
        with pytest.raises((InputError, ResultError)) if is_wrong else contextlib.suppress(InputError, ResultError):
            read_detector(folder)
