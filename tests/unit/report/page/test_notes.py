"""The user's own notes and figures in a report."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.errors import ResultError
from fingerslip.report.page.notes import notes_html

PNG = b"\x89PNG\r\n"


def test_without_notes_there_is_nothing(tmp_path: Path) -> None:
    assert notes_html(tmp_path) == ""


def test_markdown_is_shown_with_its_pictures_and_no_html_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "my plot.png").write_bytes(PNG)
    text = "# What I saw\n\nIt *slips* <script>x</script>.\n\n![a plot](my%20plot.png)\n\n| a |\n|---|\n| 1 |\n"
    (tmp_path / "notes.md").write_text(text, encoding="utf-8")
    found = notes_html(tmp_path)
    assert "<h3>What I saw</h3>" in found
    assert "<em>slips</em> &lt;script&gt;" in found
    assert 'src="data:image/png;base64,' in found
    assert 'alt="a plot"' in found
    assert '<div class="table"><table>' in found


def test_figures_beside_the_notes_follow_each_once(tmp_path: Path) -> None:
    (tmp_path / "notes").mkdir()
    for name in ("one_two.png", "shown.png", "data.csv"):
        (tmp_path / "notes" / name).write_bytes(PNG)
    (tmp_path / "notes.md").write_text("![seen](notes/shown.png)", encoding="utf-8")
    found = notes_html(tmp_path)
    assert found.count("<img") == 2
    assert "<figcaption>one two</figcaption>" in found


@pytest.mark.parametrize(
    ("source", "words"), [("lost.png", "which is not there"), ("https://a.b/c.png", "a report needs no network")]
)
def test_a_picture_that_cannot_be_shown_is_refused(tmp_path: Path, source: str, words: str) -> None:
    (tmp_path / "notes.md").write_text(f"![x]({source})", encoding="utf-8")
    with pytest.raises(ResultError, match=words):
        notes_html(tmp_path)
