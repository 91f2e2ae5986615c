"""Rotations of rigid bodies: small ones are computed, larger ones are refused."""

from __future__ import annotations

import logging

import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from problems.held import apart


def turning(moment):
    """Return a body that turns by twice the static angle at most."""
    return fs.RigidBody(
        mass=1.0,
        free=("rz",),
        centre=(0.0, 2.0),
        inertia=(1e-3,),
        springs=fs.Springs(rz=10.0),
        loads=(fs.BodyLoad(rz=moment),),
    )


@pytest.mark.parametrize(("moment", "warned"), [(0.45, False), (0.9, True)])
def test_rotations_that_are_not_very_small_are_warned_of(moment, warned, caplog):
    with caplog.at_level(logging.WARNING):
        history = fs.simulate(apart(turning(moment)))
    assert float(history.rigid_body_rotation.max()) == pytest.approx(2 * moment / 10.0, rel=1e-2)
    text = f"bodies.block.free.rz: the body turned by up to {float(history.rigid_body_rotation.max()):.3g} rad"
    assert (text in caplog.text) == warned


def test_large_rotations_are_refused():
    with pytest.raises(InputError, match=r"bodies.block.free.rz: the body has turned by 0.20\d rad at t = 0.024 s"):
        fs.simulate(apart(turning(1.2)))
