"""Neighbours: affine motion is expected exactly, strangers are told."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.vision.tracking.neighbours import consistent, expected_displacement, nearest_neighbours
from problems import clips

POINTS = clips.field()
NEIGHBOURS, SPACING = nearest_neighbours(POINTS)
ALL = np.ones(81, dtype=bool)


def test_nearest_come_first() -> None:
    assert NEIGHBOURS.shape == (81, 8)
    assert set(NEIGHBOURS[0]) == set(range(1, 9))
    assert nearest_neighbours(POINTS[:1])[1].tolist() == [np.inf]
    assert nearest_neighbours(POINTS[:3])[0].shape == (3, 2)


def test_translation_is_expected_exactly_and_gradients_nearly() -> None:
    moved, counts = expected_displacement(POINTS, np.tile([3.0, -2.0], (81, 1)), ALL, NEIGHBOURS)
    assert moved == pytest.approx(np.tile([3.0, -2.0], (81, 1)))
    assert (counts == 8).all()
    spread = 0.1 * (POINTS - POINTS[0])
    moved, _ = expected_displacement(POINTS, spread, ALL, NEIGHBOURS)
    assert np.abs(moved - spread).max() < 0.05 * np.abs(spread).max()


def test_without_neighbours_nothing_is_expected() -> None:
    moved, counts = expected_displacement(POINTS, np.zeros((81, 2)), ~ALL, NEIGHBOURS)
    assert np.isnan(moved).all()
    assert counts.sum() == 0


def test_strangers_are_left_out_and_nobody_else() -> None:
    displacement = 0.05 * (POINTS - POINTS[0]) + [10.0, 0.0]
    wrong = [5, 6, 40, 80]
    displacement[wrong] += [[25.0, 0.0], [25.0, 0.0], [0.0, -30.0], [-20.0, 20.0]]
    kept = consistent(POINTS, displacement, ALL, NEIGHBOURS, 0.3 * SPACING)
    assert np.flatnonzero(~kept).tolist() == wrong
    assert consistent(POINTS, displacement, ~ALL, NEIGHBOURS, SPACING).sum() == 0
