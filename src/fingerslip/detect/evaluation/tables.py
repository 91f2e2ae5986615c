"""The tables of evaluations, inquiries and scores, and where they are written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from fingerslip.detect.evaluation.crossval import Unseen
from fingerslip.detect.evaluation.inquiries import Sensitivity
from fingerslip.detect.evaluation.scores import (
    Estimate,
    EventScores,
    FrameScores,
    frame_scores_of,
)
from fingerslip.detect.labels import CLASSES
from fingerslip.storage.files import write_text, writing
from fingerslip.tables.table import Cell, Column, Interval, Missing, Table, to_csv, to_page

INTERVALS = "Brackets: the middle 95 % over trials drawn anew."
_THREE_DIGITS = ("leakage", "calibration error", "Brier score", "unusable")


def _cell(value: object) -> Cell:
    """Return a value as a cell, an estimate with its interval."""
    if isinstance(value, Estimate):
        return Missing.NOT_DEFINED if value.value is None else Interval(value.value, value.low, value.high)
    return Missing.NOT_DEFINED if value is None else value  # type: ignore[return-value]


def table_of(
    title: str, names: Sequence[str | Column], rows: Sequence[Sequence[object]], note: str = INTERVALS
) -> Table:
    """Return a table of estimates with their intervals, and other values."""
    columns = tuple(
        name if isinstance(name, Column) else Column(name, digits=3) if name in _THREE_DIGITS else Column(name)
        for name in names
    )
    return Table(title, columns, tuple(tuple(map(_cell, row)) for row in rows), note)


def accuracy_table(by_trial: Mapping[str, FrameScores], by_sample: Mapping[str, Estimate], note: str) -> Table:
    """Return accuracies by trial beside those by sample, and the difference, which is what leaks."""
    rows: list[tuple[object, ...]] = []
    for name, scores in by_trial.items():
        accuracy, other = scores.accuracy, by_sample[name]
        leak = None if accuracy.value is None or other.value is None else other.value - accuracy.value
        rows.append((name, accuracy, other, leak, scores.two_class))
    names = ("classifier", "by trial", "by sample", "leakage", "gross or not, by trial")
    return table_of("Accuracy on frames", names, rows, f"{note} {INTERVALS}")


def assumption_table(sensitivities: Sequence[Sensitivity]) -> Table:
    """Return what accuracies come to with each value that may be assumed, and when labels then begin."""
    rows = [
        (entry.assumption.quantity, entry.assumption.value, entry.incipient, entry.gross, *entry.accuracies.values())
        for entry in sensitivities
    ]
    times = (Column("median incipient slip", "s", 2), Column("median gross slip", "s", 2))
    note = f"Accuracy on frames of trials that were not seen; one value changed in each row. {INTERVALS}"
    names: list[str | Column] = ["quantity", "value", *times, *sensitivities[0].matrices]
    return table_of("Accuracy and what is assumed", names, rows, note)


def frame_tables(by_trial: Mapping[str, FrameScores]) -> list[Table]:
    """Return precision, recall and F1 of each class on trials that were not seen, and the confusion of their frames."""
    classes, confusions = [], []
    for name, scores in by_trial.items():
        for number, entry in enumerate(CLASSES):
            classes.append((name, entry, scores.precision[number], scores.recall[number], scores.f1[number]))
            confusions.append((name, entry, *map(int, scores.matrix[number])))
    names = ("classifier", "class", "precision", "recall", "F1")
    columns = ("classifier", "true class", *(f"found {entry}" for entry in CLASSES))
    return [
        table_of("Classes, on trials that were not seen", names, classes),
        table_of("Confusion, frames", columns, confusions, ""),
    ]


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
    f"Lead of 95 %: conformal bound, needs 19 trials. {INTERVALS}"
)


def event_table(scores: Mapping[str, EventScores], note: str = "", title: str = "Onset of slip") -> Table:
    """Return scores of events, a column for each classifier."""

    def text(value: object) -> object:
        return f"{value:z.3f}" if isinstance(value, float) else str(value) if isinstance(value, int) else value

    rows = [(label, *(text(getattr(entry, name)) for entry in scores.values())) for label, name in _EVENTS]
    return table_of(title, ("event", *scores), rows, f"{note} {_EVENT_NOTE}".strip())


def unseen_tables(result: Unseen) -> list[Table]:
    """Return the tables of what was found: onsets in both readings, classes and confusion of all frames."""
    frames = {"all frames": frame_scores_of(result.matrices)}
    warning = f"Warning: the data set {result.rate_fault}. " if result.rate_fault else ""
    note = f"{warning}Single frames: the first that is more likely slip than not, without smoothing or guarantee."
    return [event_table(result.scores, note), *frame_tables(frames)]


def output_tables(tables: Sequence[Table], folder: Path | None = None) -> str:
    """Return tables in Markdown, and write each as a CSV file where a folder is given."""
    if folder is not None:
        names = ("-".join(table.title.lower().replace(",", "").split()) for table in tables)
        numbered = enumerate(zip(names, tables, strict=True), start=1)
        write_tables({f"{number}-{name}": table for number, (name, table) in numbered}, folder)
    return to_page(tables)


def write_tables(tables: Mapping[str, Table], folder: Path) -> None:
    """Write tables as CSV files by their names; other files of the folder stay."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for name, table in tables.items():
        write_text(folder / f"{name}.csv", to_csv(table))
