"""Forces of pieces by borders of another one's factors: those of their own matrix."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.contact.solve.bordered import add_borders, missing_borders, piece_matrix, solve_with_borders
from fingerslip.contact.solve.dense import factorise_dense
from fingerslip.contact.states import OPEN, SLIP, STICK

NONE = np.zeros(0, dtype=np.int64)


def random_body(rng, count):
    """Return a compliance and a motion without contact forces."""
    root = rng.normal(size=(2 * count, 2 * count))
    return root @ root.T / count + np.eye(2 * count), rng.normal(size=(count, 2))


def random_piece(rng, count):
    states = rng.choice(np.array([OPEN, STICK, SLIP], dtype=np.int8), count)
    return states, np.where(states == SLIP, rng.choice([-0.5, 0.5], count), 0.0)


def base_of(compliance, states, slopes):
    matrix, unknowns, places = piece_matrix(compliance, states, slopes)
    factor = factorise_dense(matrix)
    return states, slopes, unknowns, places, factor.factors, factor.pivots


def forces_of(compliance, free, states, slopes):
    """Return the forces of a piece from its definition: all components unknown, an equation for each."""
    size = free.size
    matrix, right = compliance.copy(), -free.ravel()
    for node, (state, slope) in enumerate(zip(states, slopes, strict=True)):
        for component in range(2 * node, 2 * node + 2):
            if state == OPEN or (state == SLIP and component % 2):
                matrix[component] = np.eye(size)[component]
                right[component] = 0.0
                if state == SLIP:
                    matrix[component, component - 1] = -slope
    return np.linalg.solve(matrix, right).reshape(free.shape)


def start_of(compliance, free, base):
    matrix, unknowns, _ = piece_matrix(compliance, base[0], base[1])
    return np.linalg.solve(matrix, -free.ravel()[unknowns])


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.integers(0, 2**31), st.integers(1, 12))
def test_any_piece_can_be_reached_from_any_base_and_so_can_the_next_one(seed, count):
    rng = np.random.default_rng(seed)
    compliance, free = random_body(rng, count)
    base = base_of(compliance, *random_piece(rng, count))
    components, borders = NONE, np.zeros((2, 0, base[2].size))
    for _ in range(3):
        states, slopes = random_piece(rng, count)
        missing = missing_borders(base[0], base[1], components, states, slopes)
        components, borders = add_borders(compliance, base, components, borders, missing)
        start = start_of(compliance, free, base)
        found = solve_with_borders(compliance, free, base, start, components, borders, states, slopes)
        exact = forces_of(compliance, free, states, slopes)
        np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-10 * np.abs(exact).max(initial=1e-9))
        assert (found[states == OPEN] == 0.0).all()
        np.testing.assert_array_equal(found[states == SLIP, 1], (slopes * found[:, 0])[states == SLIP])


def test_the_base_itself_needs_no_border():
    rng = np.random.default_rng(0)
    compliance, free = random_body(rng, 6)
    states, slopes = random_piece(rng, 6)
    base = base_of(compliance, states, slopes)
    assert missing_borders(states, slopes, NONE, states, slopes).size == 0
    given_ = base, start_of(compliance, free, base), NONE, np.zeros((2, 0, base[2].size))
    found = solve_with_borders(compliance, free, *given_, states, slopes)
    np.testing.assert_allclose(found, forces_of(compliance, free, states, slopes), atol=1e-12)


@pytest.mark.parametrize(
    ("before", "after", "components"),
    [
        ((OPEN, 0.0), (STICK, 0.0), [0, 1]),
        ((OPEN, 0.0), (SLIP, 0.5), [0, 1]),
        ((STICK, 0.0), (SLIP, -0.5), [1]),
        ((STICK, 0.0), (OPEN, 0.0), [0, 1]),
        ((SLIP, 0.5), (STICK, 0.0), [1]),
        ((SLIP, 0.5), (SLIP, -0.5), [1]),
        ((SLIP, 0.5), (OPEN, 0.0), [0]),
    ],
)
def test_borders_are_the_components_that_differ(before, after, components):
    given_ = (np.array([state], dtype=np.int8) for state, _ in (before, after))
    slopes = (np.array([slope]) for _, slope in (before, after))
    (first, last), (of_first, of_last) = given_, slopes
    assert missing_borders(first, of_first, NONE, last, of_last).tolist() == components
    assert missing_borders(first, of_first, np.array(components), last, of_last).size == 0
