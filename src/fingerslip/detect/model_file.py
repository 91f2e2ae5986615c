"""Detectors on disk: a folder with the classifier (skops, never pickle), what it was made for, and a card."""

from __future__ import annotations

import dataclasses
import io
import json
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.detect.classifiers import optional, probabilities
from fingerslip.detect.labels import CLASSES
from fingerslip.detect.training import TESTED, TIME_ERROR, UNLIKE, Detector, candidate_of_name
from fingerslip.errors import DamagedError, InputError, shorten
from fingerslip.storage.files import (
    check_digests,
    check_replaceable,
    file_digest,
    new_folder,
    read_json,
    write_bytes,
    write_json,
    write_text,
)
from fingerslip.tables.table import Column, Table, to_markdown
from fingerslip.version import __version__

#: Largest classifier that is loaded [byte], unpacked.
LARGEST = 500_000_000

#: Types beyond those that skops trusts by itself: fitted trees of scikit-learn; their indices are checked once loaded.
TRUSTED = frozenset({"sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor", "sklearn.tree._tree.Tree"})

_FORMAT = 1
_DESCRIPTION, _ESTIMATOR = "detector.json", "classifier.skops"
_REPAIR = "train the detector again"


def write_detector(detector: Detector, folder: str | Path) -> None:
    """Write a detector as a folder, whole or not at all; one that is there is replaced when the new one is whole."""
    described = _description(detector)
    stored = optional("skops.io").dumps(detector.estimator)
    check_replaceable(Path(folder), _DESCRIPTION)
    with new_folder(Path(folder)) as partial:
        write_bytes(partial / _ESTIMATOR, stored)
        described["sha256"] = file_digest(partial / _ESTIMATOR)
        write_json(partial / _DESCRIPTION, described)
        title = f"# Slip detector: {detector.classifier}\n\nMade by fingerslip {__version__}."
        says = "It knows the sensor, the surfaces and the motions that it learned from, and says nothing about others."
        write_text(partial / "README.md", f"{title}\n\n{to_markdown(detector_table(detector))}\n{says}\n")


def _description(detector: Detector) -> dict[str, Any]:
    description = {
        "format": _FORMAT,
        "fingerslip": __version__,
        "scikit_learn": optional("sklearn").__version__,
        "classifier": detector.classifier,
        "classes": CLASSES,
        "features": detector.names,
        "motion": dataclasses.asdict(detector.features.motion),
        "layout": detector.layout,
        "layout_in_words": detector.layout_in_words,
        "smoother": {"kind": "forward_filter", **dataclasses.asdict(detector.smoother)},
        "thresholds": vars(detector.thresholds),
        "calibration": vars(detector.calibration),
        "data": detector.data,
        "frame_rate": detector.frame_rate,
        "provenance": dict(detector.provenance),
        "ranges": detector.ranges,
    }
    plain: dict[str, Any] = json.loads(json.dumps(description))
    return plain


def read_detector(folder: str | Path) -> Detector:
    """Read a detector back from a folder that :func:`write_detector` wrote.

    InputError where there is none, where it is of another version of scikit-learn, whose fitted classifiers need not
    mean the same, is too large, or holds a type that is not trusted; ResultError where it is damaged.
    """
    path = Path(folder)
    try:
        described = read_json(path / _DESCRIPTION, _REPAIR)
    except FileNotFoundError:
        raise InputError(str(path), f"has no {_DESCRIPTION}", "needs the folder of a detector") from None
    installed, written = optional("sklearn").__version__, shorten(str(described.get("scikit_learn")))
    if installed.split(".")[:2] != written.split(".")[:2]:
        fault, allowed = f"was made with scikit-learn {written}", f"needs the installed version {installed}"
        raise InputError(str(path), fault, allowed, f"{_REPAIR}, or install {written}")
    detector = _described_detector(path, described)
    estimator = _load_estimator(path / _ESTIMATOR, described.get("sha256"))
    # An estimator is used only if it is the classifier of the description, whole and of finite numbers.
    try:
        fault = next(filter(None, _faults(detector, estimator)), "")
    except Exception as error:
        raise DamagedError(str(path / _ESTIMATOR), f"is no classifier ({shorten(str(error))})", _REPAIR) from error
    if fault:
        raise DamagedError(str(path / _ESTIMATOR), fault, _REPAIR)
    return dataclasses.replace(detector, estimator=estimator)


