"""``fingerslip validate``: one table, as text, JSON or Markdown."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fingerslip import validation
from fingerslip.published import published
from fingerslip.validation import geometry
from fingerslip.validation.geometry import GeometryRow
from fingerslip.validation.rows import number_row


def test_rows_come_as_table_json_and_markdown(invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    value = published("wang2014-table2").values[0]
    rows = (number_row("overall slip", value, 1.75, 0.01, resolution=0.01),)
    asked: list[tuple[Path, Path, int]] = []
    monkeypatch.setattr(validation, "validate", lambda *given: asked.append(given[:3]) or rows)
    monkeypatch.setattr(validation, "pouring_rows", lambda *_, compute: rows if compute else ())
    monkeypatch.setattr(validation, "detection_rows", lambda *_, compute: rows if compute else ())
    allowed = (GeometryRow("incipient slip", "Table 2", 1.53, None, "", 0, 50),)
    monkeypatch.setattr(geometry, "stored_geometry", lambda *_: (allowed, "Stored."))
    monkeypatch.setattr(geometry, "run_geometry", lambda *_: allowed)
    assert "overall slip" in invoke("validate", "--studies", "s", "--results", "r", "--workers", "1").stdout
    assert asked == [(Path("s"), Path("r"), 1)]
    assert json.loads(invoke("validate", "--json").stdout)[0]["ours"] == 1.75
    assert len(json.loads(invoke("validate", "--json", "--pouring").stdout)) == 2
    assert len(json.loads(invoke("validate", "--json", "--detection").stdout)) == 2
    page = invoke("validate", "--markdown").stdout
    assert page.startswith("# Validation against published values\n")
    assert "unknown geometry" not in page
    assert "Stored." in invoke("validate").stdout
    both = json.loads(invoke("validate", "--geometry", "--json").stdout)
    assert (both["rows"][0]["ours"], both["geometry"][0]["published"]) == (1.75, 1.53)
    assert "## What the unknown geometry allows" in invoke("validate", "--geometry", "--markdown").stdout


def test_a_missing_study_is_wrong_input(invoke: Callable[..., Any]) -> None:
    done = invoke("validate", "--studies", "nowhere")
    assert done.exit_code == 2
    assert "validate needs the studies" in done.stderr
