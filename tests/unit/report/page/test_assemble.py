"""The standard report of a study: which tables and figures its runs call for."""

from __future__ import annotations

import dataclasses

import pytest
import skfem

from fingerslip.published import published_set
from fingerslip.report.page import assemble
from fingerslip.report.page.assemble import study_report
from fingerslip.report.page.page import Report, ReportSection, render_page
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.results import RunResult, result_of
from fingerslip.slip import Events, SlipEvents
from fingerslip.slip.front import EdgeContact
from fingerslip.tables.table import Column, Table, texts
from fingerslip.uncertainty import Convergence, Series
from unit.report.page.contents import content_of, two_runs, with_runs
from unit.report.pages import checked
from unit.synthetic import Process, make

VALUES = (
    ShownValue("fingertip.layers.skin_thickness", "1.5 mm", "wang2014"),
    ShownValue("fingertip.depth", "1 mm", "assumed", "scales all forces"),
)


def section_of(report: Report, title: str) -> ReportSection:
    (section,) = (section for section in report.sections if section.title == title)
    return section


def test_standard_report_has_its_sections_and_figures() -> None:
    mesh = skfem.MeshQuad().refined(2).scaled(1e-3).with_subdomains({"tissue": lambda x: x[0] > -1.0})
    references = (published_set("wang2014-table2"), published_set("wang2014-qualitative"))
    content = two_runs(meshes={"0.6": mesh}, references=references, values=VALUES, provenance={"commit": "abc"})
    report = study_report(content)
    assert [section.title for section in report.sections] == [
        "Slip events",
        "How slip events are defined",
        "Comparison with published values",
        "In motion",
        "The runs side by side",
        "What was run",
        "Energy balance",
        "The model",
        "Values and their sources",
        "friction coefficient 0.4",
        "friction coefficient 0.6",
        "Citations",
    ]
    assert [picture.name for picture in report.hero] == [
        "latency-contact-friction-coefficient", "events-contact-friction-coefficient",
    ]  # fmt: skip
    side_by_side = section_of(report, "The runs side by side")
    assert [picture.name for picture in side_by_side.pictures] == ["slip-maps", "forces", "acceleration-peaks"]
    assert [table.title for table in side_by_side.tables] == ["Measures"]
    assert len(report.sections[-2].pictures) == 6
    assert report.sections[-2].folded
    assert "@article{wang2014," in report.sections[-1].code
    assert report.title == "A <study>"


@pytest.mark.slow
def test_single_run_is_called_like_its_study_and_unrecorded_readings_have_no_table() -> None:
    history = make(Process()).drop_dims("site")
    report = study_report(content_of((result_of(history, "run", {}),), {"run": history}))
    assert [section.title for section in report.sections] == [
        "Slip events", "How slip events are defined", "In motion", "Energy balance", "A <study>", "Citations",
    ]  # fmt: skip
    events = report.sections[0]
    assert [table.title for table in events.tables] == [
        "Slip events from accumulated slip",
        "Slip events from displacement",
    ]
    assert "No times from acceleration peaks: no run records the signals." in events.text
    assert "FA-I" not in report.sections[1].body
    page = render_page(report)
    checked(page)
    assert "Run run" not in page


def test_a_reading_that_only_some_runs_recorded_has_a_table_that_says_so() -> None:
    content = two_runs()
    first, second = content.study.runs
    silent = dataclasses.replace(
        first, events=dataclasses.replace(first.events, acceleration=SlipEvents(recorded=False))
    )
    table = study_report(with_runs(content, silent, second)).sections[0].tables[2]
    assert texts(table)[0][1:] == ["n/r", "n/a", "n/r", "n/r", "n/r"]
    assert "n/r: not recorded" in table.remarks


