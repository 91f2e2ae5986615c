"""A plate that is free along axes, in steps without inertia."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.counterfaces import Plane
from fingerslip.dynamics.statics.plate import PRESCRIBED, free_plate
from fingerslip.dynamics.system.motion import counterface_motion

STEP = 0.1


def made(**changes):
    plate = fs.RigidBody(
        mass=1.0,
        **{"free": ("x", "z"), "dampers": fs.Dampers(x=2.0, z=1.0), "springs": fs.Springs(z=10.0), **changes},
    )
    return free_plate(plate, counterface_motion((fs.Press(1e-3, 1e-3),), Plane((0.0, 1.0, 0.0))), STEP)


def test_a_damper_and_a_spring_bear_a_load():
    plate = made(loads=(fs.BodyLoad(x=3.0, z=4.0, ramp=fs.Ramp((0.0, 2.0), (0.0, 1.0))),))
    before = np.array([0.5, 0.0])
    found = plate.unheld(1.0, before)
    # c (q_1 - q_0) / h + s q_1 = F at half of the ramp.
    assert 2.0 * (found[0] - before[0]) / STEP == pytest.approx(1.5)
    assert 1.0 * found[1] / STEP + 10.0 * found[1] == pytest.approx(2.0)


def test_contact_holds_what_it_bears():
    plate = made(loads=(fs.BodyLoad(x=3.0),))
    unheld = plate.unheld(1.0, np.zeros(2))
    held = plate.held(unheld, np.array([3.0, 7.0, 0.0]))
    assert held == pytest.approx([0.0, 0.0])
    assert plate.shift(unheld) == pytest.approx([unheld[0], 0.0, 0.0])


def test_contact_nodes_move_by_what_their_forces_do_to_the_plate():
    plate, forces = made(), np.arange(6.0)
    moved = plate.added(np.zeros((6, 6))) @ forces
    by_plate = -plate.shift(plate.held(np.zeros(2), forces.reshape(2, 3).sum(axis=0)))
    assert moved.reshape(2, 3) == pytest.approx(np.tile(by_plate, (2, 1)))


def test_a_plate_that_is_not_free_changes_nothing():
    for plate in (PRESCRIBED, made(free=(), dampers=None, springs=None)):
        assert plate.unheld(1.0, np.zeros(0)).shape == (0,)
        assert plate.shift(np.zeros(0)) == pytest.approx(np.zeros(3))
        np.testing.assert_array_equal(plate.added(np.eye(6)), np.eye(6))
