"""Which runs count, and how much they spread."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.validation import STUDIES
from fingerslip.validation.evidence import FRICTION, REFINED, Evidence
from places import ROOT


def test_spread_is_the_range_over_the_refinements(evidence: Evidence) -> None:
    spread = evidence.spread_of(lambda one: one.phalanges("wang2014_table2")[0].run.events.slip.overall)
    assert spread == pytest.approx(0.01, abs=1e-3)


def test_runs_at_large_strain_take_the_place_of_those_of_table_2(evidence: Evidence) -> None:
    finite = evidence.at_large_strain()
    overall = [one.run.events.slip.overall for one in finite.phalanges("wang2014_table2")]
    assert overall == pytest.approx([1.91, 1.92, 1.97], abs=5e-3)
    assert finite.spread_of(lambda one: one.phalanges("wang2014_table2")[0].run.events.slip.overall) is not None


def test_spread_is_not_known_without_refinements_or_where_one_lacks_the_number(evidence: Evidence) -> None:
    assert Evidence(evidence.measured).spread_of(lambda _: 1.0) is None
    first = evidence.measured["wang2014_table2"]
    assert evidence.spread_of(lambda one: 1.0 if one.measured["wang2014_table2"] is first else None) is None


def test_refined_studies_are_among_the_shipped_ones() -> None:
    assert set(REFINED) <= set(STUDIES)


def test_run_that_is_not_there_is_named(evidence: Evidence) -> None:
    with pytest.raises(InputError, match=r"wang2014_friction: has 0 runs with contact.friction_coefficient = 0.5"):
        evidence.one("wang2014_friction", {FRICTION: 0.5})


def test_shipped_studies_are_all_there() -> None:
    assert all((ROOT / "studies" / f"{name}.yaml").is_file() for name in STUDIES)
