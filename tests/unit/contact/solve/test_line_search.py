"""A step is accepted where it achieves a small share of the decrease that the slope promises."""

from __future__ import annotations

import pytest

from fingerslip.contact.solve.line_search import decreases_enough


@pytest.mark.parametrize(("length", "least_decrease"), [(1.0, 2e-4), (0.5, 1e-4), (2.0**-11, 2e-4 / 2**11)])
def test_the_decrease_that_is_asked_for_is_proportional_to_the_length(length, least_decrease):
    assert decreases_enough(3.0 * (1.0 - 1.01 * least_decrease), 3.0, length)
    assert not decreases_enough(3.0 * (1.0 - 0.99 * least_decrease), 3.0, length)


def test_no_step_from_a_solution_is_refused_for_being_one():
    assert decreases_enough(0.0, 0.0, 1.0)


def test_a_merit_that_is_not_a_number_is_no_decrease():
    assert not decreases_enough(float("nan"), 1.0, 1.0)
