"""What ``fingerslip validate`` puts together."""

import dataclasses
import json
from collections import Counter
from types import MappingProxyType

import numpy as np
import pytest

from fingerslip.errors import DamagedError, InputError
from fingerslip.published import published_set
from fingerslip.validation import comparison as module
from fingerslip.validation.comparison import compare, rows_of, validate
from fingerslip.validation.evidence import FRICTION, REFINED, STUDIES, Evidence, Work
from fingerslip.validation.rows import GeometryRow, Row, Stored, number_row, rows_markdown
from places import ROOT

GEOMETRY = GeometryRow("incipient slip", "Table 2", 1.53, None, "", 0, 50)


def row(name):
    return number_row(name, published_set("wang2014-table2").values[0], 1.75, 0.01)


@pytest.fixture
def asked(monkeypatch):
    """Replace what is run; return what is asked for, in order."""
    asked = []

    def fake(name, one):
        def rows(*_, compute):
            asked.append(f"{name} computed" if compute else name)
            return Stored((one,), "" if compute else f"{name} stored.", computed=compute)

        return rows

    def validated(*_, papers):
        asked.extend(papers)
        return (row("run"),)

    monkeypatch.setattr(module, "allowed_geometry", fake("geometry", GEOMETRY))
    parts = {name: fake(name, row(name)) for name in ("pouring", "detection")}
    monkeypatch.setattr(module, "_ROWS", MappingProxyType(parts))
    monkeypatch.setattr(module, "validate", validated)
    return asked


def test_stored_rows_are_read_before_anything_is_run_of_the_papers_that_are_asked_for(asked):
    found = compare()
    assert asked == ["geometry", "pouring", "detection", "wang2014", "bulens2023"]
    assert [one.quantity for one in found.rows] == ["run", "pouring", "detection"]
    assert found.origins == ("pouring stored.", "detection stored.")
    assert found.tables[0].note.endswith("pouring stored. detection stored.")
    assert found.tables[1].note.endswith("geometry stored.")
    asked.clear()
    found = compare(only="bulens2023", computed=["pouring"])
    assert asked == ["pouring computed", "detection", "bulens2023"]
    assert len(found.tables) == 1
    asked.clear()
    assert [one.quantity for one in compare(only="wang2014").rows] == ["run"]
    assert asked == ["geometry", "wang2014"]


@pytest.mark.usefixtures("asked")
def test_plain_data_and_markdown_have_the_geometry_if_it_was_computed_and_what_is_left_out_cannot_be():
    assert len(compare().mapping()) == 3
    assert "unknown geometry" not in compare().markdown()
    computed = compare(computed=["geometry"])
    assert json.loads(json.dumps(computed.mapping()))["geometry"][0]["published"] == 1.53
    assert "## What the unknown geometry allows" in computed.markdown()
    with pytest.raises(InputError, match="--only: got 'wang', needs one of wang2014, bulens2023"):
        compare(only="wang")
    with pytest.raises(InputError, match="--pouring: is of bulens2023, needs no --only wang2014"):
        compare(only="wang2014", computed=["pouring"])


@pytest.fixture(scope="module")
def rows(evidence):
    return rows_of(evidence)


def test_every_published_value_has_a_row_one_is_calibrated_and_statements_have_a_spread(rows):
    own = [row for row in rows if row.basis != "large strain"]
    statements = [row for row in own if row.statement]
    published = published_set("wang2014-qualitative").values
    assert len(statements) == len(published)
    # Nine times and the three-quarter range in two readings, three travels, six heights, two other models, the solid.
    assert len(own) - len(statements) == 2 * 10 + 3 + 6 + 2 * 3 + 9
    first, second = (row.quantity for row in rows if row.basis == "calibrated")
    assert "overall slip, original (accumulated slip)" in first
    assert second.startswith("travel of the plate at overall slip")
    assert [row.basis for row in rows[:2]] == ["calibrated"] * 2
    spreads = {row.statement: row.uncertainty for row in rows if row.basis == "predicted" and row.statement}
    named = {value.id: value.statement for value in published}
    assert spreads[named["edges-first"]] == pytest.approx(0.75 * 0.01, abs=1e-3)
    assert spreads[named["linear-in-friction"]] is None


def test_rows_have_our_values_with_their_uncertainty_and_what_the_paper_reads_from_peaks_is_not_compared_with_areas(
    rows,
):
    latencies = [row for row in rows if row.statement.startswith("Latency")]
    assert [row.basis for row in latencies].count("large strain") == len(latencies) - 3
    assert {row.verdict for row in latencies} == {"not comparable"}
    rows = {row.quantity: row for row in rows}
    for variant in ("original", "flattened", "scaled"):
        for name in ("incipient slip", "latency"):
            row = rows[f"{name}, {variant} (accumulated slip)"]
            assert row.verdict == "not comparable"
            assert row.ours is not None
            assert rows[f"{name}, {variant} (acceleration peaks)"].verdict != "not comparable"
    overall = rows["overall slip, flattened (accumulated slip)"]
    assert (overall.ours, overall.uncertainty, overall.verdict) == (pytest.approx(1.712, abs=3e-3), 0.01, "agrees")
    assert rows["overall slip, scaled (accumulated slip)"].verdict == "misses"
    assert rows["overall slip, scaled, plane strain (accumulated slip)"].uncertainty is None
    height = rows["height of the overall slip peak, original"]
    assert (height.verdict, height.uncertainty) == ("not judged", 2.0)
    travel = rows["travel of the plate at overall slip / (friction x depth), scaled (accumulated slip)"]
    assert travel.uncertainty == pytest.approx(0.01 * 3.0 / (0.6 * 1.5))


