"""The HTML page: well formed, self-contained, every text escaped."""

import base64
import json

import pytest
from matplotlib.figure import Figure

from fingerslip.errors import ResultError
from fingerslip.report.page.page import Picture, Report, ReportSection, render_page, write_page
from fingerslip.tables.table import Column, Measured, Missing, Table
from unit.report.pages import checked


def picture(name):
    figure = Figure(figsize=(1.0, 1.0))
    figure.subplots().plot([0.0, 1.0])
    return Picture(name, f'caption of "{name}"', figure)


def report():
    table = Table(
        "times", (Column("time", "s", 2), Column("name")), ((1.5, "a"), (Missing.NO_EVENT, "b")), "a note", marked=(1,)
    )
    sections = (
        ReportSection("First", ("a paragraph",), (table,), (picture("one"),), warnings=("cut off at <edge>",)),
        ReportSection("Second", pictures=(picture("two"),), folded=True),
    )
    return Report(
        "A <study>", sections, {"commit": "<abc>"}, "Does it <slip>?", ("After 1 s.",), hero=(picture("answer"),)
    )


def page_with(table):
    return render_page(Report("r", (ReportSection("s", tables=(table,)),)))


def test_page_needs_no_other_file_is_well_formed_and_begins_with_the_answer():
    page = render_page(report())
    checker = checked(page)
    assert len(checker.loaded) == 3
    for source in checker.loaded:
        kind, data = source.split(",")
        assert kind == "data:image/png;base64"
        assert base64.b64decode(data, validate=True).startswith(b"\x89PNG")
    assert checker.links == ["data:,", "#content", "#s0", "#s1", "#provenance"]
    assert {"s0", "s1", "one", "two", "provenance"} <= checker.anchors
    order = ["<h1>A", "Does it &lt;slip&gt;?", "<p>After 1 s.</p>", 'id="answer"', 'id="s0"', "<details>", 'id="s1"']
    assert sorted(order, key=page.index) == order
    assert page.count("<details>") == 1, "folded sections open at a click, the others are open"
    assert 'id="provenance"' not in render_page(Report("r", ()))


def test_texts_are_escaped_and_notes_and_code_stand_as_they_are():
    table = Table("t", (Column("x"),), (("<script>",),))
    section = ReportSection("a & b", ("1 < 2",), (table,), body="<p>a note</p>", code="@article{a<b}")
    page = render_page(Report("<title>", (section,), {"k": "<v>"}))
    checked(page)
    assert page.count("<script>") == 1, "the page's own"
    for text in ("&lt;script&gt;", "1 &lt; 2", "&lt;v&gt;", "<p>a note</p>", "@article{a&lt;b}"):
        assert text in page
    assert not section.is_empty
    assert ReportSection("s", ("text",)).is_empty


def test_tables_say_what_is_missing_and_what_stands_out():
    page = render_page(report())
    for text in (
        '<th class="number short" scope="col">time [s]</th>',
        '<td class="number short">1.50</td>',
        '<td class="number short" title="the event did not happen">none</td>',
        '<p class="note">a note none: the event did not happen.</p>',
        '<p class="warning">cut off at &lt;edge&gt;</p>',
    ):
        assert text in page
    assert page.index("cut off") < page.index("<p>a paragraph</p>")
    assert page.count('<tr class="marked">') == 1
    marked = page[page.index('<tr class="marked">') :]
    assert marked[: marked.index("</tr>")].endswith('<td class="text short">b</td>')
    assert "data-sortable>" not in page
    assert "data-sortable>" in page_with(Table("t", (Column("x"),), ((1,), (2,), (3,))))


def test_long_texts_may_wrap_answers_stay_in_sight_and_uncertainties_keep_to_their_sign():
    page = page_with(Table("t", (Column("x"),), (("short",), ("a text that is longer than most values are",))))
    assert '<td class="text short">short</td>' in page
    assert '<td class="text">a text that is longer' in page
    columns = (Column("x"), Column("overall", "s", 2, answers=True))
    page = page_with(Table("t", columns, (("a", Measured(1.5, 0.25)),)))
    assert '<th class="number answers short" scope="col">overall [s]</th>' in page
    assert '<td class="number answers short">1.50 ±\u00a00.25</td>' in page


def test_runs_in_motion_have_one_player_whose_data_neither_end_nor_swallow_a_script():
    # '<!--<script>' opens a state in which the next '</script>' does not end the script.
    title = "</script><script>alert(1)</script> <!--<script>"
    motions = tuple({"title": name, "data": "", "arrays": {}} for name in (title, "b"))
    page = render_page(Report("r", (ReportSection("In motion", motions=motions),)))
    checked(page)
    assert page.count("<script") == page.count("</script>") == 4, "the colours, the runs, and the page's own"
    assert "<!--" not in page
    assert page.count('class="motion"') == 1
    assert page.count("<script data-motion") == 2
    data = page[page.index("<script data-motion") :]
    assert json.loads(data[data.index(">") + 1 : data.index("</script>")])["title"] == title
    assert "class Solid" in page
    assert "class Solid" not in render_page(report())


def test_page_is_written_whole_or_not_at_all(tmp_path):
    write_page(report(), tmp_path / "report.html")
    assert "caption of" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    with pytest.raises(ResultError, match="cannot be written"):
        write_page(Report("r", ()), tmp_path / "missing" / "report.html")
