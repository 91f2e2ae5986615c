"""Element sizes: how they grow, and how lengths and curves are divided by them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.mesh.sizes import GROWTH, check_sizes, grade, size_at, subdivide

LINE = np.linspace(0.0, 10.0, 2001)


def test_the_bulk_is_never_finer_than_the_contact() -> None:
    check_sizes(0.2e-3, 0.2e-3)
    with pytest.raises(InputError) as caught:
        check_sizes(0.2e-3, 0.1e-3)
    assert str(caught.value) == "bulk_size: got 0.1 mm, needs >= 0.2 mm (contact_size)"


@pytest.mark.parametrize(("size", "parts"), [(1.0, 10), (0.5, 20), (0.9, 12), (3.0, 4), (100.0, 2)])
def test_equal_sizes_divide_a_length_into_an_even_number_of_equal_parts(size: float, parts: int) -> None:
    """The even number next to length over size, at least two."""
    divided = grade(LINE, np.full(LINE.size, size))
    assert divided == pytest.approx(np.linspace(0.0, 10.0, parts + 1), abs=1e-9)


@given(st.lists(st.floats(0.05, 3.0), min_size=2, max_size=6))
def test_graded_parts_are_near_the_wanted_sizes_and_grow_slowly(wanted: list[float]) -> None:
    sizes = np.interp(LINE, np.linspace(0.0, 10.0, len(wanted)), wanted)
    divided = grade(LINE, sizes)
    parts = np.diff(divided)
    assert (divided[0], divided[-1]) == (0.0, 10.0)
    assert len(parts) % 2 == 0
    assert np.all(parts > 0.0)
    if len(parts) > 8:
        # Rounding to an even number of parts changes all of them alike.
        assert np.all(parts <= 1.2 * sizes.max() * (1 + 2 / len(parts)))
        assert np.all(np.abs(np.diff(parts)) <= 1.3 * GROWTH * np.maximum(parts[1:], parts[:-1]))


def test_a_small_size_spreads_to_both_sides_at_the_rate_of_growth() -> None:
    sizes = np.where(np.abs(LINE - 4.0) < 0.01, 0.1, 5.0)
    divided = grade(LINE, sizes)
    middles, parts = 0.5 * (divided[1:] + divided[:-1]), np.diff(divided)
    expected = 0.1 + GROWTH * np.abs(middles - 4.0)
    assert parts == pytest.approx(expected, rel=0.12)


def test_sizes_at_points_grow_from_the_nearest_source_up_to_the_bulk() -> None:
    points = np.array([[0.0, 0.0], [3.0, 4.0], [0.0, 1.0], [50.0, 0.0]])
    sources, own = np.array([[0.0, 0.0], [0.0, 2.0]]), np.array([1.0, 0.5])
    # At (0, 1) the finer source counts: 0.5 + 0.2 of the distance 1.
    found = size_at(points, sources, own, 2.0)
    assert found == pytest.approx([0.5 + 0.2 * 2.0, min(1.0 + 0.2 * 5.0, 0.5 + 0.2 * np.hypot(3, 2)), 0.7, 2.0])


def circle(radius: float, count: int = 4000) -> np.ndarray:
    angle = np.linspace(0.0, 2 * np.pi, count)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("turn", [10.0, 18.0, 30.0])
def test_no_part_of_a_bend_turns_by_more_than_the_limit(turn: float) -> None:
    curve = circle(1.0)
    divided = subdivide(curve, np.full(len(curve), 5.0), np.radians(turn))
    chord = np.linalg.norm(np.diff(divided, axis=0), axis=1)
    angle = 2 * np.arcsin(chord / 2)
    assert np.degrees(angle).max() <= turn * 1.001
    assert len(chord) == np.ceil(360.0 / turn - 1e-6)


def test_corners_of_a_curve_become_nodes() -> None:
    side = np.linspace(0.0, 1.0, 101)
    path = np.vstack([np.column_stack([side, 0 * side])[:-1], np.column_stack([0 * side + 1.0, side])])
    divided = subdivide(path, np.full(len(path), 0.3), np.radians(18.0))
    assert any(np.allclose(node, [1.0, 0.0], atol=1e-12) for node in divided)
    assert divided[[0, -1]] == pytest.approx(np.array([[0.0, 0.0], [1.0, 1.0]]))
    # Each side alone: ceil(1 / 0.3) parts.
    assert len(divided) == 2 * 4 + 1


def test_parts_of_a_straight_line_are_no_longer_than_wanted() -> None:
    line = np.column_stack([LINE, 0 * LINE])
    sizes = 0.2 + 0.1 * LINE
    parts = np.diff(subdivide(line, sizes, np.radians(18.0))[:, 0])
    middles = np.cumsum(parts) - parts / 2
    assert np.all(parts <= (0.2 + 0.1 * middles) * 1.01)
    assert np.all(parts >= (0.2 + 0.1 * middles) * 0.9)