def test_reference_nodes_have_the_tolerance_and_the_refinements_in_their_uncertainty(evidence):
    def row(evidence):
        return next(
            row for row in rows_of(evidence) if row.quantity.startswith("incipient slip, fingertip in 3D (eight")
        )

    # 0.11 s from 50 to 100 um, 0.02 s from the refinement.
    assert (row(evidence).ours, row(evidence).verdict) == (pytest.approx(0.79), "agrees")
    assert row(evidence).uncertainty == pytest.approx(np.hypot(0.11, 0.02))
    assert row(dataclasses.replace(evidence, refined_solid=())).uncertainty == pytest.approx(0.11)


def test_a_missing_study_or_a_damaged_file_is_told_before_anything_runs(tmp_path):
    with pytest.raises(InputError, match=r"wang2014_table2.yaml: is not there"):
        validate(Work(tmp_path, tmp_path / "results"))
    assert not (tmp_path / "results").exists()
    (tmp_path / "geometry.json").write_text("{")
    with pytest.raises(DamagedError, match=r"geometry\.json"):
        compare(tmp_path, tmp_path)


def test_reference_rows_are_those_of_the_page_and_of_the_statements_and_counted_in_the_documentation():
    stored = json.loads((ROOT / "results" / "reference" / "validation.json").read_text(encoding="utf-8"))
    rows = [Row(**{k: tuple(v) if isinstance(v, list) else v for k, v in entry.items()}) for entry in stored]
    page = (ROOT / "results" / "reference" / "validation.md").read_text(encoding="utf-8")
    assert rows_markdown(rows) == page
    named = [(row.statement, row.quantity) for row in rows if row.basis != "large strain" and row.statement]
    shipped = (*published_set("wang2014-qualitative").values, *published_set("bulens2023-mechanics").values)
    assert named == [(value.statement, value.check) for value in shipped]
    counts = Counter((row.verdict, row.basis) for row in rows)
    page = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    (header,) = (line for line in page.splitlines() if line.startswith("| verdict |"))
    bases = [cell.strip() for cell in header.split("|")[2:-1]]
    for verdict in {verdict for verdict, _ in counts}:
        numbers = " | ".join(str(counts[verdict, basis]) for basis in bases)
        assert f"\n| {verdict} | {numbers} |\n" in page
    assert {basis for _, basis in counts} == set(bases)
    assert set(REFINED) <= set(STUDIES)
    assert all((ROOT / "studies" / f"{name}.yaml").is_file() for name in STUDIES)


def test_large_strain_has_the_times_of_table_2_and_the_statements_on_the_phalanges(rows):
    rows = [row for row in rows if row.basis == "large strain"]
    times = [value.value for value in published_set("wang2014-table2").values]
    assert [row.published for row in rows if not row.statement] == times
    scaled = next(row for row in rows if row.quantity == "overall slip, scaled, large strain (accumulated slip)")
    assert (scaled.ours, scaled.uncertainty, scaled.verdict) == (pytest.approx(1.97, abs=5e-3), 0.01, "misses")
    order = next(row for row in rows if row.statement.startswith("Overall slip comes first with the original"))
    # The refinement has the same time of all three phalanges.
    assert (order.ours, order.uncertainty) == pytest.approx((0.01, 0.01), abs=1e-3)
    assert order.verdict == "holds"
    assert len([row for row in rows if row.statement]) == 6


def test_spread_is_the_range_over_the_refinements_where_all_have_the_number(evidence):
    def overall(one):
        return one.phalanges("wang2014_table2")[0].run.events.slip.overall

    assert evidence.spread_of(overall) == pytest.approx(0.01, abs=1e-3)
    assert Evidence(evidence.measured).spread_of(lambda _: 1.0) is None
    first = evidence.measured["wang2014_table2"]
    assert evidence.spread_of(lambda one: 1.0 if one.measured["wang2014_table2"] is first else None) is None
    counts = evidence.spread_of(lambda one: (3, 1) if one.measured["wang2014_table2"] is first else (2, 2))
    assert counts == 2.0, "counts before and after count as their difference"
    finite = evidence.at_large_strain()
    times = [one.run.events.slip.overall for one in finite.phalanges("wang2014_table2")]
    assert times == pytest.approx([1.91, 1.92, 1.97], abs=5e-3)
    assert finite.spread_of(overall) is not None
    with pytest.raises(InputError, match=r"wang2014_friction: has 0 runs with contact.friction_coefficient = 0.5"):
        evidence.one("wang2014_friction", {FRICTION: 0.5})
