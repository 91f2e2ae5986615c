"""Which runs count, and how much they spread."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.errors import InputError
from fingerslip.study.validation import STUDIES
from fingerslip.study.validation.evidence import FRICTION, VARIANT, Evidence

ROOT = Path(__file__).parents[3]


def test_spread_is_not_known_where_a_run_lacks_the_number(evidence: Evidence) -> None:
    assert evidence.spread({VARIANT: "original"}, lambda one: one.way if "2 mm" in str(one.run.swept) else None) is None
    assert evidence.spread({VARIANT: "other"}, lambda one: one.way) is None


def test_run_that_is_not_there_is_named(evidence: Evidence) -> None:
    with pytest.raises(InputError, match=r"wang2014_friction: has 0 runs with contact.friction_coefficient = 0.5"):
        evidence.one("wang2014_friction", {FRICTION: 0.5})


def test_shipped_studies_are_all_there() -> None:
    assert all((ROOT / "studies" / f"{name}.yaml").is_file() for name in STUDIES)
