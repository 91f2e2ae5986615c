"""The HTML page of a study, and the standard report."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path

import pytest
import skfem
from synthetic import Process, make

from fingerslip.anatomy import PresetValue
from fingerslip.errors import ResultError
from fingerslip.report.assemble import StudyResults, definitions, study_report
from fingerslip.report.figures import energy_figure
from fingerslip.report.page import Picture, Report, ReportSection, parameters_table, render_page, write_page
from fingerslip.report.published import published
from fingerslip.report.tables import Column, RunEvents, Table
from fingerslip.slip import EventSettings, find_events

VOID = {"meta", "img", "br"}
PARAMETERS = (
    PresetValue("layers.skin_thickness", "1.5 mm", "wang2014", ""),
    PresetValue("depth", "1 mm", "assumed", "scales all forces"),
)


class Checker(HTMLParser):
    """Follows open tags and collects what a page loads."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self.loaded += [values["src"]] if "src" in values else []
        self.links += [values["href"]] if "href" in values else []
        self.anchors |= {values["id"]} if "id" in values else set()
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def checked(page: str) -> Checker:
    checker = Checker()
    checker.feed(page)
    assert checker.open == []
    return checker


def results() -> StudyResults:
    histories = {str(mu): make(Process(friction=mu, edge=1 + 0.4 * mu, centre=1 + 1.1 * mu)) for mu in (0.4, 0.6)}
    runs = tuple(
        RunEvents(label, {"contact.friction_coefficient": float(label)}, find_events(history))
        for label, history in histories.items()
    )
    mesh = skfem.MeshQuad().refined(2).scaled(1e-3).with_subdomains({"tissue": lambda x: x[0] > -1.0})
    references = (published("wang2014-table2"), published("wang2014-qualitative"))
    return StudyResults("A <study>", runs, histories, {"0.6": mesh}, references, PARAMETERS, {"commit": "abc"})


def test_page_needs_no_other_file_and_is_well_formed() -> None:
    checker = checked(render_page(study_report(results())))
    assert checker.loaded
    assert all(source.startswith("data:image/png;base64,") for source in checker.loaded)
    assert all(link.startswith("#") and link[1:] in checker.anchors for link in checker.links)


def test_texts_are_escaped() -> None:
    section = ReportSection("a & b", ("1 < 2",), (Table("t", (Column("x"),), (("<script>",),)),))
    page = render_page(Report("<title>", (section,), {"k": "<v>"}))
    checked(page)
    assert "<script>" not in page
    assert "&lt;script&gt;" in page
    assert "1 &lt; 2" in page


def test_missing_value_is_a_dash_and_numbers_stand_right() -> None:
    table = Table("t", (Column("time", "s", 2), Column("name")), ((1.5, "a"), (None, "b")))
    page = render_page(Report("r", (ReportSection("s", (), (table,)),)))
    assert '<th class="number">time [s]</th>' in page
    assert '<td class="number">1.50</td>' in page
    assert '<td class="number">-</td>' in page


def test_assumed_parameters_come_first() -> None:
    table = parameters_table(PARAMETERS)
    assert [row[2] for row in table.rows] == ["assumed", "wang2014"]
    assert table.note.startswith("1 of 2 values are assumed")


def test_standard_report_has_its_sections_and_figures() -> None:
    report = study_report(results())
    assert [section.title for section in report.sections] == [
        "Slip events",
        "Beside published values",
        "The runs side by side",
        "The section",
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


def test_page_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    picture = Picture("p", "a caption", energy_figure(make(Process())))
    write_page(Report("r", (ReportSection("s", (), (), (picture,)),)), tmp_path / "report.html")
    assert "a caption" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    with pytest.raises(ResultError, match="cannot be written"):
        write_page(Report("r", ()), tmp_path / "missing" / "report.html")
