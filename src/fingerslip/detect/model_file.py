"""Detectors on disk: a folder with the classifier (skops, never pickle), what it was made for, and a card."""

from __future__ import annotations

import dataclasses
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fingerslip.detect.features import FeatureSettings
from fingerslip.detect.motion import MotionSettings
from fingerslip.detect.onsets import CLASSES
from fingerslip.detect.optional import optional
from fingerslip.detect.smoothing import ForwardFilter, Hysteresis, Smoother, Thresholds
from fingerslip.detect.training import Calibration, Detector, candidate_named
from fingerslip.digest import file_digest
from fingerslip.errors import DamagedError, InputError, shortened
from fingerslip.files import check_replaceable, new_folder, read_json, write_bytes, write_json, write_text
from fingerslip.version import __version__

__all__ = ["LARGEST", "TRUSTED", "read_detector", "write_detector"]

#: Largest classifier that is loaded [byte], unpacked.
LARGEST = 500_000_000

#: Types beyond those that skops trusts by itself: fitted trees of scikit-learn; their indices are checked once loaded.
TRUSTED = frozenset(
    {
        "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor",
        "sklearn.tree._tree.Tree",
    }
)

_FORMAT = 1
_DESCRIPTION, _ESTIMATOR = "detector.json", "classifier.skops"
_REPAIR = "train the detector again"
_SMOOTHERS: Mapping[str, type] = {"forward_filter": ForwardFilter, "hysteresis": Hysteresis}


def write_detector(detector: Detector, folder: str | Path) -> None:
    """Write a detector as a folder, whole or not at all.

    Parameters
    ----------
    detector : Detector
        The detector.
    folder : path
        The folder; one that is there is replaced when the new one is whole.

    Raises
    ------
    InputError
        Where its smoother is none that ships, or skops is missing; where the folder holds something else.
    ResultError
        Where the folder cannot be written.
    """
    described = _description(detector)
    stored = optional("skops.io").dumps(detector.estimator)
    check_replaceable(Path(folder), _DESCRIPTION)
    with new_folder(Path(folder)) as partial:
        write_bytes(partial / _ESTIMATOR, stored)
        described["sha256"] = file_digest(partial / _ESTIMATOR)
        write_json(partial / _DESCRIPTION, described)
        write_text(partial / "README.md", _card(detector))


def _description(detector: Detector) -> dict[str, Any]:
    kind = next((name for name, one in _SMOOTHERS.items() if type(detector.smoother) is one), None)
    if kind is None:
        found = f"got {type(detector.smoother).__name__}"
        raise InputError("detector: smoother", found, f"needs one of {', '.join(_SMOOTHERS)} to be written")
    return {
        "format": _FORMAT,
        "fingerslip": __version__,
        "scikit_learn": optional("sklearn").__version__,
        "classifier": detector.classifier,
        "classes": list(CLASSES),
        "features": list(detector.names),
        "motion": dataclasses.asdict(detector.features.motion),
        "layout": detector.layout,
        "layout_in_words": detector.layout_in_words,
        "smoother": {"kind": kind, **_plain(vars(detector.smoother))},
        "thresholds": dataclasses.asdict(detector.thresholds),
        "calibration": dataclasses.asdict(detector.calibration),
        "data": detector.data,
        "provenance": dict(detector.provenance),
    }


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


def read_detector(folder: str | Path) -> Detector:
    """Read a detector back.

    Parameters
    ----------
    folder : path
        A folder that :func:`write_detector` wrote.

    Raises
    ------
    InputError
        Where there is no detector in the folder; where it is of another version of scikit-learn, whose fitted
        classifiers need not mean the same; where it is too large, or holds a type that is not trusted.
    ResultError
        Where a file is damaged, or features and classifier do not fit together.
    """
    path = Path(folder)
    try:
        described = read_json(path / _DESCRIPTION, _REPAIR)
    except FileNotFoundError:
        raise InputError(str(path), f"has no {_DESCRIPTION}", "needs the folder of a detector") from None
    _check_versions(path, described)
    estimator = _loaded(path / _ESTIMATOR, described["sha256"])
    _check_estimator(path, described, estimator)
    smoother = dict(described["smoother"])
    made: Smoother = _SMOOTHERS[smoother.pop("kind")](**_tuples(smoother))
    return Detector(
        classifier=described["classifier"],
        estimator=estimator,
        features=FeatureSettings(candidate_named(described["classifier"]).sets, MotionSettings(**described["motion"])),
        names=tuple(described["features"]),
        layout=described["layout"],
        layout_in_words=described["layout_in_words"],
        smoother=made,
        thresholds=Thresholds(**described["thresholds"]),
        calibration=Calibration(**described["calibration"]),
        data=described["data"],
        provenance=described["provenance"],
    )


