"""``fingerslip validate``: one table, as text, JSON or Markdown."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fingerslip import validation
from fingerslip.published import published_set
from fingerslip.validation import Comparison, Stored
from fingerslip.validation.rows import GeometryRow, number_row


def test_rows_come_as_table_json_and_markdown(invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    value = published_set("wang2014-table2").values[0]
    rows = (number_row("overall slip", value, 1.75, 0.01, resolution=0.01),)
    allowed = Stored((GeometryRow("incipient slip", "Table 2", 1.53, None, "", 0, 50),), "Stored.")
    asked: list[tuple[Any, ...]] = []

    def compare(*given: Any, **chosen: Any) -> Comparison:
        asked.append((*given[:3], chosen))
        return Comparison(rows, ("Rows are stored.",), allowed)

    monkeypatch.setattr(validation, "compare", compare)
    text = invoke("validate", "--studies", "s", "--results", "r", "--workers", "1").stdout
    assert "overall slip" in text
    assert "Rows are stored." in text
    assert asked == [(Path("s"), Path("r"), 1, {"only": None, "computed": []})]
    assert json.loads(invoke("validate", "--json", "--only", "wang2014", "--geometry").stdout)[0]["ours"] == 1.75
    assert asked[-1][-1] == {"only": "wang2014", "computed": ["geometry"]}
    invoke("validate", "--pouring", "--detection")
    assert asked[-1][-1]["computed"] == ["pouring", "detection"]
    page = invoke("validate", "--markdown").stdout
    assert page.startswith("# Validation against published values\n")
    assert "unknown geometry" not in page


def test_a_missing_study_is_wrong_input(invoke: Callable[..., Any]) -> None:
    done = invoke("validate", "--studies", "nowhere")
    assert done.exit_code == 2
    assert "validate needs the studies" in done.stderr


def test_parts_of_another_paper_are_wrong_input(invoke: Callable[..., Any]) -> None:
    done = invoke("validate", "--only", "wang2014", "--detection")
    assert done.exit_code == 2
    assert "--detection: is of bulens2023" in done.stderr
