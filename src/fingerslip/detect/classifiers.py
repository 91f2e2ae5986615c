"""The classifiers that are compared: what each sees, and its scikit-learn pipeline."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Mapping, Sequence
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


# A class of scikit-learn, and how it is set; what has settings gets a seed, too.
Step = tuple[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Candidate:
    """A classifier and what it sees."""

    name: str
    sets: tuple[str, ...]  # its sets of features
    steps: tuple[Step, ...]  # one, or those of a pipeline

    def make(self, seed: int) -> Any:
        """Return its estimator, which is not fitted."""
        estimators = []
        for path, settings in self.steps:
            module, name = path.split(".")
            drawn = {"random_state": seed} if settings else {}
            estimators.append(getattr(optional(f"sklearn.{module}"), name)(**settings, **drawn))
        return optional("sklearn.pipeline").make_pipeline(*estimators) if estimators[1:] else estimators[0]


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


_SCALER: Step = ("preprocessing.StandardScaler", {})
# That of Cordova Bulens et al. 2023.
_FOREST: Step = ("ensemble.RandomForestClassifier", {"n_estimators": 50, "max_depth": 20, "min_samples_leaf": 5})
_BOOSTING: Step = (
    "ensemble.HistGradientBoostingClassifier",
    {"max_iter": 50, "learning_rate": 0.2, "max_leaf_nodes": 15, "max_features": 0.2, "early_stopping": False},
)
_LOGISTIC: Step = ("linear_model.LogisticRegression", {"C": 0.1, "max_iter": 500, "tol": 1e-3})
# Its gamma is 1 / number of features. So many are as right as the exact kernel on 5,400 frames; 200 lose 3 points.
_KERNEL: Step = ("kernel_approximation.Nystroem", {"n_components": 500})
_PLANES: Step = ("svm.LinearSVC", {"C": 10.0, "dual": False, "tol": 1e-2, "max_iter": 2000})
# Three leaves are two thresholds where it sees one feature.
_TREE: Step = ("tree.DecisionTreeClassifier", {"max_leaf_nodes": 3, "min_samples_leaf": 5})
_ALL = (
    Candidate("forest", PUBLISHED, (_FOREST,)),
    Candidate("svm", ("polar",), (_SCALER, _KERNEL, _PLANES)),
    Candidate("boosting", PUBLISHED, (_BOOSTING,)),
    Candidate("logistic", PUBLISHED, (_SCALER, _LOGISTIC)),
    Candidate("displacement_threshold", ("mean",), (_TREE,)),
    Candidate("time_threshold", ("time",), (_TREE,)),
    Candidate("residual_threshold", ("residual",), (_TREE,)),
)

#: Every classifier by its name; the last three are baselines that have to be beaten.
CLASSIFIERS: Mapping[str, Candidate] = MappingProxyType({candidate.name: candidate for candidate in _ALL})
