"""The standard report of a study: which tables and figures its runs call for."""

from __future__ import annotations

import dataclasses

import pytest
import skfem

from fingerslip.published import published
from fingerslip.report.page import assemble
from fingerslip.report.page.assemble import StudyResults, definitions, study_report
from fingerslip.report.page.page import render_page
from fingerslip.report.tables.events import RunEvents
from fingerslip.slip import Events, EventSettings, find_events
from fingerslip.specimens.fingertip import PresetValue
from fingerslip.uncertainty import Convergence, Series
from unit.report.pages import checked
from unit.synthetic import Process, make

PARAMETERS = (
    PresetValue("layers.skin_thickness", "1.5 mm", "wang2014", ""),
    PresetValue("depth", "1 mm", "assumed", "scales all forces"),
)


def results() -> StudyResults:
    histories = {str(mu): make(Process(friction=mu, edge=1 + 0.4 * mu, centre=1 + 1.1 * mu)) for mu in (0.4, 0.6)}
    runs = tuple(
        RunEvents(label, {"contact.friction_coefficient": float(label)}, find_events(history))
        for label, history in histories.items()
    )
    mesh = skfem.MeshQuad().refined(2).scaled(1e-3).with_subdomains({"tissue": lambda x: x[0] > -1.0})
    references = (published("wang2014-table2"), published("wang2014-qualitative"))
    return StudyResults("A <study>", runs, histories, {"0.6": mesh}, references, PARAMETERS, {"commit": "abc"})


def test_standard_report_has_its_sections_and_figures() -> None:
    report = study_report(results())
    assert [section.title for section in report.sections] == [
        "Slip events",
        "Beside published values",
        "The runs side by side",
        "The fingertip",
        "Parameters and their sources",
        "Run 0.4",
        "Run 0.6",
    ]
    overview = [picture.name for picture in report.sections[2].pictures]
    assert overview == ["events-contact-friction-coefficient", "slip-maps", "forces", "acceleration-peaks"]
    assert len(report.sections[-1].pictures) == 6
    assert report.sections[-1].folded


def test_single_run_without_receptors_has_a_report() -> None:
    history = make(Process()).drop_dims("site")
    runs = (RunEvents("run", {}, find_events(history)),)
    report = study_report(StudyResults("one", runs, {"run": history}))
    assert [section.title for section in report.sections] == ["Slip events", "Run run"]
    checked(render_page(report))


def test_definitions_say_the_constants() -> None:
    text = " ".join(definitions(EventSettings(slip_tolerance=35e-6, incipient_fraction=0.05)))
    assert "35 µm" in text
    assert "5 %, 48 %, 75 % and 99.5 %" in text


def test_runs_without_a_history_are_in_the_tables_only() -> None:
    whole = results()
    report = study_report(dataclasses.replace(whole, histories={"0.6": whole.histories["0.6"]}))
    titles = [section.title for section in report.sections]
    assert "Run 0.6" in titles
    assert "Run 0.4" not in titles
    assert len(report.sections[0].tables[0].rows) == 2


def test_a_swept_word_gives_latencies_and_a_quantity_event_times() -> None:
    events = Events()
    swept = [{"time.step": "5 ms", "fingertip.fingerprint.enabled": on} for on in (False, True)]
    swept += [{"time.step": "10 ms", "fingertip.fingerprint.enabled": False}]
    runs = tuple(RunEvents(str(place), values, events) for place, values in enumerate(swept))
    report = study_report(StudyResults("r", runs, {}))
    names = [picture.name for section in report.sections for picture in section.pictures]
    assert names == ["events-time-step", "latency-fingertip-fingerprint-enabled"]


def test_a_value_that_is_the_same_in_all_runs_is_not_drawn() -> None:
    runs = tuple(RunEvents(str(mu), {"contact.friction_coefficient": 0.6}, Events()) for mu in (1, 2))
    report = study_report(StudyResults("r", runs, {}))
    assert [picture.name for section in report.sections for picture in section.pictures] == []


def test_refined_runs_have_a_section_of_their_own() -> None:
    series = Series("step", (1.0, 0.5, 0.25), (1.7, 1.65, 1.625))
    names = ("slip.incipient", "slip.three_quarter", "slip.overall")
    found = {name: Convergence(name, "s", 1.7, {"step": series}) for name in names}
    runs = (RunEvents("a", {}, Events()), RunEvents("b", {}, Events()))
    report = study_report(StudyResults("r", runs, {}, convergences={"b": found}))
    (section,) = (section for section in report.sections if section.title == "Numerical uncertainty")
    assert [picture.name for picture in section.pictures] == ["b-convergence"]
    assert len(section.tables) == 1
    without = study_report(StudyResults("r", runs, {}))
    assert "Numerical uncertainty" not in [section.title for section in without.sections]


def test_a_long_study_has_twelve_runs_in_detail(monkeypatch: pytest.MonkeyPatch) -> None:
    section = assemble.ReportSection
    table = assemble.ways_table(RunEvents("r", {}, Events()))
    monkeypatch.setattr(assemble, "_run_section", lambda _, run: section(f"Run {run.label}", (), (table,)))
    monkeypatch.setattr(assemble, "_overview_section", lambda _: section("overview"))
    history = make(Process())
    runs = tuple(RunEvents(str(number), {}, Events()) for number in range(15))
    report = study_report(StudyResults("r", runs, {run.label: history for run in runs}))
    assert len(report.sections[0].tables[0].rows) == 15
    assert [part.title for part in report.sections[1:]] == [f"Run {number}" for number in range(12)]


def test_definitions_say_the_constants_of_the_peaks() -> None:
    settings = EventSettings(displacement_tolerance=70e-6, sustained=0.08)
    slip, displacement, acceleration, _ = definitions(settings)
    assert "for 80 ms or up to the end of the slide" in slip
    assert "left the plate's line by more than 70 µm" in displacement
    assert "FA-I and SA-I" in acceleration
    assert "6 spreads" in acceleration