def _described_detector(path: Path, described: Mapping[str, Any]) -> Detector:
    """Return the detector of a description, without its estimator; its own description must be the same again."""
    try:
        values = {
            **described,
            "estimator": None,
            "names": described["features"],
            "features": {"sets": candidate_of_name(described["classifier"]).sets, "motion": described["motion"]},
            "smoother": {name: value for name, value in described["smoother"].items() if name != "kind"},
        }
        detector = pydantic.TypeAdapter(Detector).validate_python(values)
        # Older detectors do not say their frame rate, nor their ranges.
        again = _description(detector) | {name: described[name] for name in ("fingerslip", "scikit_learn", "sha256")}
        wrong = sorted(name for name in {**described, **again} if described.get(name) != again.get(name))
    # Any other value may stand in any place.
    except Exception as error:
        fault = f"describes no detector ({shorten(str(error))})"
        raise DamagedError(str(path / _DESCRIPTION), fault, _REPAIR) from error
    if wrong:
        raise DamagedError(str(path / _DESCRIPTION), f"has another {wrong[0]!r} than a detector has", _REPAIR)
    return detector


def _load_estimator(path: Path, wanted: object) -> Any:
    try:
        with zipfile.ZipFile(path) as packed:
            size = sum(member.file_size for member in packed.infolist())
        if size > LARGEST:
            raise InputError(str(path), f"has {size / 1e6:.0f} MB", f"needs at most {LARGEST / 1e6:.0f} MB", _REPAIR)
    except (OSError, zipfile.BadZipFile) as error:
        raise DamagedError(str(path), f"cannot be read ({shorten(str(error))})", _REPAIR) from error
    check_digests(path.parent, {path.name: wanted}, f"is not the file that {_DESCRIPTION} names", _REPAIR)
    store = optional("skops.io")
    try:
        _check_trees(path)
        strange = sorted(set(store.get_untrusted_types(file=path)) - TRUSTED)
        estimator = None if strange else store.load(path, trusted=sorted(TRUSTED))
    # Whose checksums are right may still be made to fail in any way.
    except Exception as error:
        raise DamagedError(str(path), f"cannot be read ({shorten(str(error))})", _REPAIR) from error
    if strange:
        raise InputError(str(path), f"holds the type {strange[0]}", "needs types that are trusted", _REPAIR)
    return estimator


def _check_trees(path: Path) -> None:
    """Refuse trees whose arrays are not of the sizes that they claim: scikit-learn's own loader reads beyond them."""

    def trees(part: Any) -> Iterator[dict[str, Any]]:
        if isinstance(part, dict) and part.get("__class__") == "Tree":
            yield part
        for inner in part.values() if isinstance(part, dict) else part if isinstance(part, list) else ():
            yield from trees(inner)

    with zipfile.ZipFile(path) as packed:
        arrays = {
            name: np.load(io.BytesIO(packed.read(name)), allow_pickle=False)
            for name in packed.namelist()
            if name.endswith(".npy")
        }
        schema = json.loads(packed.read("schema.json"))
    for tree in trees(schema):
        _, classes, outputs = tree["__reduce__"]["args"]["content"]
        state = tree["content"]["content"]
        count, nodes = int(state["node_count"]["content"]), arrays[state["nodes"]["file"]]
        values = arrays[state["values"]["file"]]
        sizes = arrays[classes["file"]].tolist(), outputs["content"], nodes.shape, values.shape
        if sizes != ([3], "1", (count,), (count, 1, 3)):
            raise ValueError("a tree of other sizes than it claims")


