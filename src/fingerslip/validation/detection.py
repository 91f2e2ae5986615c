"""The detectors of Cordova Bulens et al. (2023) beside the same ones on simulated slides.

The data set takes long, so the rows are stored, and read back unless they are asked for.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from fingerslip.detect.labels import NO_SLIP
from fingerslip.published import PublishedValue, published_set
from fingerslip.validation.evidence import Work
from fingerslip.validation.rows import Row, RowFile, Stored, number_row, statement_row, stored_rows
from fingerslip.validation.sensor import half_width, trials_of

# What simulates, samples and trains is loaded where rows are computed: stored ones are read without it.
if TYPE_CHECKING:
    from fingerslip.detect.evaluation.crossval import Evaluation
    from fingerslip.detect.evaluation.scores import Estimate, FrameScores
    from fingerslip.detect.trial_set import TrialSet

#: The study of the data set.
DATA_SET = "bulens2023_dataset"
#: Where the rows are stored.
DETECTION_FILE = RowFile(
    "detection.json", "rows of detectors", "fingerslip validate --detection", "about an hour", (DATA_SET,), Row
)

_FOLDS = 5
#: Conditions that are left out, and how that is called.
_LEFT_OUT: Mapping[str, str] = MappingProxyType(
    {
        "direction": "a direction not seen",
        "indentation": "an indentation not seen",
        "friction_coefficient": "a quarter of the frictions not seen",
    }
)
_MACHINES = ("svm_linear", "svm_rbf")
#: Classifiers that the paper has not: they stand beside its forest, and are not judged by it.
_OTHERS = ("boosting", "logistic")
_COMPARED = ("forest", *_MACHINES, *_OTHERS)
_NUMBERS, _STATEMENTS = "bulens2023_detection-numbers", "bulens2023_detection-statements"
_CLASSES = ("no-slip", "incipient", "gross")
#: One unit of the last printed digit of each published number.
_RESOLUTIONS: Mapping[str, float] = MappingProxyType(
    {
        "forest-accuracy": 1e-4,
        "svm-accuracy": 1e-3,
        "forest-no-slip-precision": 1e-2,
        "forest-no-slip-recall": 1e-2,
        "forest-incipient-precision": 1e-2,
        "forest-incipient-recall": 1e-4,
        "forest-gross-precision": 1e-3,
        "forest-gross-recall": 1e-4,
    }
)

_ACCURACIES = ("forest-accuracy", "svm-accuracy")


@dataclass(frozen=True)
class Detection:
    """Scores on single frames, by name of the classifier."""

    by_sample: Mapping[str, FrameScores]  # with frames split 90 to 10 whatever their trial
    by_trial: Mapping[str, FrameScores]  # on trials that were not seen, in five folds
    left_out: Mapping[str, Mapping[str, FrameScores]] = field(default_factory=dict)


def detection_rows(work: Work, *, compute: bool = False) -> Stored[Row]:
    """Return the rows of the detectors: computed and stored, or those that were stored last."""
    output = work.results / "detection"

    def make_rows() -> tuple[Row, ...]:
        return rows_of_detection(detection_of(begun_detection(trials_of(DATA_SET, work), work.workers, output)))

    stored = stored_rows(DETECTION_FILE, work, make_rows if compute else None)
    if stored.computed:
        from fingerslip.detect.evaluation.crossval import parts_beside

        parts_beside(output).remove()
    return stored


def begun_detection(trials: TrialSet, workers: int = 2, output: Path | None = None) -> Evaluation:
    """Sample the frames of the data set as published."""
    from fingerslip.detect.classifiers import CLASSIFIERS
    from fingerslip.detect.evaluation.crossval import begin_evaluation
    from fingerslip.detect.motion import MotionSettings
    from fingerslip.detect.samples import Sampling

    candidates = [CLASSIFIERS[name] for name in _COMPARED]
    return begin_evaluation(
        trials, trials.onsets(), candidates, MotionSettings(), Sampling(), workers=workers, output=output
    )


def detection_of(begun: Evaluation) -> Detection:
    """Fit the forest and both support vector machines as published, the other two beside them, and score them."""
    from fingerslip.detect.classifiers import CLASSIFIERS
    from fingerslip.detect.evaluation.scores import frame_scores_of
    from fingerslip.detect.samples import grouped_folds, left_out

    def scores_of(tests: Sequence[Sequence[str]]) -> dict[str, FrameScores]:
        return {name: begun.scores(begun.by_group(CLASSIFIERS[name], tests)) for name in _COMPARED}

    trials = begun.trials
    by_sample = {name: frame_scores_of(begun.by_sample(CLASSIFIERS[name])) for name in _COMPARED}
    by_trial = scores_of(grouped_folds(trials.names, _FOLDS, 0))
    groups = {words: left_out(trials.conditions, condition) for condition, words in _LEFT_OUT.items()}
    left = {words: scores_of(tuple(group.values())) for words, group in groups.items()}
    return Detection(by_sample, by_trial, left)


def rows_of_detection(detection: Detection) -> tuple[Row, ...]:
    """Return a row for each published value in both splits, and for accuracies with conditions left out."""
    splits = {"frames split 90 to 10": detection.by_sample, "trials not seen": detection.by_trial}
    return (
        *(row for split, scores in splits.items() for row in _rows(split, scores)),
        *(row for split, scores in detection.left_out.items() for row in _number_rows(split, scores, _ACCURACIES)),
    )


def _rows(split: str, scores: Mapping[str, FrameScores]) -> Iterator[Row]:
    yield from _number_rows(split, scores, _RESOLUTIONS)
    for value in published_set(_STATEMENTS).values:
        slips = scores["forest"].matrix[NO_SLIP + 1 :]
        row = statement_row(value, float(slips[:, NO_SLIP].sum() / slips.sum()), None)
        yield replace(row, quantity=f"{row.quantity}; simulated slides, {split}")


def _number_rows(split: str, scores: Mapping[str, FrameScores], wanted: Collection[str]) -> Iterator[Row]:
    """Yield a row for each published number and each of ours that is compared with it."""
    for value in published_set(_NUMBERS).values:
        kind, _, rest = value.id.partition("-")
        compared = [(f"accuracy, {name}", scores[name].accuracy) for name in (_MACHINES if kind == "svm" else (kind,))]
        if rest != "accuracy":
            entry, _, score = rest.rpartition("-")
            compared = [(f"{score} of {entry}, forest", getattr(scores["forest"], score)[_CLASSES.index(entry)])]
        for name, estimate in compared if value.id in wanted else ():
            yield _number_row(f"{name}, simulated slides, {split}", value, estimate)
        for name in _OTHERS if value.id == "forest-accuracy" else ():
            words = f"accuracy, {name} beside the published forest, simulated slides, {split}"
            yield _number_row(words, value, scores[name].accuracy, comparable=False)


def _number_row(name: str, value: PublishedValue, estimate: Estimate, *, comparable: bool = True) -> Row:
    """Return a row whose uncertainty is half the interval over trials drawn anew."""
    resolution, uncertainty = _RESOLUTIONS[value.id], half_width(estimate)
    return number_row(name, value, estimate.value, uncertainty, resolution=resolution, comparable=comparable)
