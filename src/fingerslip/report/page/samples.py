"""The sections of the report of a study with samples."""

from __future__ import annotations

from collections.abc import Sequence

from fingerslip.published import PublishedSet
from fingerslip.report.figures.tornado import tornado_figure
from fingerslip.report.page.content import ReportContent
from fingerslip.report.page.page import Picture, ReportSection
from fingerslip.report.tables.samples import intervals_table, published_table, refused_table, sensitivity_table
from fingerslip.report.tables.summary import summary_table
from fingerslip.report.tables.table import Table
from fingerslip.results import RunResult
from fingerslip.sampling import Fit, fits_of, groups_of
from fingerslip.slip.names import LATENCY, MAIN_EVENTS, event_label

__all__ = ["published_times", "sample_sections", "tornado_pictures"]

_FIRST = ("slip", "overall")


def sample_sections(content: ReportContent) -> tuple[ReportSection, ...]:
    """Return the sections of a study with samples: intervals, what moves overall slip, the other times, all samples."""
    study, fits = content.study, fits_of(content.study)
    first = [fit for fit in fits if (fit.reading, fit.time) == _FIRST]
    others = [fit for fit in fits if (fit.reading, fit.time) != _FIRST]
    needed = f"Too few samples for {len(study.ranges)} ranges: a regression needs {len(study.ranges) + 2}."
    said = "Each bar goes from the time at the smallest to that at the largest value of a range, by linear regression."
    intervals = (published_table(study.runs, content.references), intervals_table(study.runs))
    refused = (refused_table(study.refused),) if study.refused else ()
    return (
        ReportSection("Slip times over the samples", (), tuple(table for table in intervals if table.rows)),
        ReportSection(
            "What moves overall slip",
            (said if first else needed,),
            _tables(first),
            tornado_pictures(study.runs, first, content.references),
        ),
        ReportSection(
            "What moves the other times",
            (),
            _tables(others),
            tornado_pictures(study.runs, others, content.references),
            folded=True,
        ),
        ReportSection("Refused samples", (), refused, folded=True),
        ReportSection("All samples", (), (summary_table(study.runs),), folded=True),
    )


def _tables(fits: Sequence[Fit]) -> tuple[Table, ...]:
    return tuple(sensitivity_table(fit) for fit in fits)


def tornado_pictures(
    runs: Sequence[RunResult], fits: Sequence[Fit], references: Sequence[PublishedSet]
) -> tuple[Picture, ...]:
    """Draw a tornado figure of each time from accumulated slip that was fitted."""
    pictures = []
    for time in (*MAIN_EVENTS, LATENCY):
        own = [fit for fit in fits if (fit.reading, fit.time) == ("slip", time)]
        if own:
            figure = tornado_figure(own, published_times(runs, own, references))
            caption = f"Change of {event_label(time)} over the range of each sampled value."
            pictures.append(Picture(f"tornado-{time.replace('_', '-')}", caption, figure))
    return tuple(pictures)


def published_times(
    runs: Sequence[RunResult], fits: Sequence[Fit], references: Sequence[PublishedSet]
) -> dict[int, tuple[float, float]]:
    """Return the published times that belong to fits, by the number of the fit: the smallest and the largest [s]."""
    members = {repr(dict(group)): own for group, own in groups_of(runs)}
    found = {}
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
            found[number] = (min(ends), max(ends))
    return found
