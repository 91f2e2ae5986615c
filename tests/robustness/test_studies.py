"""Studies damaged at random are read or refused, and never end in anything else."""

from __future__ import annotations

from pathlib import Path

import pytest

from robustness.cases import faults, newcomers
from robustness.studies import study_cases

_CASES, _PARTS = 5000, 8


def test_a_few_damaged_studies(tmp_path: Path) -> None:
    cases = study_cases(tmp_path)
    assert faults(cases, range(10), newcomers(tmp_path)) == []


@pytest.mark.slow
@pytest.mark.parametrize("part", range(_PARTS))
def test_damaged_studies(tmp_path: Path, part: int) -> None:
    cases = study_cases(tmp_path)
    assert faults(cases, range(part, _CASES, _PARTS), newcomers(tmp_path)) == []
