"""Rotations of rigid bodies: any about one axis, small ones about several; larger ones are refused."""

from __future__ import annotations

import logging

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.verification.meshes import box
from problems.held import apart


def turning(moment, *, free=("ry", "rz")):
    """Return a body by itself that turns by twice the static angle at most."""
    body = fs.RigidBody(
        mass=1.0,
        free=free,
        centre=(0.0, 2.0, 0.0),
        inertia=(1e-3,) * 3,
        springs=fs.Springs(**dict.fromkeys(free, 10.0)),
        loads=(fs.BodyLoad(rz=moment),),
    )
    return apart(
        body,
        mesh=box("H8", *(np.linspace(0.0, 1.0, 2),) * 3),
        formulation="solid",
        supports={"bottom": ("x", "y", "z")},
    )


@pytest.mark.parametrize(("moment", "warned"), [(0.45, False), (0.9, True)])
def test_rotations_that_are_not_very_small_are_warned_of(moment, warned, caplog):
    with caplog.at_level(logging.WARNING):
        history = fs.simulate(turning(moment))
    assert float(history.rigid_body_rotation.max()) == pytest.approx(2 * moment / 10.0, rel=1e-2)
    text = f"bodies.block.free.rz: the body turned by up to {float(history.rigid_body_rotation.max()):.3g} rad"
    assert (text in caplog.text) == warned


def test_large_rotations_are_refused():
    with pytest.raises(InputError, match=r"bodies.block.free.rz: the body has turned by 0.20\d rad at t = 0.024 s"):
        fs.simulate(turning(1.2))


def test_a_body_turns_by_any_angle_about_one_axis():
    history = fs.simulate(turning(10.0, free=("rz",)))
    assert float(history.rigid_body_rotation.max()) == pytest.approx(2.0, rel=1e-2)
