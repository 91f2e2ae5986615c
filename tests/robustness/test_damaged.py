"""Meshes, tracks, detectors, results and studies damaged at random are read or refused, and end in nothing else."""

from collections.abc import Callable
from pathlib import Path

import pytest

from robustness.cases import faults, newcomers, unfinished
from robustness.files import mesh_cases, surface_cases
from robustness.learned import detector_cases, track_cases
from robustness.results import forged_cases, result_cases
from robustness.studies import study_cases

Kind = Callable[[Path], Callable]
# Kind of cases, how many of them in the fast tier (detectors and forged results take seconds) and in all, and how many
# tests these are in the slow one.
KINDS: list[tuple[Kind, int, int, int]] = [
    (mesh_cases, 40, 1600, 2),
    (surface_cases, 40, 1600, 2),
    (track_cases, 4, 1200, 2),
    (detector_cases, 0, 1200, 2),
    (study_cases, 3, 5000, 8),
    (result_cases, 3, 1800, 8),
    (forged_cases, 0, 1000, 1),
]


def check(kind, numbers, folder):
    cases = kind(folder)
    stored = kind in {result_cases, forged_cases}
    assert faults(cases, numbers, (lambda: unfinished(folder)) if stored else newcomers(folder)) == []


@pytest.mark.parametrize(("kind", "count"), [pytest.param(*row[:2], id=row[0].__name__) for row in KINDS if row[1]])
def test_a_few_damaged_ones(tmp_path, kind, count):
    check(kind, range(count), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "numbers"),
    [
        pytest.param(kind, range(part, count, parts), id=f"{kind.__name__}-{part}")
        for kind, _, count, parts in KINDS
        for part in range(parts)
    ],
)
def test_damaged_ones(tmp_path, kind, numbers):
    check(kind, numbers, tmp_path)
