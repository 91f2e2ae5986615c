import dataclasses

import numpy as np
import pytest

from fingerslip.detect.classifiers import CLASSIFIERS, SVM_GRID, Candidate, fit, probabilities, union_of_sets
from fingerslip.detect.optional import optional
from fingerslip.detect.samples import columns_of
from fingerslip.errors import InputError

DRAW = np.random.default_rng(0)
CLASSES = np.tile([0, 1, 2], 80).astype(np.int8)
VALUES = (CLASSES[:, None] * 2.0 + DRAW.normal(size=(240, 6))).astype(np.float32)
GROUPS = np.repeat(np.arange(12), 20)


@pytest.mark.parametrize("name", CLASSIFIERS)
def test_every_classifier_learns_what_is_plain(name):
    one = CLASSIFIERS[name]
    values = VALUES[:, :1] if name.endswith("threshold") else VALUES
    estimator = fit(one, values, CLASSES, GROUPS)
    found = probabilities(estimator, values)
    assert found.shape == (240, 3)
    assert found.sum(axis=1) == pytest.approx(1.0)
    assert (found.argmax(axis=1) == CLASSES).mean() > 0.7
    assert found[:5] == pytest.approx(probabilities(estimator, values[:5]), abs=1e-6)


def test_the_forest_is_the_published_one_and_its_probabilities_its_own():
    forest = CLASSIFIERS["forest"].make(0)
    assert (forest.max_depth, forest.min_samples_leaf, forest.n_estimators) == (20, 5, 50)
    assert CLASSIFIERS["forest"].sets == ("displacement", "speed")
    estimator = fit(CLASSIFIERS["forest"], VALUES, CLASSES, GROUPS)
    assert probabilities(estimator, VALUES) == pytest.approx(estimator.predict_proba(VALUES), abs=1e-12)


def test_parameters_of_the_machines_come_from_the_grid_and_a_threshold_has_two_values():
    estimator = fit(CLASSIFIERS["svm_rbf"], VALUES, CLASSES, GROUPS)
    assert estimator.get_params()["linearsvc__C"] in SVM_GRID["C"]
    assert estimator.get_params()["nystroem__gamma"] in [gamma / 6 for gamma in SVM_GRID["gamma"]]
    alone = fit(CLASSIFIERS["svm_linear"], VALUES, CLASSES, np.zeros(240, dtype=np.intp))
    assert alone.get_params()["linearsvc__C"] == 0.1
    tree = fit(CLASSIFIERS["time_threshold"], VALUES[:, :1], CLASSES, GROUPS)
    assert tree.get_n_leaves() == 3


def test_missing_classes_nan_and_a_classifier_that_does_not_converge_are_refused():
    with pytest.raises(InputError, match=r"training: has the classes \[0, 1\], needs 0, 1 and 2"):
        fit(CLASSIFIERS["forest"], VALUES, np.minimum(CLASSES, 1), GROUPS)
    broken = VALUES.copy()
    broken[3, 2] = np.nan
    with pytest.raises(InputError, match="training: has features that are not finite"):
        fit(CLASSIFIERS["forest"], broken, CLASSES, GROUPS)

    def hurried(seed):
        estimator = CLASSIFIERS["logistic"].make(seed)
        return estimator.set_params(logisticregression__max_iter=1)

    one = dataclasses.replace(CLASSIFIERS["logistic"], make=hurried)
    with pytest.raises(InputError, match="classifier logistic: does not converge"):
        fit(one, VALUES, CLASSES, GROUPS)


def test_columns_of_sets_and_a_module_that_is_missing():
    names = ("mean/a", "time/seconds", "mean/b")
    assert columns_of(names, ("time", "mean")).tolist() == [1, 0, 2]
    with pytest.raises(InputError, match="features: have no 'polar'"):
        columns_of(names, ("polar",))
    two = [Candidate(name, sets, "", lambda seed: seed) for name, sets in (("a", ("x", "y")), ("b", ("y", "z")))]
    assert union_of_sets(two) == ("x", "y", "z")
    with pytest.raises(InputError, match=r'detect: no_such_module is missing .*pip install "fingerslip\[detect\]"'):
        optional("no_such_module")
