"""A contact under constant forces stays where it is below mu N, and slides away above it.

The hour of simulated time is the verification problem `hold`; these are minutes of it, and the proof that the problem
can fail.
"""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.verification.hold import ELASTIC_SLIP, LOADED, held_by_forces, held_in_partial_slip


@pytest.mark.parametrize("element", ["Q4", "H8"])
def test_a_stuck_contact_does_not_creep(element):
    history = held_by_forces(element, 0.99, 60.0, 0.5)
    hold = history["time"].values >= LOADED
    moved = history["contact_displacement"].values[hold, :, 0]
    assert (history["contact_state"].values[hold] == 1).all()
    assert np.abs(moved - moved[0]).max() < 1e-11
    # What is left of the plate's ringing on its penalty stretches nothing along the contact.
    np.testing.assert_allclose(moved, ELASTIC_SLIP, atol=1e-10)


@pytest.mark.parametrize("element", ["Q4", "H8"])
def test_a_force_above_friction_moves_it(element):
    history = held_by_forces(element, 1.01, 10.0, 0.5)
    assert (history["contact_state"].values[-1] == 2).all()
    assert history["slip_distance"].values[-1].min() > 1e-3


def test_partial_slip_stops_with_the_body_that_caused_it():
    history = held_in_partial_slip(60.0, 0.25)
    states, ended = history["contact_state"].values, history["time"].values
    assert {0, 1, 2} <= set(states[np.isclose(ended, 2.0)].ravel().tolist())
    slipped = history["slip_distance"].values[ended > 20.0]
    np.testing.assert_array_equal(slipped[0], slipped[-1])
