"""The report of two studies side by side: what differs in their values, and what that does to the slip events."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fingerslip.report.citations import bibtex_entries
from fingerslip.report.figures.study import Pair, paired_figure, time_into_slide
from fingerslip.report.labels import run_title, swept_text
from fingerslip.report.page.page import Picture, Report, ReportSection
from fingerslip.report.prose import prose
from fingerslip.report.tables.compare import difference_cell, differences_table
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.report.tables.runs import events_table, time_cell
from fingerslip.results import RunResult, StudyResult
from fingerslip.slip.windows import EVENTS, LATENCY, NOTICED_NOTE
from fingerslip.tables.table import Column, Missing, Table


@dataclass(frozen=True)
class ComparedStudy:
    """A study that is compared with another."""

    study: StudyResult  # the study
    values: Sequence[ShownValue]  # all values of its runs with their sources
    starts: Mapping[str, float]  # when the slide of each run begins [s], by its name

    @property
    def title(self) -> str:
        """Its title, or the name of its folder."""
        return self.study.title or self.study.folder.name


def pairs_of(first: StudyResult, second: StudyResult) -> tuple[Pair, ...]:
    """Return the runs that two studies have in common: with the same swept values, or the only run of each."""
    if len(first.runs) == len(second.runs) == 1:
        return (Pair("the run", first.runs[0], second.runs[0]),)
    others = {_key(run): run for run in second.runs}
    return tuple(Pair(run_title(run, "the run"), run, others[_key(run)]) for run in first.runs if _key(run) in others)


def _key(run: RunResult) -> tuple[tuple[str, str], ...]:
    return tuple(sorted((path, str(swept_text(value))) for path, value in run.swept.items()))


def comparison_report(first: ComparedStudy, second: ComparedStudy, provenance: Mapping[str, str]) -> Report:
    """Assemble the report of two studies."""
    pairs, names = pairs_of(first.study, second.study), (f"A: {first.title}", f"B: {second.title}")
    values = [{value.path: value.value for value in compared.values} for compared in (first, second)]
    differing = differences_table(values[0], values[1], same="Both studies have the same values.")
    hero: tuple[Picture, ...] = ()
    if pairs:
        figure = paired_figure(pairs, names, (first.starts, second.starts))
        hero = (Picture("paired", "Runs that both studies have.", figure),)
    tables = (
        dataclasses.replace(events_table(compared.study.runs), title=name)
        for name, compared in zip(names, (first, second), strict=True)
    )
    sections = (
        ReportSection("Differences of slip events", names, (_differences(pairs),) if pairs else ()),
        ReportSection("Values that differ", (), (differing,)),
        ReportSection("Slip events of each study", (), tuple(tables)),
        ReportSection("Citations", code=bibtex_entries([*first.values, *second.values], ()), folded=True),
    )
    count = len(differing.rows)
    name = "no-difference" if not count else "one-difference" if count == 1 else "differences"
    said = prose("sections", name, {"count": count})
    return Report(
        f"{first.title} beside {second.title}",
        tuple(section for section in sections if not section.is_empty),
        provenance,
        answer=(said, _change(pairs, first, second)),
        hero=hero,
    )


def _change(pairs: Sequence[Pair], first: ComparedStudy, second: ComparedStudy) -> str:
    """Say how much later overall slip of the second study comes."""
    if not pairs:
        return "The studies have no runs with the same swept values, so that none can be compared one by one."
    times = [(time_into_slide(pair.first, first.starts), time_into_slide(pair.second, second.starts)) for pair in pairs]
    changes = [1e3 * (late - early) for early, late in times if math.isfinite(late - early)]
    many = f"{len(pairs)} runs" if len(pairs) > 1 else "the run"
    if not changes:
        return f"Of {many} that both studies have, none reaches overall slip in both."
    low, high = min(changes), max(changes)
    if max(abs(low), abs(high)) < 0.5:
        return f"In {many} that both studies have, overall slip comes at the same time, to the millisecond."
    span = _with_sign(low) if f"{low:.0f}" == f"{high:.0f}" else f"{_with_sign(low)} to {_with_sign(high)}"
    return f"In {many} that both studies have, overall slip of B comes {span} into the slide than that of A."


def _with_sign(change: float) -> str:
    return f"{abs(change):.0f} ms {'later' if change >= 0.0 else 'earlier'}"


def _differences(pairs: Sequence[Pair]) -> Table:
    columns = (Column("run"), Column("event"), Column("A", "s", 3), Column("B", "s", 3), Column("B - A", "ms", 0))
    rows = tuple(
        (pair.title, name, first, second, next(missing, None) or difference_cell(first, second, 1e3))
        for pair in pairs
        for time, name in {**EVENTS, LATENCY: LATENCY}.items()
        for first, second in [(time_cell(pair.first, "slip", time), time_cell(pair.second, "slip", time))]
        for missing in [(cell for cell in (first, second) if isinstance(cell, Missing))]
    )
    return Table("Slip events from accumulated slip, from the start of the run", columns, rows, NOTICED_NOTE)
