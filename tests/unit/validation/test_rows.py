"""Verdicts, the table, and the rows from evidence."""

from __future__ import annotations

import dataclasses
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.published import PublishedValue
from fingerslip.validation import Row, rows_mapping, rows_markdown, rows_table
from fingerslip.validation.rows import difference_from, number_row, statement_row

TIME = PublishedValue("overall", "overall", "published", "paper, Table 1", "s", 1.72)
RANGE = PublishedValue("middle", "three_quarter", "published", "paper, text", "s", 1.64, (1.63, 1.65))
STATEMENT = PublishedValue(
    "order", "overall", "qualitative", "paper, text", "s", statement="A first.", check="B less A; holds above 0.02"
)


def verdict(ours: float | None, uncertainty: float | None = None, resolution: float | None = 0.01) -> str:
    return number_row("q", TIME, ours, uncertainty, resolution=resolution).verdict


@pytest.mark.parametrize(
    ("ours", "uncertainty", "expected"),
    [
        (1.73, None, "agrees"),
        (1.7301, None, "misses"),
        (1.71, 0.001, "agrees"),
        (1.75, 0.03, "agrees"),
        (1.75, 0.029, "misses"),
        (None, 0.5, "not found"),
    ],
)
def test_number_agrees_within_resolution_or_uncertainty(
    ours: float | None, uncertainty: float | None, expected: str
) -> None:
    assert verdict(ours, uncertainty) == expected


def test_number_of_another_quantity_is_shown_and_not_compared() -> None:
    row = number_row("q", TIME, 1.72, None, resolution=0.01, comparable=False)
    assert (row.verdict, row.ours, row.difference) == ("not comparable", 1.72, pytest.approx(0.0))
    assert statement_row(STATEMENT, 0.03, None, comparable=False).verdict == "not comparable"


def test_number_without_resolution_is_not_judged() -> None:
    assert verdict(1.72, 9.0, None) == "not judged"
    assert verdict(None, None, None) == "not found"


@given(st.floats(0.0, 3.0))
def test_difference_leads_back_to_the_range(ours: float) -> None:
    low, high = 1.63, 1.65
    difference = difference_from(ours, (low, high))
    assert low - 1e-12 <= ours - difference <= high + 1e-12
    assert (difference == 0.0) == (low <= ours <= high)


def test_range_keeps_both_ends() -> None:
    row = number_row("q", RANGE, 1.66, None, resolution=0.01)
    assert row.published == (1.63, 1.65)
    assert row.difference == pytest.approx(0.01)


def test_statement_is_no_number() -> None:
    with pytest.raises(ValueError, match="order is no number"):
        number_row("q", STATEMENT, 1.0, None, resolution=0.01)


@pytest.mark.parametrize(
    ("rule", "ours", "expected"),
    [
        ("above 1.5", 1.5, "fails"),
        ("from 2", 2.0, "holds"),
        ("below 0.5", 0.5, "fails"),
        ("up to 0.1", 0.1, "holds"),
        ("at 3", 3.0, "holds"),
        ("at 3", 2.0, "fails"),
        ("when only the first has any", (2, 0), "holds"),
        ("when only the first has any", (2, 1), "fails"),
        ("when only the first has any", (0, 0), "fails"),
        ("above 1", None, "not found"),
    ],
)
def test_statement_holds_by_its_own_rule(rule: str, ours: float | tuple[int, int] | None, expected: str) -> None:
    value = dataclasses.replace(STATEMENT, check=f"B less A; holds {rule}")
    row = statement_row(value, ours, 0.007)
    number = ours[0] - ours[1] if isinstance(ours, tuple) else ours
    assert (row.quantity, row.statement, row.ours, row.uncertainty) == (value.check, "A first.", number, 0.007)
    assert (row.verdict, row.published, row.difference) == (expected, None, None)


def test_statement_without_a_rule_is_no_statement() -> None:
    with pytest.raises(ValueError, match="order: no rule"):
        statement_row(dataclasses.replace(STATEMENT, check="B less A"), 1.0, None)


def test_table_and_json_have_the_same_rows() -> None:
    rows = (number_row("overall slip", TIME, 1.84, 0.002, resolution=0.01), statement_row(STATEMENT, None, None))
    table = rows_table(rows)
    assert table.rows[0][:5] == ("overall slip", "paper, Table 1", "1.72", 1.84, pytest.approx(0.12))
    assert table.rows[1][0] == "A first. (B less A; holds above 0.02)"
    plain = json.loads(json.dumps(rows_mapping(rows)))
    assert [entry["verdict"] for entry in plain] == ["misses", "not found"]
    assert plain[1]["ours"] is None
    assert set(plain[0]) == set(Row.__dataclass_fields__)


def test_json_has_null_for_what_is_no_number() -> None:
    (plain,) = rows_mapping([number_row("overall slip", TIME, float("nan"), None, resolution=0.01)])
    assert (plain["ours"], plain["uncertainty"]) == (None, None)
    json.dumps(plain, allow_nan=False)


def test_markdown_says_how_it_was_made_and_keeps_misses() -> None:
    text = rows_markdown([number_row("overall slip", RANGE, 1.84, None, resolution=0.01)])
    assert "fingerslip validate --markdown" in text
    assert "| overall slip | paper, text | 1.63 to 1.65 | 1.840 | 0.190 | n/s | s | misses | predicted |" in text
