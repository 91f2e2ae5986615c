"""What to cite with a study."""

from __future__ import annotations

import re

from fingerslip.published import published_set
from fingerslip.report.page.notes import bibliography, bibtex_entries
from fingerslip.report.tables.parameters import ShownValue
from places import ROOT


def test_the_papers_of_values_and_comparisons_are_cited_and_no_others() -> None:
    values = (ShownValue("a", "1", "corniani2024"), ShownValue("b", "2", "assumed"))
    text = bibtex_entries(values, [published_set("wang2014-table2")])
    assert text.startswith("@misc{fingerslip,"), "plain BibTeX knows no @software"
    assert "@article{barrea2018," in text, "the share of the contact at which slip is noticed"
    assert "@article{corniani2024," in text
    assert "@article{wang2014," in text
    assert "pawluk1999" not in text
    assert text.count("{") == text.count("}")


def test_every_entry_is_whole() -> None:
    entries = bibliography()
    assert {"wang2014", "bulens2023"} <= entries.keys()
    assert all(entry.count("{") == entry.count("}") for entry in entries.values())


def test_every_entry_has_what_styles_of_bibliographies_ask_for() -> None:
    needed = {"article": {"journal", "volume"}, "inproceedings": {"booktitle"}, "misc": set()}
    for entry in [*bibliography().values(), bibtex_entries([], []).partition("\n\n")[0]]:
        kind, fields = re.match(r"@(\w+)", entry)[1], set(re.findall(r"^  (\w+) *= \{.+\},$", entry, re.MULTILINE))
        assert fields >= {"title", "author", "year"} | needed[kind], entry
        assert entry.isascii(), "plain BibTeX sorts and prints nothing else"


def test_the_year_of_the_program_is_that_of_its_licence() -> None:
    year = re.search(r"Copyright \(c\) (\d{4})", (ROOT / "LICENSE").read_text(encoding="utf-8"))[1]
    assert f"year   = {{{year}}}" in bibtex_entries([], [])
