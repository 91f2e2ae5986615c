"""The report of two studies side by side."""

from pathlib import Path

from fingerslip.report.page.assemble import ComparedStudy, comparison_report, pairs_of
from fingerslip.report.page.page import render_page
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.results import RunResult, StudyResult
from fingerslip.slip import Events, SlipEvents
from fingerslip.tables.table import Missing, texts
from unit.report.pages import checked


def study(title, times, friction="0.6"):
    runs = tuple(
        RunResult(str(mu), {"contact.friction_coefficient": mu}, Events(slip=SlipEvents(incipient=1.1, overall=time)))
        for mu, time in times.items()
    )
    values = (ShownValue("time.step", "5 ms", "study file"), ShownValue("a.b", friction, "study file"))
    return ComparedStudy(StudyResult(Path(title), (), runs, title=title), values, {run.name: 1.0 for run in runs})


def test_runs_with_the_same_values_are_compared_and_values_that_differ_are_shown():
    report = comparison_report(study("one", {0.4: 1.4, 0.6: 1.7}), study("two", {0.6: 1.75, 0.8: None}, "0.7"), {})
    assert report.answer == (
        "One value differs between the studies; what follows is the effect of it.",
        "In the run that both studies have, overall slip of B comes 50 ms later into the slide than that of A.",
    )
    assert [picture.name for picture in report.hero] == ["paired"]
    differences, values = (report.sections[number].tables[0] for number in (0, 1))
    assert ["friction coefficient 0.6", "overall", "1.700", "1.750", "50"] in texts(differences)
    assert values.rows == (("a.b", "0.6", "0.7"),)
    checked(render_page(report))


def test_single_runs_are_a_pair_whatever_their_values_and_without_common_runs_it_says_so():
    first, second = study("one", {0.4: 1.4}), study("two", {0.6: None})
    assert len(pairs_of(first.study, second.study)) == 1
    report = comparison_report(first, second, {})
    assert report.answer[0] == "No value differs between the studies."
    assert "none reaches overall slip in both" in report.answer[-1]
    overall = next(row for row in report.sections[0].tables[0].rows if row[1] == "overall")
    assert overall[-1] is Missing.NO_EVENT
    report = comparison_report(first, study("two", {0.6: 1.7, 0.8: 1.8}), {})
    assert report.answer[-1].startswith("The studies have no runs with the same swept values")
    assert report.hero == ()
