"""The loop over time at large strain: the grid is met whatever is halved, and what is never solved is an error."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.finite import course
from unit.dynamics.finite.blocks import block


def test_a_step_that_fails_is_halved_and_the_grid_is_met():
    history, fine = fs.simulate(block(0.45, steps=1)), fs.simulate(block(0.45, steps=32))
    assert history["time"].values.tolist() == [0.0, 1.0]
    assert history.attrs["halved_steps"] > 0
    assert fine.attrs["halved_steps"] == 0
    forces = (own["support_force"].values[-1] for own in (history, fine))
    np.testing.assert_allclose(*forces, atol=1e-4 * np.abs(fine["support_force"].values).max())


def test_what_is_never_solved_is_an_error_that_says_when_and_what_to_try(monkeypatch):
    monkeypatch.setattr(course, "_DEEPEST", 1)
    with pytest.raises(fs.ConvergenceError, match="smaller time step"):
        fs.simulate(block(0.9, steps=1))


def test_attributes_say_what_it_cost():
    attributes = fs.simulate(block(0.1)).attrs
    assert attributes["kinematics"] == "finite"
    assert attributes["newton_iterations"] >= 4
    assert attributes["factorisations"] >= 1
    assert attributes["halved_steps"] == 0
    assert {"seconds_bulk", "seconds_tangent", "seconds_factorisation"} <= attributes.keys()


def test_a_motion_computed_twice_is_the_same_to_the_last_bit():
    model = block(0.3, time=fs.TimeStepping(0.05, end=1.0))
    one, other = fs.simulate(model), fs.simulate(model)
    np.testing.assert_array_equal(one["support_force"], other["support_force"])


def test_a_body_that_nothing_moves_stays_at_rest():
    history = fs.simulate(block(support_motions={}, time=fs.TimeStepping(0.1, end=1.0)))
    np.testing.assert_allclose(history["support_force"], 0.0, atol=1e-9)


def test_small_loads_give_small_strain():
    """Forces of large and small strain differ by the strain, 1e-5."""
    model = block(1e-5)
    small = fs.simulate(dataclasses.replace(model, kinematics="small"))["support_force"].values[-1]
    np.testing.assert_allclose(fs.simulate(model)["support_force"].values[-1], small, atol=1e-4 * np.abs(small).max())
