"""Errors of steps over those that are allowed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.adaptive.errors import Errors
from fingerslip.dynamics.system.scheme import hht

MASS = sparse.diags([1.0, 4.0]).tocsr()


def state(displacement, acceleration=(0.0, 0.0), step=0.1):
    return SimpleNamespace(
        displacement=np.array(displacement, dtype=float), acceleration=np.array(acceleration, dtype=float), step=step
    )


def test_a_dynamic_step_is_judged_by_its_change_of_acceleration():
    errors = Errors(MASS, 0.01)
    before, after = state((0.0, 0.0)), state((3.0, 2.0), (0.6, 0.4))
    wanted = (0.25 - 1 / 6) * 0.1**2 * 0.2 / 0.01
    assert errors.of_step(before, after, hht(0.1, 0.0)) == pytest.approx(wanted)


def test_halves_are_judged_by_what_they_differ_from_the_whole_step():
    errors = Errors(MASS, 0.01)
    whole, halves = state((3.3, 2.2)), state((3.0, 2.0))
    assert errors.of_halves(whole, halves, 1.0) == pytest.approx(0.1 / 0.01)
    assert errors.of_halves(whole, halves, 0.25) == pytest.approx(4 * 0.1 / 0.01)


def test_errors_are_over_the_largest_displacement_so_far():
    errors = Errors(MASS, 0.01)
    errors.accept(state((6.0, 4.0)))
    errors.accept(state((0.0, 0.0)))
    assert errors.of_halves(state((3.3, 2.2)), state((3.0, 2.0)), 1.0) == pytest.approx(0.05 / 0.01)


def test_a_body_at_rest_has_no_error():
    assert Errors(MASS, 0.01).of_halves(state((0.0, 0.0)), state((0.0, 0.0)), 1.0) == 0.0
