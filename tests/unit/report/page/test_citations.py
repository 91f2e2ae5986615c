"""What to cite with a study."""

from __future__ import annotations

from fingerslip.published import published
from fingerslip.report.page.citations import bibliography, cited
from fingerslip.report.tables.parameters import ShownValue


def test_the_papers_of_values_and_comparisons_are_cited_and_no_others() -> None:
    values = (ShownValue("a", "1", "corniani2024"), ShownValue("b", "2", "assumed"))
    text = cited(values, [published("wang2014-table2")])
    assert text.startswith("@software{fingerslip,")
    assert "@article{corniani2024," in text
    assert "@article{wang2014," in text
    assert "pawluk1999" not in text
    assert text.count("{") == text.count("}")


def test_every_entry_is_whole() -> None:
    entries = bibliography()
    assert {"wang2014", "bulens2023"} <= entries.keys()
    assert all(entry.count("{") == entry.count("}") for entry in entries.values())
