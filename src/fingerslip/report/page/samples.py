"""The sections of the report of a study with samples."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from fingerslip.errors import DamagedError, ResultError
from fingerslip.libraries import pd
from fingerslip.published import PublishedSet
from fingerslip.report.content import ReportContent
from fingerslip.report.figures.study import tornado_figure
from fingerslip.report.labels import path_labels, prose, swept_text
from fingerslip.report.page.page import Picture, ReportSection
from fingerslip.report.tables.runs import summary_table
from fingerslip.report.tables.samples import intervals_table, published_table, refused_table, sensitivity_table
from fingerslip.results import FIT, REPEAT, SAMPLE, RunResult, StudyResult, stored_fit
from fingerslip.sampling.sensitivity import Fit, fits_of, groups_of
from fingerslip.slip.windows import LATENCY, MAIN_EVENTS, event_label
from fingerslip.tables.table import Cell, Column, Table
from fingerslip.units import split_quantity


def sample_sections(content: ReportContent) -> tuple[ReportSection, ...]:
    """Return the sections of a study with samples: intervals, what moves overall slip, the other times, all samples."""
    study, fits = content.study, fits_of(content.study)
    first = [fit for fit in fits if (fit.reading, fit.time) == ("slip", "overall")]
    others = [fit for fit in fits if (fit.reading, fit.time) != ("slip", "overall")]
    count = {"count": len(study.ranges), "needed": len(study.ranges) + 2}
    text = prose("sections", "regression" if first else "too-few-samples", count)
    pictures, more = (tornado_pictures(study.runs, some, content.references) for some in (first, others))
    every = (published_table(study.runs, content.references), intervals_table(study.runs))
    intervals, refused = tuple(table for table in every if table.rows), refused_table(study.refused)
    return (
        _fit_section(content),
        ReportSection("Slip times over the samples", (), intervals),
        ReportSection("What moves overall slip", (text,), tuple(map(sensitivity_table, first)), pictures),
        ReportSection("What moves the other times", (), tuple(map(sensitivity_table, others)), more, folded=True),
        ReportSection("Refused samples", (), (refused,) if refused.rows else (), folded=True),
        ReportSection("All samples", (), (summary_table(study.runs),), folded=True),
    )


def _fit_section(content: ReportContent) -> ReportSection:
    """Return the section on a fit to a measurement, of these runs: values, predictions, posterior and curves."""
    title, study, tables = "Fit to a measurement", content.study, list[Table]()
    try:
        about = stored_fit(study)
    except DamagedError:
        raise
    except ResultError:  # there is none, or one of other runs
        return ReportSection(title)
    for name, words, note in zip(("summary", "predictions"), ("Values", "Predictions"), about["notes"], strict=True):
        frame = pd.read_csv(study.folder / FIT / f"{name}.csv").astype(object)
        columns = tuple(Column(str(heading), significant=4) for heading in frame)
        rows = frame.where(frame.notna(), None).itertuples(index=False, name=None)
        tables.append(Table(words, columns, tuple(rows), note))
    pictures = (
        Picture(name, prose("captions", f"of-{name}"), None, (study.folder / FIT / f"{name}.png").read_bytes())
        for name in ("corner", "fit")
    )
    return ReportSection(title, (), tuple(tables), tuple(pictures))


def tornado_pictures(
    runs: Sequence[RunResult], fits: Sequence[Fit], references: Sequence[PublishedSet]
) -> tuple[Picture, ...]:
    """Draw a tornado figure of each time from accumulated slip that was fitted."""
    pictures = []
    for time in (*MAIN_EVENTS, LATENCY):
        chosen = [fit for fit in fits if (fit.reading, fit.time) == ("slip", time)]
        if chosen:
            figure = tornado_figure(chosen, published_times(runs, chosen, references))
            caption = prose("captions", "tornado", {"event": event_label(time)})
            pictures.append(Picture(f"tornado-{time.replace('_', '-')}", caption, figure))
    return tuple(pictures)


def published_times(
    runs: Sequence[RunResult], fits: Sequence[Fit], references: Sequence[PublishedSet]
) -> dict[int, tuple[float, float]]:
    """Return the published times that belong to fits, by the number of the fit: the smallest and the largest [s]."""
    members = {repr(dict(group)): runs_of_group for group, runs_of_group in groups_of(runs)}
    times = {}
    for number, fit in enumerate(fits):
        first = members[repr(dict(fit.group))][0]
        values, sampled = first.all_values, first.sampled.keys()
        ends = [
            end
            for reference in references
            for value in reference.values
            if value.quantity == fit.time
            and value.reading in ("", fit.reading)
            and value.unmet(values).keys() <= sampled
            for end in value.span or (value.value,)
            if end is not None
        ]
        if ends:
            times[number] = (min(ends), max(ends))
    return times


@dataclass(frozen=True)
class Representative:
    """A sample that stands for others."""

    run: RunResult  # the run of the sample
    title: str  # what it is among the samples, such as 'earliest overall slip'
    event: str  # the event that it was chosen by
    since: float  # time of that event from the start of the slide [s]


def representatives(study: StudyResult, starts: Mapping[str, float]) -> tuple[Representative, ...]:
    """Choose samples by overall slip, or by an earlier event where no sample reaches that; slides start at [s]."""
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

    histories = content.representatives
    chosen = [sample for sample in representatives(content.study, content.starts) if sample.run.name in histories]
    motions = run_motions((histories[s.run.name], s.run.events, s.title.capitalize()) for s in chosen)
    text = f"{prose('sections', 'motion')} {prose('sections', 'samples-in-motion')}"
    tables = (_values_table(chosen[: len(motions)]),) if motions else ()
    return ReportSection("Samples in motion", (text,), tables, motions=motions)


def _values_table(samples: Sequence[Representative]) -> Table:
    """Show what the samples are: when they slip, and the values that are their own, with four digits."""

    def cell(value: object) -> Cell:
        if isinstance(value, str) and (quantity := split_quantity(value)):
            return f"{quantity[0]:.4g} {quantity[1]}"
        return float(f"{value:.4g}") if isinstance(value, float) else swept_text(value)

    values = [{**sample.run.swept, **sample.run.sampled} for sample in samples]
    paths = [path for path in dict.fromkeys(itertools.chain(*values)) if path not in (SAMPLE, REPEAT)]
    labels = path_labels(paths)
    event = Column(event_label(samples[0].event), "s", 3)
    rows = tuple(
        (sample.title, sample.since, *(cell(of_sample.get(path)) for path in paths))
        for sample, of_sample in zip(samples, values, strict=True)
    )
    columns = (Column("sample"), event, *(Column(labels[path]) for path in paths))
    return Table("The samples in motion", columns, rows, "Slip in seconds from the start of the slide.")