def _tuples(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}


def _check_versions(path: Path, described: Mapping[str, Any]) -> None:
    if described.get("format") != _FORMAT:
        raise DamagedError(
            str(path / _DESCRIPTION), f"has the format {described.get('format')}, not {_FORMAT}", _REPAIR
        )
    own, made = optional("sklearn").__version__, str(described["scikit_learn"])
    if own.split(".")[:2] != made.split(".")[:2]:
        allowed = f"needs the installed version {own}"
        raise InputError(str(path), f"was made with scikit-learn {made}", allowed, f"{_REPAIR}, or install {made}")
    if described["classes"] != list(CLASSES):
        raise DamagedError(str(path / _DESCRIPTION), f"has the classes {described['classes']}", _REPAIR)


def _loaded(path: Path, wanted: str) -> Any:
    try:
        with zipfile.ZipFile(path) as packed:
            size = sum(one.file_size for one in packed.infolist())
        if size > LARGEST:
            raise InputError(str(path), f"has {size / 1e6:.0f} MB", f"needs at most {LARGEST / 1e6:.0f} MB", _REPAIR)
        if file_digest(path) != wanted:
            raise DamagedError(str(path), f"is not the file that {_DESCRIPTION} names", _REPAIR)
    except (OSError, zipfile.BadZipFile) as error:
        raise DamagedError(str(path), f"cannot be read ({shortened(str(error))})", _REPAIR) from error
    store = optional("skops.io")
    strange = sorted(set(store.get_untrusted_types(file=path)) - TRUSTED)
    if strange:
        raise InputError(str(path), f"holds the type {strange[0]}", "needs types that are trusted", _REPAIR)
    return store.load(path, trusted=sorted(TRUSTED))


def _check_estimator(path: Path, described: Mapping[str, Any], estimator: Any) -> None:
    seen, classes = getattr(estimator, "n_features_in_", None), getattr(estimator, "classes_", np.zeros(0))
    if seen != len(described["features"]) or list(classes) != [0, 1, 2]:
        found = f"sees {seen} features and {len(classes)} classes, not {len(described['features'])} and 3"
        raise DamagedError(str(path / _ESTIMATOR), found, _REPAIR)
    for nodes, children, features in _trees(estimator):
        inside = (children >= -1) & (children < nodes)
        if not inside.all() or (features >= seen).any():
            raise DamagedError(str(path / _ESTIMATOR), "has a tree with branches that lead nowhere", _REPAIR)


def _trees(estimator: Any) -> Iterator[tuple[int, Any, Any]]:
    """Yield number of nodes, children and features of every fitted tree: compiled code follows them blindly."""
    steps = [one for _, one in estimator.steps] if hasattr(estimator, "steps") else [estimator]
    for step in steps:
        for one in getattr(step, "estimators_", [step]):
            tree = getattr(one, "tree_", None)
            if tree is not None:
                yield tree.node_count, np.stack([tree.children_left, tree.children_right]), tree.feature
        for one in (tree for stage in getattr(step, "_predictors", []) for tree in stage):
            nodes = one.nodes
            yield len(nodes), np.stack([nodes["left"], nodes["right"]]).astype(np.int64), nodes["feature_idx"]


def _card(detector: Detector) -> str:
    kept, motion = detector.calibration, detector.features.motion
    promise = "The threshold guarantees nothing, as too few trials were kept for it: slip is as likely as not."
    if kept.trials:
        like = f"if they are like the {kept.trials} that set the threshold"
        promise = f"At most {100 * kept.share:.3g} % of trials without slip raise a false alarm, {like}."
    seen = f"{len(detector.names)} features ({', '.join(detector.features.sets)})"
    lines = [
        f"# Slip detector: {detector.classifier}",
        "",
        f"Made by fingerslip {__version__} for {detector.layout_in_words}.",
        f"It sees {seen}; the first {motion.rest_frames} frames are at rest.",
        f"Learned from {', '.join(f'{name} {value}' for name, value in detector.provenance.items())}.",
        f"Hash of the data set: `{detector.data}`.",
        "",
        promise,
        "",
        "It knows the sensor, the surfaces and the motions that it learned from, and says nothing about others.",
    ]
    return "\n".join(lines) + "\n"
