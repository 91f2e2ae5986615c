"""The user's own notes and figures in a report, and what to cite with it."""

import re

import pytest

from fingerslip.errors import ResultError
from fingerslip.published import published_set
from fingerslip.report.citations import bibliography, bibtex_entries
from fingerslip.report.page.assemble import notes_html
from fingerslip.report.tables.parameters import ShownValue
from places import ROOT

PNG = b"\x89PNG\r\n"


def test_markdown_is_shown_with_its_pictures_no_html_of_its_own_and_figures_beside_it_once(tmp_path):
    assert notes_html(tmp_path) == ""
    (tmp_path / "notes").mkdir()
    for name in ("my plot.png", "notes/one_two.png", "notes/shown.png", "notes/data.csv"):
        (tmp_path / name).write_bytes(PNG)
    text = "# What I saw\n\nIt *slips* <script>x</script>.\n\n![a plot](my%20plot.png)\n\n| a |\n|---|\n| 1 |\n"
    (tmp_path / "notes.md").write_text(f"{text}\n![seen](notes/shown.png)", encoding="utf-8")
    found = notes_html(tmp_path)
    for words in (
        *("<h3>What I saw</h3>", "<em>slips</em> &lt;script&gt;", 'src="data:image/png;base64,', 'alt="a plot"'),
        *('<div class="table"><table>', "<figcaption>one two</figcaption>"),
    ):
        assert words in found
    assert found.count("<img") == 3


@pytest.mark.parametrize(
    ("source", "words"), [("lost.png", "which is not there"), ("https://a.b/c.png", "a report needs no network")]
)
def test_a_picture_that_cannot_be_shown_is_refused(tmp_path, source, words):
    (tmp_path / "notes.md").write_text(f"![x]({source})", encoding="utf-8")
    with pytest.raises(ResultError, match=words):
        notes_html(tmp_path)


def test_the_papers_of_values_are_cited_and_every_entry_has_what_styles_ask_for():
    values = (ShownValue("a", "1", "corniani2024"), ShownValue("b", "2", "assumed"))
    text = bibtex_entries(values, [published_set("wang2014-table2")])
    assert text.startswith("@misc{fingerslip,"), "plain BibTeX knows no @software"
    assert "@article{barrea2018," in text, "the share of the contact at which slip is noticed"
    assert "@article{corniani2024," in text
    assert "@article{wang2014," in text
    assert "pawluk1999" not in text
    assert text.count("{") == text.count("}")
    needed = {"article": {"journal", "volume"}, "inproceedings": {"booktitle"}, "book": {"publisher"}, "misc": set()}
    assert {"wang2014", "bulens2023"} <= bibliography().keys()
    for entry in [*bibliography().values(), bibtex_entries([], []).partition("\n\n")[0]]:
        kind, fields = re.match(r"@(\w+)", entry)[1], set(re.findall(r"^  (\w+) *= \{.+\},$", entry, re.MULTILINE))
        assert entry.count("{") == entry.count("}")
        assert fields >= {"title", "author", "year"} | needed[kind], entry
        assert entry.isascii(), "plain BibTeX sorts and prints nothing else"
    year = re.search(r"Copyright \(c\) (\d{4})", (ROOT / "LICENSE").read_text(encoding="utf-8"))[1]
    assert f"year   = {{{year}}}" in bibtex_entries([], [])
