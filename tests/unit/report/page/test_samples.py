"""The report of a study with samples: intervals, sensitivities and all samples, no run in detail."""

from __future__ import annotations

import dataclasses

from fingerslip.published import published_set
from fingerslip.report.page.assemble import study_report
from fingerslip.report.page.content import ReportContent
from fingerslip.report.page.page import render_page
from fingerslip.report.page.samples import published_times, sample_sections, tornado_pictures
from fingerslip.results import RefusedRun
from fingerslip.sampling import fits_of
from unit.sampled import study_of

REFERENCES = (published_set("wang2014-table2"),)


def content(**more: int) -> ReportContent:
    return ReportContent(study_of(**more), {}, references=REFERENCES)


def test_sections_of_a_study_with_samples() -> None:
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


def test_too_few_samples_say_how_many_a_regression_needs() -> None:
    section = sample_sections(content(count=3))[1]
    assert section.text == ("Too few samples for 3 ranges: a regression needs 5.",)


def test_refused_samples_are_listed() -> None:
    refused = (RefusedRun("sample-3", {}, {}, "too large"),)
    made = content()
    made = dataclasses.replace(made, study=dataclasses.replace(made.study, refused=refused))
    assert "Refused samples" in [section.title for section in study_report(made).sections]


def test_published_times_are_those_of_the_phalanx_of_a_fit() -> None:
    study = study_of(12, ("original", "scaled"))
    fits = [fit for fit in fits_of(study) if fit.time == "overall"]
    assert published_times(study.runs, fits, REFERENCES) == {0: (1.71, 1.71), 1: (1.77, 1.77)}
    assert len(tornado_pictures(study.runs, fits, REFERENCES)) == 1
