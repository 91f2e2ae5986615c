"""Tracks and detectors changed at random are read as they are or refused, and never end in anything else."""

from __future__ import annotations

from pathlib import Path

import pytest

from robustness.cases import faults, newcomers
from robustness.learned import detector_cases, track_cases

_CASES, _PARTS = 1200, 2
_KINDS = pytest.mark.parametrize("kind", [track_cases, detector_cases])


@_KINDS
def test_a_few_changed_files(tmp_path: Path, kind) -> None:
    cases = kind(tmp_path)
    assert faults(cases, range(20), newcomers(tmp_path)) == []


@pytest.mark.slow
@_KINDS
@pytest.mark.parametrize("part", range(_PARTS))
def test_changed_files(tmp_path: Path, kind, part: int) -> None:
    cases = kind(tmp_path)
    assert faults(cases, range(part, _CASES, _PARTS), newcomers(tmp_path)) == []
