"""Designs of samples: where they lie, and what belongs together."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.sampling.designs import METHODS, block_size, design_size, draw_shares


@pytest.mark.parametrize("method", METHODS)
def test_shares_are_in_the_unit_cube_and_follow_from_the_seed(method: str) -> None:
    shares = draw_shares(method, 8, 3, 1)
    assert shares.shape == (design_size(method, 8, 3), 3)
    assert (shares >= 0.0).all()
    assert (shares <= 1.0).all()
    assert np.array_equal(shares, draw_shares(method, 8, 3, 1))
    assert not np.array_equal(shares, draw_shares(method, 8, 3, 2))


def test_blocks_of_saltelli_change_one_value_each() -> None:
    blocks = draw_shares("saltelli", 16, 3, 1).reshape(16, block_size("saltelli", 3), 3)
    first, second = blocks[:, 0], blocks[:, -1]
    for j in range(3):
        expected = first.copy()
        expected[:, j] = second[:, j]
        assert np.array_equal(blocks[:, j + 1], expected)
    assert len(np.unique(first, axis=0)) == 16


def test_walks_of_morris_move_every_value_once_by_two_levels() -> None:
    walks = draw_shares("morris", 40, 4, 1).reshape(40, block_size("morris", 4), 4)
    moves = np.diff(walks, axis=1)
    assert (np.count_nonzero(moves, axis=1) == 1).all()
    assert (np.count_nonzero(moves, axis=2) == 1).all()
    assert np.abs(moves).max(axis=2) == pytest.approx(np.full((40, 4), 2.0 / 3.0))
    assert np.unique(walks.round(9)) == pytest.approx([0.0, 1 / 3, 2 / 3, 1.0])
