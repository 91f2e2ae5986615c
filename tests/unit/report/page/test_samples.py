"""The report of a study with samples: intervals, sensitivities and all samples, no run in detail."""

import dataclasses

from fingerslip.published import published_set
from fingerslip.report.content import ReportContent
from fingerslip.report.page.assemble import study_report
from fingerslip.report.page.page import render_page
from fingerslip.report.page.samples import (
    published_times,
    representatives,
    sample_sections,
    samples_in_motion,
    tornado_pictures,
)
from fingerslip.results import RefusedRun
from fingerslip.sampling.sensitivity import fits_of
from fingerslip.slip import Events, SlipEvents
from unit.sampled import study_of
from unit.synthetic import Process, make

REFERENCES = (published_set("wang2014-table2"),)


def content(**more):
    return ReportContent(study_of(**more), {}, references=REFERENCES)


def test_sections_of_a_study_with_samples():
    report = study_report(content())
    assert [section.title for section in report.sections] == [
        "Slip times over the samples",
        "What moves overall slip",
        "What moves the other times",
        "All samples",
        "Citations",
    ]
    assert [picture.name for section in report.sections for picture in section.pictures] == [
        "tornado-overall",
        "tornado-incipient",
    ]
    assert "clearance" in render_page(report)
    section = sample_sections(content(count=3))[1]
    assert section.text == ("Too few samples for 3 ranges: a regression needs 5.",)
    refused = (RefusedRun("sample-3", {}, {}, "too large"),)
    made = content()
    made = dataclasses.replace(made, study=dataclasses.replace(made.study, refused=refused))
    assert "Refused samples" in [section.title for section in study_report(made).sections]


def test_published_times_are_those_of_the_phalanx_of_a_fit():
    study = study_of(12, ("original", "scaled"))
    fits = [fit for fit in fits_of(study) if fit.time == "overall"]
    assert published_times(study.runs, fits, REFERENCES) == {0: (1.71, 1.71), 1: (1.77, 1.77)}
    assert len(tornado_pictures(study.runs, fits, REFERENCES)) == 1


HISTORY = make(Process())


def starts_of(study):
    return {run.name: 1.0 for run in study.runs}


def content_in_motion(study):
    histories = {one.run.name: HISTORY for one in representatives(study, starts_of(study))}
    return ReportContent(study, {}, starts=starts_of(study), representatives=histories)


def test_the_middle_and_both_ends_of_overall_slip_are_chosen_or_of_an_earlier_event():
    study = study_of(count=11)
    found = representatives(study, starts_of(study))
    titles = ["overall slip nearest to the median", "earliest overall slip", "latest overall slip"]
    assert [one.title for one in found] == titles
    times = sorted(run.events.overall or 0.0 for run in study.runs)
    assert [one.since + 1.0 for one in found] == [times[5], times[0], times[-1]]
    assert [one.run.events.overall for one in found] == [times[5], times[0], times[-1]]
    # Times are counted from the start of each slide.
    late = study.runs[0].name
    assert representatives(study, {**starts_of(study), late: -10.0})[-1].run.name == late
    partly = tuple(
        dataclasses.replace(run, events=Events(SlipEvents(incipient=run.events.incipient))) for run in study.runs
    )
    found = representatives(dataclasses.replace(study, runs=partly), starts_of(study))
    assert [one.title for one in found][1:] == ["earliest incipient slip", "latest incipient slip"]
    assert representatives(study_of(count=5, time=lambda *_: None), starts_of(study)) == ()
    assert representatives(study, {}) == ()


def test_the_page_shows_them_by_what_they_are_with_their_values_and_without_names_of_runs():
    made = content_in_motion(study_of(count=11))
    section = samples_in_motion(made)
    titles = ["Overall slip nearest to the median", "Earliest overall slip", "Latest overall slip"]
    assert [motion["title"] for motion in section.motions] == titles
    (table,) = section.tables
    headings = ["sample", "overall slip [s]", "phalanx", "clearance", "half height", "Poisson's ratio"]
    assert [column.heading for column in table.columns] == headings
    assert all(len(str(cell).split()[0]) <= 7 for row in table.rows for cell in row[3:])
    report = study_report(made)
    page = render_page(dataclasses.replace(report, sections=tuple(one for one in report.sections if one.motions)))
    assert "Samples in motion" in page
    assert not [run.name for run in made.study.runs if run.name in page]
    assert samples_in_motion(dataclasses.replace(made, representatives={})).is_empty
