"""Samples that stand for all of a study: the middle one, the earliest and the latest, seen in motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import median

from fingerslip.report.labels import short_labels, swept_text
from fingerslip.report.page.content import ReportContent
from fingerslip.report.page.page import ReportSection
from fingerslip.report.tables.table import Cell, Column, Table
from fingerslip.results import REPEAT, SAMPLE, RunResult, StudyResult
from fingerslip.slip.names import MAIN_EVENTS, event_label
from fingerslip.units import split_quantity

__all__ = ["Representative", "representatives", "samples_in_motion"]


@dataclass(frozen=True)
class Representative:
    """A sample that stands for others."""

    run: RunResult  # the run of the sample
    title: str  # what it is among the samples, such as 'earliest overall slip'
    event: str  # the event that it was chosen by
    since: float  # time of that event from the start of the slide [s]


def representatives(study: StudyResult, starts: Mapping[str, float]) -> tuple[Representative, ...]:
    """Choose samples by overall slip, or by an earlier event where no sample reaches that.

    Units: starts [s].
    """
    for event in reversed(MAIN_EVENTS):
        since = {
            run.name: time - starts[run.name]
            for run in study.runs
            if run.name in starts and (time := run.events.slip.time(event)) is not None
        }
        if since:
            break
    else:
        return ()
    middle, words = median(since.values()), event_label(event)
    titles = {
        min(since, key=lambda name: abs(since[name] - middle)): f"{words} nearest to the median",
        min(since, key=since.__getitem__): f"earliest {words}",
        max(since, key=since.__getitem__): f"latest {words}",
    }
    runs = {run.name: run for run in study.runs}
    return tuple(Representative(runs[name], title, event, since[name]) for name, title in titles.items())


def samples_in_motion(content: ReportContent) -> ReportSection:
    """Return the section that shows representative samples in motion, and their values."""
    # Loads what draws, which choosing does not need.
    from fingerslip.report.page.motion import run_motions

    chosen = [one for one in representatives(content.study, content.starts) if one.run.name in content.representatives]
    motions = run_motions(
        (content.representatives[one.run.name], one.run.events, one.title.capitalize()) for one in chosen
    )
    text = (
        "Move the slider or the plots; a body that was recorded is drawn deformed, to scale. "
        "Of all samples, the one in the middle and "
        "those at both ends are shown."
    )
    shown = chosen[: len(motions)]
    return ReportSection("Samples in motion", (text,), (_values_table(shown),) if motions else (), motions=motions)


def _values_table(shown: list[Representative]) -> Table:
    """Show what the samples are: when they slip, and the values that are their own."""
    values = [
        {path: value for path, value in {**one.run.swept, **one.run.sampled}.items() if path not in (SAMPLE, REPEAT)}
        for one in shown
    ]
    paths = tuple(dict.fromkeys(path for own in values for path in own))
    labels = short_labels(paths)
    columns = (
        Column("sample"),
        Column(event_label(shown[0].event), "s", 3),
        *(Column(labels[path]) for path in paths),
    )
    rows = tuple(
        (one.title, one.since, *(_shown(own.get(path)) for path in paths))
        for one, own in zip(shown, values, strict=True)
    )
    return Table("The samples in motion", columns, rows, "Slip in seconds from the start of the slide.")


def _shown(value: object) -> Cell:
    """Return a value with four digits, which samples have by chance."""
    if isinstance(value, str):
        parts = split_quantity(value)
        return f"{parts[0]:.4g} {parts[1]}" if parts else value
    return float(f"{value:.4g}") if isinstance(value, float) else swept_text(value)
