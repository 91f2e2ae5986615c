"""Evaluations as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.evaluation.inquiries import CurvePoint
from fingerslip.detect.evaluation.robustness import Robustness, Sensitivity
from fingerslip.detect.evaluation.scores import Estimate, EventScores, FrameScores, Reliability
from fingerslip.detect.labels import CLASSES
from fingerslip.tables.table import Cell, Column, Missing, Table

if TYPE_CHECKING:
    from fingerslip.detect.live import Finding

__all__ = [
    "accuracy_table",
    "assumption_table",
    "calibration_table",
    "condition_table",
    "confusion_table",
    "curve_table",
    "estimate_text",
    "event_table",
    "findings_table",
    "frame_table",
    "importance_table",
    "left_out_table",
    "robustness_table",
    "score_table",
]

_INTERVALS = "Brackets: the middle 95 % over trials drawn anew."


def estimate_text(estimate: Estimate, digits: int = 3) -> Cell:
    """Return an estimate with its interval, such as '0.912 [0.894, 0.929]'."""
    if estimate.value is None:
        return Missing.NOT_DEFINED
    text = f"{estimate.value:z.{digits}f}"
    return text if estimate.low is None else f"{text} [{estimate.low:z.{digits}f}, {estimate.high:z.{digits}f}]"


def accuracy_table(by_trial: Mapping[str, FrameScores], by_sample: Mapping[str, Estimate], note: str) -> Table:
    """Return accuracies by trial beside those by sample, and the difference, which is what leaks."""
    rows: list[tuple[Cell, ...]] = []
    for name, scores in by_trial.items():
        other = by_sample[name].value
        leak: Cell = (
            Missing.NOT_DEFINED if other is None or scores.accuracy.value is None else other - scores.accuracy.value
        )
        rows.append((name, estimate_text(scores.accuracy), estimate_text(by_sample[name]), leak))
    columns = (Column("classifier"), Column("by trial"), Column("by sample"), Column("leakage", digits=3))
    return Table("Accuracy on frames", columns, tuple(rows), f"{note} {_INTERVALS}")


def assumption_table(sensitivities: Sequence[Sensitivity]) -> Table:
    """Return what accuracies come to with each value that may be assumed, and when labels then begin."""
    names = list(sensitivities[0].matrices)
    rows: list[tuple[Cell, ...]] = [
        (
            *(sensitivity.assumption.quantity, sensitivity.assumption.value, sensitivity.incipient, sensitivity.gross),
            *(estimate_text(sensitivity.accuracies[name]) for name in names),
        )
        for sensitivity in sensitivities
    ]
    times = (Column("median incipient slip", "s", 2), Column("median gross slip", "s", 2))
    columns = (Column("quantity"), Column("value"), *times, *(Column(name) for name in names))
    note = f"Accuracy on frames of trials that were not seen; one value changed in each row. {_INTERVALS}"
    return Table("Accuracy and what is assumed", columns, tuple(rows), note)


def condition_table(condition: str, estimates: Mapping[str, Mapping[str, Estimate]]) -> Table:
    """Return accuracies on the trials of each value of a condition, which were learned from in other trials."""
    names = list(next(iter(estimates.values())))
    rows = tuple((value, *(estimate_text(estimate[name]) for name in names)) for value, estimate in estimates.items())
    return Table(f"Accuracy by {condition}", (Column(condition), *(Column(name) for name in names)), rows, _INTERVALS)


def frame_table(by_trial: Mapping[str, FrameScores]) -> Table:
    """Return precision, recall and F1 of each class on trials that were not seen."""
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (name, entry, *(estimate_text(score[number]) for score in (scores.precision, scores.recall, scores.f1)))
        for name, scores in by_trial.items()
        for number, entry in enumerate(CLASSES)
    )
    columns = tuple(Column(name) for name in ("classifier", "class", "precision", "recall", "F1"))
    return Table("Classes, on trials that were not seen", columns, rows, _INTERVALS)


def confusion_table(matrices: Mapping[str, NDArray[np.intp]]) -> Table:
    """Return confusion matrices: a row for each true class."""
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (name, entry, *(int(count) for count in matrix[number]))
        for name, matrix in matrices.items()
        for number, entry in enumerate(CLASSES)
    )
    columns = (Column("classifier"), Column("true class"), *(Column(f"found {entry}") for entry in CLASSES))
    return Table("Confusion, frames", columns, rows)


def calibration_table(reliabilities: Mapping[str, Reliability]) -> Table:
    """Return how well calibrated the probabilities of slip are."""
    rows = tuple((name, reliability.error, reliability.brier) for name, reliability in reliabilities.items())
    columns = (Column("classifier"), Column("calibration error", digits=3), Column("Brier score", digits=3))
    note = "Expected calibration error of the probability of slip in ten bins; Brier score over the three classes."
    return Table("Calibration", columns, rows, note)


_EVENTS: tuple[tuple[str, str], ...] = (
    ("missed", "missed"),
    ("found before gross slip", "before_gross"),
    ("found before the label", "early"),
    ("false alarm", "at_rest"),
    ("onset error [s]", "error"),
    ("absolute error [s]", "absolute_error"),
    ("error, standard deviation [s]", "error_spread"),
    ("median delay [frames]", "delay_frames"),
    ("lead before gross slip [s]", "lead"),
    ("lead, standard deviation [s]", "lead_spread"),
    ("lead of 95 % of trials [s]", "bound"),
    ("gross slip found", "gross_found"),
    ("gross onset error [s]", "gross_error"),
)
_EVENT_NOTE = (
    "Errors are time found less label: negative is early. False alarm: at rest, or where there is no slip. "
    f"Lead of 95 %: conformal bound, needs 19 trials. {_INTERVALS}"
)


def event_table(scores: Mapping[str, EventScores], note: str = "") -> Table:
    """Return scores of events, a column for each classifier."""
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (label, *(_event(score, name) for score in scores.values())) for label, name in _EVENTS
    )
    columns = (Column("event"), *(Column(name) for name in scores))
    return Table("Onset of slip", columns, rows, f"{note} {_EVENT_NOTE}".strip())


def score_table(scores: EventScores, where: str) -> Table:
    """Return the scores of a submission."""
    table = event_table({f"{where}, {scores.trials} trials": scores})
    return Table("Benchmark", table.columns, table.rows, table.note)


def _event(scores: EventScores, name: str) -> Cell:
    value = getattr(scores, name)
    match value:
        case Estimate():
            return estimate_text(value)
        case None:
            return Missing.NOT_DEFINED
        case int():
            return str(value)
        case _:
            return f"{value:z.3f}"


def left_out_table(key: str, rows: Sequence[tuple[str, str, int, Estimate]]) -> Table:
    """Return accuracies where a condition was left out: classifier, its value, number of trials and accuracy."""
    columns = (Column("classifier"), Column(f"{key} left out"), Column("trials"), Column("accuracy"))
    cells = tuple((name, value, count, estimate_text(accuracy)) for name, value, count, accuracy in rows)
    return Table(f"Accuracy where {key} was not seen", columns, cells, _INTERVALS)


def curve_table(points: Sequence[CurvePoint]) -> Table:
    """Return a learning curve."""
    columns = (Column("trials"), Column("accuracy"), Column("mean F1"))
    rows = tuple((point.trials, estimate_text(point.accuracy), estimate_text(point.f1)) for point in points)
    return Table("Learning curve", columns, rows, _INTERVALS)


def importance_table(drops: Mapping[int, Estimate]) -> Table:
    """Return how much accuracy falls without each ring."""
    columns = (Column("ring"), Column("drop in accuracy"))
    rows = tuple((ring, estimate_text(drop)) for ring, drop in drops.items())
    return Table("Importance of rings", columns, rows, f"Ring 0 is the centre. {_INTERVALS}")


def robustness_table(results: Sequence[Robustness]) -> Table:
    """Return accuracies under disturbances."""
    columns = (Column("disturbance"), Column("amount"), Column("accuracy"), Column("unusable", digits=3))
    rows = tuple(
        (result.disturbance, result.amount, estimate_text(result.accuracy), result.unusable) for result in results
    )
    return Table("Robustness, all frames of the test trials", columns, rows, _INTERVALS)


def findings_table(findings: list[Finding], title: str, note: str) -> Table:
    """Return what a detector found, and how long it took; the note says what is in that time."""
    # What the detector ran in is slow to load, and no other table needs it.
    from fingerslip.detect.live import latency_of

    latency, onsets = latency_of(findings), findings[-1].onsets
    rows: tuple[tuple[Cell, ...], ...] = (
        ("slip begins [s]", Missing.NO_EVENT if onsets.incipient is None else f"{onsets.incipient:.4g}"),
        ("gross slip begins [s]", Missing.NO_EVENT if onsets.gross is None else f"{onsets.gross:.4g}"),
        ("frames", str(latency.frames)),
        ("median latency [ms]", f"{1e3 * latency.median:.3g}"),
        ("latency of 95 % of frames below [ms]", f"{1e3 * latency.late:.3g}"),
        ("frames a second", f"{latency.rate:.4g}"),
    )
    return Table(title, (Column(""), Column("value")), rows, note)
