"""One to one, within reach, and the sum decides."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.vision.tracking.neighbours import assign


def test_what_is_too_far_is_not_taken() -> None:
    rows, columns = assign(np.array([[0.0, 0.0]]), np.array([5.0]), np.array([[6.0, 0.0]]), np.ones(1))
    assert (len(rows), len(columns)) == (0, 0)


def test_thing_that_was_found_twice_is_given_once() -> None:
    expected = np.array([[0.0, 0.0], [8.0, 0.0]])
    found = np.array([[4.0, 0.0], [4.01, 0.0]])
    rows, _ = assign(expected, np.full(2, 10.0), found, np.array([0.8, 0.9]))
    assert len(rows) == 1


@given(st.integers(1, 8), st.integers(1, 8), st.integers(0, 99))
def test_nobody_is_matched_twice(n: int, m: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    expected, found = rng.uniform(0, 30, (n, 2)), rng.uniform(0, 30, (m, 2))
    rows, columns = assign(expected, np.full(n, 12.0), found, rng.uniform(0, 1, m))
    assert len(set(rows)) == len(rows)
    assert len(set(columns)) == len(columns) == len(rows)
    assert (np.linalg.norm(expected[rows] - found[columns], axis=1) <= 12.0).all()