@pytest.mark.slow
def test_contact_at_a_free_edge_is_a_warning_above_the_events_and_in_their_tables() -> None:
    content = two_runs()
    first, second = content.study.runs
    section = study_report(
        with_runs(content, first, dataclasses.replace(second, edge=EdgeContact("skin", 0.1, 0.0)))
    ).sections[0]
    (warning,) = section.warnings
    assert "friction coefficient 0.6 ('skin' from 0.1 s on" in warning
    assert "0.4" not in warning
    assert all("cut off" in table.note for table in section.tables)
    assert study_report(content).sections[0].warnings == ()


def test_runs_without_a_history_are_in_the_tables_only() -> None:
    whole = two_runs()
    report = study_report(dataclasses.replace(whole, histories={"0.6": whole.histories["0.6"]}))
    titles = [section.title for section in report.sections]
    assert "friction coefficient 0.6" in titles
    assert "friction coefficient 0.4" not in titles
    assert len(report.sections[0].tables[0].rows) == 2


def test_every_swept_value_gives_latencies_and_event_times() -> None:
    swept = [{"time.step": "5 ms", "fingertip.fingerprint.enabled": on} for on in (False, True)]
    swept += [{"time.step": "10 ms", "fingertip.fingerprint.enabled": False}]
    runs = tuple(RunResult(str(number), values, Events()) for number, values in enumerate(swept))
    report = study_report(content_of(runs, {}))
    assert [picture.name for picture in report.pictures] == [
        "latency-time-step",
        "events-time-step",
        "latency-fingertip-fingerprint-enabled",
        "events-fingertip-fingerprint-enabled",
    ]


def test_a_value_that_is_the_same_in_all_runs_is_not_drawn() -> None:
    runs = tuple(RunResult(str(mu), {"contact.friction_coefficient": 0.6}, Events()) for mu in (1, 2))
    report = study_report(content_of(runs, {}))
    assert report.pictures == ()


def test_refined_runs_have_a_section_of_their_own() -> None:
    series = Series("step", (1.0, 0.5, 0.25), (1.7, 1.65, 1.625))
    names = ("slip.incipient", "slip.three_quarter", "slip.overall")
    found = {name: Convergence(name, "s", 1.7, {"step": series}) for name in names}
    runs = (RunResult("a", {"n": 1}, Events()), RunResult("b", {"n": 2}, Events()))
    section = section_of(study_report(content_of(runs, {}, convergences={"b": found})), "Numerical uncertainty")
    assert [picture.name for picture in section.pictures] == ["b-convergence"]
    assert [table.title for table in section.tables] == ["Numerical uncertainty, n 2"]
    without = study_report(content_of(runs, {}))
    assert "Numerical uncertainty" not in [section.title for section in without.sections]


def test_values_are_shown_in_their_groups() -> None:
    report = study_report(content_of((RunResult("run", {}, Events()),), {}, values=VALUES))
    (table,) = section_of(report, "Values and their sources").tables
    assert [row[0] for row in table.rows] == ["fingertip.depth", "fingertip.layers.skin_thickness"]


@pytest.mark.parametrize(("count", "detailed"), [(12, 12), (15, 1)])
def test_a_long_study_has_few_runs_in_detail(monkeypatch: pytest.MonkeyPatch, count: int, detailed: int) -> None:
    table = Table("t", (Column("a"),), ((1,),))
    monkeypatch.setattr(assemble, "run_section", lambda run, *_: ReportSection(run.name, (), (table,)))
    monkeypatch.setattr(assemble, "_side_by_side_section", lambda _: ReportSection("overview"))
    monkeypatch.setattr(assemble, "hero_pictures", lambda _: ())
    history = make(Process())
    runs = tuple(RunResult(str(number), {"n": number}, Events()) for number in range(count))
    report = study_report(content_of(runs, {run.name: history for run in runs}))
    assert len(report.sections[0].tables[0].rows) == count
    named = [part.title for part in report.sections if part.title.isdigit()]
    assert named == [str(number) for number in range(detailed)]
    (moving,) = (part for part in report.sections if part.motions)
    assert len(moving.motions) == 12
    assert (f"first 12 of {count} runs" in " ".join(moving.text)) == (count > 12)
