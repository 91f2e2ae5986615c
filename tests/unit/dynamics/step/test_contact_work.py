"""What contact forces do in a step, beside sums written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.step.contact_work import contact_work
from fingerslip.linear.symmetric import compiled_parts

NONE = np.zeros((0, 0))


@pytest.mark.parametrize("is_released", [False, True])
def test_works_are_those_of_the_mean_forces(is_released):
    rng = np.random.default_rng(1)
    relative, displacement = sparse.random(6, 8, 0.5, "csr", random_state=2), rng.normal(size=8)
    counterface, travel, before = np.array([1, 0, 1]), rng.normal(size=(2, 2)), rng.normal(size=(2, 2))
    moved_before, forces, forces_before, released = rng.normal(size=(4, 3, 2))
    given = displacement, counterface, travel, before, moved_before, forces, forces_before
    corrections = (NONE, released if is_released else NONE)
    moved, inward, outward = contact_work(compiled_parts(relative), *given, corrections)
    np.testing.assert_allclose(moved, (relative @ displacement).reshape(3, 2) - travel[counterface], atol=1e-15)
    mean = 0.5 * (forces + forces_before + (released if is_released else 0.0))
    assert inward == pytest.approx(-np.sum(mean * (moved - moved_before)), rel=1e-13)
    assert outward == pytest.approx(np.sum(mean * (travel - before)[counterface]), rel=1e-13)
