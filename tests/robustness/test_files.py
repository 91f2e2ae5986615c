"""Mesh files and surfaces damaged at random are read or refused, and never end in anything else."""

from __future__ import annotations

from pathlib import Path

import pytest

from robustness.cases import faults, newcomers
from robustness.files import mesh_cases, surface_cases

_CASES, _PARTS = 1600, 2
_KINDS = pytest.mark.parametrize("kind", [mesh_cases, surface_cases])


@_KINDS
def test_a_few_damaged_files(tmp_path: Path, kind) -> None:
    cases = kind(tmp_path)
    assert faults(cases, range(40), newcomers(tmp_path)) == []


@pytest.mark.slow
@_KINDS
@pytest.mark.parametrize("part", range(_PARTS))
def test_damaged_files(tmp_path: Path, kind, part: int) -> None:
    cases = kind(tmp_path)
    assert faults(cases, range(part, _CASES, _PARTS), newcomers(tmp_path)) == []
