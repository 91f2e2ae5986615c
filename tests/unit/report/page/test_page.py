"""The HTML page: well formed, self-contained, every text escaped."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from fingerslip.errors import ResultError
from fingerslip.report.page.page import Picture, Report, ReportSection, render_page, write_page
from fingerslip.tables.table import Column, Measured, Missing, Table
from unit.report.pages import checked


def picture(name: str) -> Picture:
    figure = Figure(figsize=(1.0, 1.0))
    figure.subplots().plot([0.0, 1.0])
    return Picture(name, f'caption of "{name}"', figure)


def report() -> Report:
    table = Table(
        "times", (Column("time", "s", 2), Column("name")), ((1.5, "a"), (Missing.NO_EVENT, "b")), "a note", marked=(1,)
    )
    sections = (
        ReportSection("First", ("a paragraph",), (table,), (picture("one"),)),
        ReportSection("Second", pictures=(picture("two"),), folded=True),
    )
    return Report("A <study>", sections, {"commit": "abc"})


def test_page_needs_no_other_file_and_is_well_formed() -> None:
    checker = checked(render_page(report()))
    assert len(checker.loaded) == 2
    for source in checker.loaded:
        kind, data = source.split(",")
        assert kind == "data:image/png;base64"
        assert base64.b64decode(data, validate=True).startswith(b"\x89PNG")
    assert checker.links == ["data:,", "#content", "#s0", "#s1", "#provenance"]
    assert {"s0", "s1", "one", "two", "provenance"} <= checker.anchors


def test_folded_sections_open_at_a_click_and_the_others_are_open() -> None:
    page = render_page(report())
    assert page.count("<details>") == 1
    folded = page[page.index("<details>") : page.index("</details>")]
    assert '<h2 id="s1">Second</h2>' in folded
    assert "First" not in folded


def test_page_without_provenance_has_no_such_section() -> None:
    assert 'id="provenance"' not in render_page(Report("r", ()))


def test_titles_of_runs_in_motion_neither_end_nor_swallow_the_scripts() -> None:
    # '<!--<script>' opens a state in which the next '</script>' does not end the script.
    title = "</script><script>alert(1)</script> <!--<script>"
    page = render_page(Report("r", (ReportSection("In motion", motions=({"title": title, "arrays": {}},)),)))
    assert page.count("<script") == page.count("</script>") == 3, "the colours, the run, and the page's own"
    assert "<!--" not in page
    data = page[page.index("data-motion") :]
    assert json.loads(data[data.index(">") + 1 : data.index("</script>")])["title"] == title


def test_texts_are_escaped() -> None:
    section = ReportSection("a & b", ("1 < 2",), (Table("t", (Column("x"),), (("<script>",),)),))
    page = render_page(Report("<title>", (section,), {"k": "<v>"}))
    checked(page)
    assert page.count("<script>") == 1, "the page's own"
    assert "&lt;script&gt;" in page
    assert "1 &lt; 2" in page


def test_missing_value_says_why_and_numbers_are_aligned_right() -> None:
    page = render_page(report())
    assert '<th class="number short" scope="col">time [s]</th>' in page
    assert '<td class="number short">1.50</td>' in page
    assert '<td class="number short" title="the event did not happen">none</td>' in page
    assert '<p class="note">a note none: the event did not happen.</p>' in page


def test_marked_rows_and_warnings_stand_out() -> None:
    page = render_page(report())
    assert page.count('<tr class="marked">') == 1
    marked = page[page.index('<tr class="marked">') :]
    assert marked[: marked.index("</tr>")].endswith('<td class="text short">b</td>')
    warned = ReportSection("Events", ("text",), warnings=("cut off at <edge>",))
    page = render_page(Report("r", (warned,)))
    assert '<p class="warning">cut off at &lt;edge&gt;</p>' in page
    assert page.index("cut off") < page.index("<p>text</p>")


def test_long_texts_may_wrap_and_short_ones_may_not() -> None:
    table = Table("t", (Column("x"),), (("short",), ("a text that is longer than most values are",)))
    page = render_page(Report("r", (ReportSection("s", tables=(table,)),)))
    assert '<td class="text short">short</td>' in page
    assert '<td class="text">a text that is longer' in page


def test_answers_stay_in_sight_and_uncertainties_keep_to_their_sign() -> None:
    table = Table("t", (Column("x"), Column("overall", "s", 2, answers=True)), (("a", Measured(1.5, 0.25)),))
    page = render_page(Report("r", (ReportSection("s", tables=(table,)),)))
    assert '<th class="number answers short" scope="col">overall [s]</th>' in page
    assert '<td class="number answers short">1.50 ±\u00a00.25</td>' in page


def test_page_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    write_page(report(), tmp_path / "report.html")
    assert "caption of" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    with pytest.raises(ResultError, match="cannot be written"):
        write_page(Report("r", ()), tmp_path / "missing" / "report.html")


def test_the_answer_and_its_picture_come_first() -> None:
    page = render_page(
        Report("r", report().sections, question="Does it <slip>?", answer=("After 1 s.",), hero=(picture("answer"),))
    )
    checked(page)
    order = ["<h1>r", "Does it &lt;slip&gt;?", "<p>After 1 s.</p>", 'id="answer"', 'id="s0"']
    assert sorted(order, key=page.index) == order


def test_runs_in_motion_have_one_player_whose_data_cannot_end_a_script() -> None:
    motions = tuple({"title": title, "data": "", "arrays": {}} for title in ("</script>", "b"))
    page = render_page(Report("r", (ReportSection("In motion", motions=motions),)))
    checked(page)
    assert page.count('class="motion"') == 1
    assert page.count("<script data-motion") == 2
    assert "class Solid" in page
    assert "class Solid" not in render_page(report())


def test_notes_and_code_stand_as_they_are() -> None:
    section = ReportSection("s", body="<p>a note</p>", code="@article{a<b}")
    page = render_page(Report("r", (section,)))
    assert "<p>a note</p>" in page
    assert "@article{a&lt;b}" in page
    assert not section.is_empty
    assert ReportSection("s", ("text",)).is_empty
