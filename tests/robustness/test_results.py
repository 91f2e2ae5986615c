"""Results damaged at random are refused or computed again, and never trusted."""

from __future__ import annotations

from pathlib import Path

import pytest

from robustness.cases import faults, unfinished
from robustness.results import forged_cases, result_cases

_CASES, _PARTS = 1800, 8


def test_a_few_damaged_results(tmp_path: Path) -> None:
    assert faults(result_cases(tmp_path), range(3), lambda: unfinished(tmp_path)) == []


@pytest.mark.slow
@pytest.mark.parametrize("part", range(_PARTS))
def test_damaged_results(tmp_path: Path, part: int) -> None:
    assert faults(result_cases(tmp_path), range(part, _CASES, _PARTS), lambda: unfinished(tmp_path)) == []


def test_a_few_results_with_other_values_and_checksums_that_fit(tmp_path: Path) -> None:
    assert faults(forged_cases(tmp_path), range(40), lambda: unfinished(tmp_path)) == []


@pytest.mark.slow
def test_results_with_other_values_and_checksums_that_fit(tmp_path: Path) -> None:
    assert faults(forged_cases(tmp_path), range(40, 1000), lambda: unfinished(tmp_path)) == []