def _faults(detector: Detector, estimator: Any) -> Iterator[str]:
    """Yield what is wrong with an estimator, or nothing, check by check; each relies on those before it."""
    count, seen, classes = len(detector.names), estimator.n_features_in_, list(estimator.classes_)
    if seen != count or classes != [0, 1, 2]:
        yield f"sees {seen} features and {len(classes)} classes, not {count} and 3"
    kinds, needed = (
        [type(step) for step in (model, *(step for _, step in getattr(model, "steps", ())))]
        for model in (estimator, candidate_of_name(detector.classifier).make(0))
    )
    yield "" if kinds == needed else f"is not the classifier {detector.classifier}"
    is_ranged = detector.ranges is None or np.shape(detector.ranges) == (2, 2, count)
    yield "" if is_ranged else f"has other ranges than those of {count} features"
    for tree in (step.tree_ for step in getattr(estimator, "estimators_", [estimator]) if hasattr(step, "tree_")):
        children = np.stack([tree.children_left, tree.children_right])
        is_whole = tree.capacity == tree.node_count and tree.value.shape == (tree.node_count, 1, 3)
        is_split = (children != -1).any(axis=0)
        fault = _node_fault(children[:, is_split], is_split, tree.feature, tree.threshold, tree.value, seen=count)
        yield fault if is_whole and tree.n_features == count else "has a tree of another kind"
    for nodes in (tree.nodes for stage in getattr(estimator, "_predictors", ()) for tree in stage):
        is_split = nodes["is_leaf"] == 0
        children, arrays = np.stack([nodes["left"], nodes["right"]]), (nodes["feature_idx"], nodes["num_threshold"])
        fault = _node_fault(children.astype(np.int64)[:, is_split], is_split, *arrays, nodes["value"], seen=count)
        yield "has a tree of another kind" if nodes["is_categorical"].any() else fault
    # Compiled code follows trees blindly, and they are right; all else fails here, or shows in the numbers.
    with np.errstate(all="ignore"):
        chances = probabilities(estimator, np.zeros((1, count), dtype=np.float32))
    is_right = chances.shape == (1, 3) and np.isfinite(chances).all() and abs(chances.sum() - 1.0) < 1e-6
    yield "" if is_right else f"gives the probabilities {shorten(str(chances.tolist()))}"


def _node_fault(children: Any, is_split: Any, feature: Any, threshold: Any, value: Any, *, seen: int) -> str:
    """Return what is wrong with the nodes of a tree; every way down must end, at finite numbers.

    `children` is (2, n_splits), `value` (n_nodes, ...), and the others (n_nodes,).
    """
    splits, features = np.flatnonzero(is_split), feature[is_split]
    if not len(value) or ((children <= splits) | (children >= len(value))).any():
        return "has a tree with branches that lead nowhere"
    if ((features < 0) | (features >= seen)).any():
        return f"has a tree of other features than its {seen}"
    is_finite = np.isfinite(threshold[is_split]).all() and np.isfinite(value).all()
    return "" if is_finite else "has a tree whose thresholds or values are no numbers"


def detector_table(detector: Detector, shares: Floats | None = None) -> Table:
    """Return what a detector is and learned from, how it did in tests, and how far beyond that a clip is (2,)."""
    calibration, learned, motion = detector.calibration, dict(detector.provenance), detector.features.motion
    (count, unlike), error = learned.pop(TESTED, (0, 0)), learned.pop(TIME_ERROR, ())
    rate = "" if detector.frame_rate is None else f" at {detector.frame_rate:.4g} frames/s"
    promise = "no guarantee: too few trials were kept for the threshold; slip is as likely as not"
    if calibration.trials:
        like = f"if they are like the {calibration.trials} that set the threshold"
        promise = f"in at most {100 * calibration.share:.3g} % of trials without slip, {like}"
    beyond = (
        f"{unlike} of {count} others in tests: more than {100 * UNLIKE:g} % of the features beyond the range learned"
    )
    rows = [
        ("sees", f"{len(detector.names)} features ({', '.join(detector.features.sets)})"),
        ("is for", f"{detector.layout_in_words}{rate}; the first {motion.rest_frames} frames are at rest"),
        ("learned from", ", ".join(f"{name} {value}" for name, value in learned.items())),
        ("hash of that data set", detector.data),
        ("false alarms", promise),
        ("error of the time of slip", time_error_text(error)),
        ("called unlike the trials that it learned from", beyond if count else "not tested"),
    ]
    if shares is not None:
        at_rest, later = 100 * shares
        rows.append(("features of this clip beyond that range", f"{at_rest:.0f} % at rest, {later:.0f} % later"))
    return Table("The detector", (Column(""), Column("value")), tuple(rows))


def time_error_text(error: Sequence[float]) -> str:
    """Say how far times of slip were off in tests, by their sizes, mean [s] and number; nothing is not known."""
    if not error:
        return "not known"
    middle, low, high, *others = (f"{1e3 * value:.0f}" for value in error[:4])
    mean, count = (f", {others[0]} ms in the mean", f"{error[4]} ") if others else ("", "")
    return f"{middle} ms in size ({low} to {high}){mean}, in {count}trials that the detector did not learn from"
