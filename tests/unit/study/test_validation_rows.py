"""Verdicts, the table, and the rows from evidence."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.report.published import PublishedValue, published
from fingerslip.report.tables import RunEvents
from fingerslip.slip import find_events
from fingerslip.study.validation import STUDIES, Row, rows_mapping, rows_markdown, rows_table, validate
from fingerslip.study.validation.evidence import FINGERPRINT, FRICTION, VARIANT, VARIANTS, Evidence
from fingerslip.study.validation.measures import Measures, measure
from fingerslip.study.validation.rows import difference_from, number_row, statement_row
from fingerslip.study.validation.validate import rows_of
from unit import synthetic

ROOT = Path(__file__).parents[3]
TIME = PublishedValue("overall", "overall", "published", "paper, Table 1", "s", 1.72)
RANGE = PublishedValue("middle", "three_quarter", "published", "paper, text", "s", 1.64, (1.63, 1.65))
STATEMENT = PublishedValue(
    "order", "overall", "qualitative", "paper, text", "s", statement="A first.", check="B less A"
)


def verdict(ours: float | None, spread: float | None = None, resolution: float | None = 0.01) -> str:
    return number_row("q", TIME, ours, spread, resolution=resolution).verdict


@pytest.mark.parametrize(
    ("ours", "spread", "expected"),
    [
        (1.73, None, "agrees"),
        (1.7301, None, "misses"),
        (1.71, 0.001, "agrees"),
        (1.75, 0.03, "agrees"),
        (1.75, 0.029, "misses"),
        (None, 0.5, "not found"),
    ],
)
def test_number_agrees_within_resolution_or_spread(ours: float | None, spread: float | None, expected: str) -> None:
    assert verdict(ours, spread) == expected


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


@pytest.mark.parametrize(("holds", "expected"), [(True, "holds"), (False, "fails"), (None, "not found")])
def test_statement_has_its_number_and_its_words(holds: bool | None, expected: str) -> None:
    row = statement_row(STATEMENT, 0.025, 0.007, holds)
    assert (row.quantity, row.statement, row.ours, row.spread) == ("B less A", "A first.", 0.025, 0.007)
    assert (row.verdict, row.published, row.difference) == (expected, None, None)


def test_table_and_json_have_the_same_rows() -> None:
    rows = (number_row("overall slip", TIME, 1.84, 0.002, resolution=0.01), statement_row(STATEMENT, None, None, None))
    table = rows_table(rows)
    assert table.rows[0][:5] == ("overall slip", "paper, Table 1", "1.72", 1.84, pytest.approx(0.12))
    assert table.rows[1][0] == "A first. (B less A)"
    plain = json.loads(json.dumps(rows_mapping(rows)))
    assert [entry["verdict"] for entry in plain] == ["misses", "not found"]
    assert plain[1]["ours"] is None
    assert set(plain[0]) == set(Row.__dataclass_fields__)


def test_markdown_says_how_it_was_made_and_keeps_misses() -> None:
    text = rows_markdown([number_row("overall slip", RANGE, 1.84, None, resolution=0.01)])
    assert "fingerslip validate --markdown" in text
    assert "| overall slip | paper, text | 1.63 to 1.65 | 1.840 | 0.190 | - | s | misses | predicted |" in text


def run(swept: dict[str, object], **process: float) -> Measures:
    history = synthetic.make(synthetic.Process(**process))  # type: ignore[arg-type]
    return measure(RunEvents("run", swept, find_events(history)), history)


@pytest.fixture(scope="module")
def evidence() -> Evidence:
    """Return evidence of histories in which slip is overall at 1.71 s, and 10 ms later on the other mesh."""
    phalanges = tuple(run({VARIANT: variant}) for variant in VARIANTS)
    other = tuple(run({"mesh.contact_size": "1 mm", VARIANT: variant}, centre=1.72) for variant in VARIANTS)
    same = tuple(run({"mesh.contact_size": "2 mm", VARIANT: variant}) for variant in VARIANTS)
    return Evidence(
        {
            "wang2014_table2": phalanges,
            "wang2014_friction": tuple(
                run({FRICTION: mu}, friction=mu, edge=1.0 + 0.5 * mu, centre=1.1 + mu) for mu in (0.2, 0.4, 0.6, 0.8)
            ),
            "wang2014_fingerprint": tuple(
                run({FINGERPRINT: on, VARIANT: variant}) for on in (False, True) for variant in VARIANTS
            ),
            "wang2014_formulation": tuple(
                run({"fingertip.formulation": "plane_strain", VARIANT: variant}) for variant in VARIANTS
            ),
            "wang2014_section": tuple(
                run({"fingertip.section": "transverse", VARIANT: variant}) for variant in VARIANTS
            ),
            "wang2014_spread": other + same,
        }
    )


def test_every_published_value_of_the_section_has_a_row(evidence: Evidence) -> None:
    rows = rows_of(evidence)
    statements = [row for row in rows if row.statement]
    assert len(statements) == len(published("wang2014-qualitative").values)
    # Nine times and the three-quarter range in two ways, three ways, six heights, two other models.
    assert len(rows) - len(statements) == 2 * 10 + 3 + 6 + 2 * 3


def test_only_the_original_row_from_accumulated_slip_is_calibrated(evidence: Evidence) -> None:
    calibrated = [row.quantity for row in rows_of(evidence) if row.basis == "calibrated"]
    assert len(calibrated) == 5
    assert all("original" in name and "accumulated slip" in name for name in calibrated)
    assert [row.basis for row in rows_of(evidence)[:5]] == ["calibrated"] * 5


def test_rows_have_our_values_and_their_spread(evidence: Evidence) -> None:
    rows = {row.quantity: row for row in rows_of(evidence)}
    overall = rows["overall slip, flattened (accumulated slip)"]
    assert overall.ours == pytest.approx(1.715, abs=3e-3)
    assert overall.spread == pytest.approx(0.01, abs=1e-3)
    assert overall.verdict == "agrees"
    assert rows["overall slip, scaled (accumulated slip)"].verdict == "misses"
    assert rows["height of the overall slip peak, original"].verdict == "not judged"
    assert rows["overall slip, scaled, plane strain (accumulated slip)"].spread is None


def test_statements_about_the_phalanges_have_a_spread(evidence: Evidence) -> None:
    spreads = {row.statement: row.spread for row in rows_of(evidence) if row.statement}
    named = {value.id: value.statement for value in published("wang2014-qualitative").values}
    assert spreads[named["edges-first"]] == pytest.approx(0.75 * 0.01, abs=1e-3)
    assert spreads[named["linear-in-friction"]] is None


def test_spread_is_not_known_where_a_run_lacks_the_number(evidence: Evidence) -> None:
    assert evidence.spread({VARIANT: "original"}, lambda one: one.way if "2 mm" in str(one.run.swept) else None) is None
    assert evidence.spread({VARIANT: "other"}, lambda one: one.way) is None


def test_run_that_is_not_there_is_named(evidence: Evidence) -> None:
    with pytest.raises(InputError, match=r"wang2014_friction: has 0 runs with contact.friction_coefficient = 0.5"):
        evidence.one("wang2014_friction", {FRICTION: 0.5})


def test_missing_study_is_an_error_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"wang2014_table2.yaml: is not there"):
        validate(tmp_path, tmp_path / "results")
    assert not (tmp_path / "results").exists()


def test_shipped_studies_are_all_there() -> None:
    assert all((ROOT / "studies" / f"{name}.yaml").is_file() for name in STUDIES)


def test_reference_tables_and_documentation_have_the_same_rows() -> None:
    stored = json.loads((ROOT / "results" / "reference" / "validation.json").read_text(encoding="utf-8"))
    rows = [Row(**{**entry, "published": as_published(entry["published"])}) for entry in stored]
    page = (ROOT / "results" / "reference" / "validation.md").read_text(encoding="utf-8")
    assert rows_markdown(rows) == page
    assert page[page.index("| quantity") :] in (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")


def as_published(value: float | list[float] | None) -> float | tuple[float, float] | None:
    return (value[0], value[1]) if isinstance(value, list) else value


def test_reference_statements_are_those_that_ship() -> None:
    stored = json.loads((ROOT / "results" / "reference" / "validation.json").read_text(encoding="utf-8"))
    named = [(entry["statement"], entry["quantity"]) for entry in stored if entry["statement"]]
    assert named == [(value.statement, value.check) for value in published("wang2014-qualitative").values]
