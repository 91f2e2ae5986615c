"""What ``fingerslip validate`` puts together."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest

from fingerslip.errors import DamagedError, InputError
from fingerslip.published import published_set
from fingerslip.validation import comparison as module
from fingerslip.validation.comparison import compare, comparison_mapping, comparison_markdown
from fingerslip.validation.rows import GeometryRow, Row, Stored, number_row

GEOMETRY = GeometryRow("incipient slip", "Table 2", 1.53, None, "", 0, 50)


def row(name: str) -> Row:
    return number_row(name, published_set("wang2014-table2").values[0], 1.75, 0.01, resolution=0.01)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Replace what is run; return what is asked for, in order."""
    asked: list[str] = []

    def fake(name: str, one: Any) -> Callable[..., Stored[Any]]:
        def rows(*_: object, compute: bool) -> Stored[Any]:
            asked.append(f"{name} computed" if compute else name)
            return Stored((one,), "" if compute else f"{name} stored.", computed=compute)

        return rows

    def validated(*_: object, papers: tuple[str, ...]) -> tuple[Row, ...]:
        asked.extend(papers)
        return (row("run"),)

    monkeypatch.setattr(module, "allowed_geometry", fake("geometry", GEOMETRY))
    parts = {name: fake(name, row(name)) for name in ("pouring", "detection")}
    monkeypatch.setattr(module, "_ROWS", MappingProxyType(parts))
    monkeypatch.setattr(module, "validate", validated)
    return asked


def test_stored_rows_are_read_before_anything_is_run(asked: list[str]) -> None:
    found = compare()
    assert asked == ["geometry", "pouring", "detection", "wang2014", "bulens2023"]
    assert [one.quantity for one in found.rows] == ["run", "pouring", "detection"]
    assert found.origins == ("pouring stored.", "detection stored.")
    assert found.tables[0].note.endswith("pouring stored. detection stored.")
    assert found.tables[1].note.endswith("geometry stored.")


def test_one_paper_leaves_out_the_parts_of_the_other(asked: list[str]) -> None:
    found = compare(only="bulens2023", computed=["pouring"])
    assert asked == ["pouring computed", "detection", "bulens2023"]
    assert len(found.tables) == 1
    asked.clear()
    assert [one.quantity for one in compare(only="wang2014").rows] == ["run"]
    assert asked == ["geometry", "wang2014"]


@pytest.mark.usefixtures("asked")
def test_what_is_left_out_cannot_be_computed() -> None:
    with pytest.raises(InputError, match="--only: got 'wang', needs one of wang2014, bulens2023"):
        compare(only="wang")
    with pytest.raises(InputError, match="--pouring: is of bulens2023, needs no --only wang2014"):
        compare(only="wang2014", computed=["pouring"])


@pytest.mark.usefixtures("asked")
def test_plain_data_and_markdown_have_the_geometry_if_it_was_computed() -> None:
    assert len(comparison_mapping(compare())) == 3
    assert "unknown geometry" not in comparison_markdown(compare())
    computed = compare(computed=["geometry"])
    assert json.loads(json.dumps(comparison_mapping(computed)))["geometry"][0]["published"] == 1.53
    assert "## What the unknown geometry allows" in comparison_markdown(computed)


def test_a_damaged_file_is_told_before_studies_are_looked_for(tmp_path: Path) -> None:
    (tmp_path / "geometry.json").write_text("{")
    with pytest.raises(DamagedError, match=r"geometry\.json"):
        compare(tmp_path, tmp_path)
