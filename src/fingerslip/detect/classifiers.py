"""The classifiers that are compared: what each sees, and its scikit-learn pipeline."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fingerslip.arrays import Floats, Singles
from fingerslip.detect.features import PUBLISHED
from fingerslip.errors import InputError, optional_module, shorten

#: Returns a module of an optional dependency, such as ``sklearn.svm``.
optional = functools.partial(optional_module, extra="detect", where="detect", needs="slip detection needs it")


#: Points of the approximate kernel: as right as the exact one on 5,400 frames, where 200 lose 3 points.
_POINTS = 500


@dataclass(frozen=True)
class Candidate:
    """A classifier and what it sees."""

    name: str
    sets: tuple[str, ...]  # its sets of features
    make: Callable[[int], Any]  # from a seed to an estimator that is not fitted


def union_of_sets(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Return all sets of features that some classifiers need, each once."""
    return tuple(dict.fromkeys(name for candidate in candidates for name in candidate.sets))


def describe(candidate: Candidate, seed: int) -> list[Any]:
    """Return as plain data what a classifier sees and is, with its parameters: fits are the same where this is."""
    return [candidate.sets, repr(candidate.make(seed))]


def fit(candidate: Candidate, values: Singles, classes: NDArray[np.int8], *, seed: int = 0, workers: int = 1) -> Any:
    """Return a classifier that is fitted to values (n_samples, n_features) of classes (n_samples,)."""
    present_classes = np.unique(classes)
    if len(present_classes) < 3:
        fault = f"has the classes {present_classes.tolist()}"
        raise InputError("training", fault, "needs 0, 1 and 2", "take more trials")
    if not np.isfinite(values).all():
        raise InputError("training", "has features that are not finite", "needs finite numbers", "check the tracks")
    unfinished = optional("sklearn.exceptions").ConvergenceWarning
    threads = optional("joblib").parallel_config("threading", n_jobs=workers)
    with warnings.catch_warnings(), threads, threadpool_limits(workers):
        warnings.simplefilter("error", unfinished)
        # With fewer samples than points, the approximate kernel takes every sample: it is exact then.
        warnings.filterwarnings("ignore", "n_components > n_samples")
        try:
            estimator = candidate.make(seed)
            return estimator.fit(_precise(estimator, values), classes)
        except unfinished as error:
            problem = f"does not converge ({shorten(str(error))})"
            raise InputError(f"classifier {candidate.name}", problem, "needs to", "choose another one") from error


def probabilities(estimator: Any, values: Singles) -> Floats:
    """Return the probability of each class, shape (n_samples, 3).

    A support vector machine gives distances from its planes instead; their softmax stands for probabilities, and how
    far that is from being calibrated is measured, not assumed.
    """
    if hasattr(estimator, "estimators_"):
        # What `predict_proba` of a forest does, without its preparations, which take longer than a frame may.
        rows = np.ascontiguousarray(values, dtype=np.float32)
        total = np.zeros((len(rows), len(estimator.classes_)))
        for tree in estimator.estimators_:
            total += tree.tree_.predict(rows)[:, : total.shape[1]]
        return total / len(estimator.estimators_)
    exact = _precise(estimator, values)
    if hasattr(estimator, "predict_proba"):
        return np.asarray(estimator.predict_proba(exact), dtype=np.float64)
    # scipy.special is slow to import, and only these machines need it.
    from scipy.special import softmax

    return np.asarray(softmax(estimator.decision_function(exact), axis=1), dtype=np.float64)


def _precise(estimator: Any, values: Singles) -> NDArray[Any]:
    """Return values as the estimator needs them: the approximate kernel magnifies the rounding of single precision."""
    return values.astype(np.float64) if hasattr(estimator, "steps") else values


def _scale(*steps: Any) -> Any:
    return optional("sklearn.pipeline").make_pipeline(optional("sklearn.preprocessing").StandardScaler(), *steps)


def small_forest(seed: int) -> Any:
    """Return the forest of Cordova Bulens et al. 2023."""
    return optional("sklearn.ensemble").RandomForestClassifier(
        n_estimators=50, max_depth=20, min_samples_leaf=5, random_state=seed
    )


def _boosting(seed: int) -> Any:
    return optional("sklearn.ensemble").HistGradientBoostingClassifier(
        max_iter=50, learning_rate=0.2, max_leaf_nodes=15, max_features=0.2, early_stopping=False, random_state=seed
    )


def scaled_logistic(seed: int) -> Any:
    """Return a logistic regression on scaled features."""
    linear = optional("sklearn.linear_model")
    return _scale(linear.LogisticRegression(C=0.1, max_iter=500, tol=1e-3, random_state=seed))


def _radial_machine(seed: int) -> Any:
    # Its gamma is 1 / number of features.
    kernel = optional("sklearn.kernel_approximation").Nystroem(n_components=_POINTS, random_state=seed)
    planes = optional("sklearn.svm").LinearSVC(C=10.0, dual=False, tol=1e-2, max_iter=2000, random_state=seed)
    return _scale(kernel, planes)


def two_thresholds(seed: int) -> Any:
    """Return a tree with three leaves, which is two thresholds where it sees one feature."""
    return optional("sklearn.tree").DecisionTreeClassifier(max_leaf_nodes=3, min_samples_leaf=5, random_state=seed)


_ALL = (
    Candidate("forest", PUBLISHED, small_forest),
    Candidate("svm", ("polar",), _radial_machine),
    Candidate("boosting", PUBLISHED, _boosting),
    Candidate("logistic", PUBLISHED, scaled_logistic),
    Candidate("displacement_threshold", ("mean",), two_thresholds),
    Candidate("time_threshold", ("time",), two_thresholds),
    Candidate("residual_threshold", ("residual",), two_thresholds),
)

#: Every classifier by its name; the last three are baselines that have to be beaten.
CLASSIFIERS: Mapping[str, Candidate] = MappingProxyType({candidate.name: candidate for candidate in _ALL})
