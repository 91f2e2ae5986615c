"""What is doubtful in models that can be computed."""

from __future__ import annotations

import dataclasses
import logging

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.dynamics.system.doubts import doubts
from fingerslip.verification.meshes import box

PLATE = fs.Contact("bottom", fs.Plane(normal=(0, 1)), fs.Coulomb(0.5))
MODEL = fs.Model(
    mesh=box("Q4", np.linspace(0.0, 10e-3, 21), np.linspace(0.0, 4e-3, 5)),
    materials={"bulk": fs.Elastic(136e3, 0.3, 1000.0)},
    formulation="plane_strain",
    supports={"top": ("x", "y")},
    contacts=(PLATE,),
    programme=(fs.Press(0.2e-3, 1e-3), fs.Hold(1e-3), fs.Slide(0.4e-3, 1e-3)),
    time=fs.TimeStepping(5e-3),
)
FAR = dataclasses.replace(PLATE, counterface=fs.Plane(normal=(0, 1), offset=-1e-3), search_distance=5e-3)
WEAKENING = dataclasses.replace(PLATE, friction=fs.StaticKinetic(0.6, 0.4, 1e-3), rigid_body="block")
RINGING: dict[str, object] = {
    "contacts": (WEAKENING,),
    "bodies": {"block": fs.RigidBody(0.1, free=("x", "y"))},
    "time": fs.TimeStepping(5e-3, end=0.1),
}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"time": fs.TimeStepping(10e-3)}, ["programme.0: the press takes 20 steps", "a step of 8 ms or less"]),
        ({"time": fs.QuasiStatic(20e-3)}, ["programme.2: the slide takes 20 steps"]),
        (
            {"contacts": (dataclasses.replace(PLATE, counterface=fs.Plane(normal=(0, -2))),)},
            ["contacts.0.counterface: its normal points away from the body", "write (0, 1)"],
        ),
        (
            {"contacts": (FAR,), "programme": (fs.Press(0.2e-3, 1e-3),)},
            ["contacts.0: never touches 'bottom', which is 1 mm away", "comes 0.2 mm nearer"],
        ),
        (
            {"mesh": box("Q4", np.linspace(0.0, 10e-3, 9), np.linspace(0.0, 4e-3, 5))},
            ["contacts.0: 9 nodes of 'bottom' are in reach", "take smaller elements there"],
        ),
        (
            RINGING,
            ["contacts.0.friction: falls from static to kinetic on 'block'", "write a damping"],
        ),
        ({"supports": {}}, ["supports: there are none", "support a boundary"]),
        ({"materials": {"bulk": fs.Elastic(136.0, 0.3, 1000.0)}}, ["materials.bulk: a modulus of 136 Pa", "136e3"]),
    ],
)
def test_what_is_hardly_meant_is_named_and_nothing_else(changes: dict[str, object], words: list[str]) -> None:
    model = dataclasses.replace(MODEL, **changes)
    texts = doubts(model, inspect_model(model))
    assert all(any(word in text for text in texts) for word in words), texts
    assert len(texts) <= 2


def test_a_model_that_is_meant_has_none() -> None:
    assert doubts(MODEL, inspect_model(MODEL)) == ()
    adaptive = dataclasses.replace(MODEL, time=fs.Adaptive(50e-3))
    damped = dataclasses.replace(MODEL, **RINGING, damping=fs.RayleighDamping(stiffness=1e-3))
    assert doubts(damped, inspect_model(damped)) == ()
    assert doubts(adaptive, inspect_model(adaptive)) == ()
    static = dataclasses.replace(MODEL, time=fs.QuasiStatic(10e-3), programme=(fs.Press(0.2e-3, 1e-3),))
    assert doubts(static, inspect_model(static)) == (), "a press without inertia needs few steps"


def test_simulating_says_them(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, logger="fingerslip.dynamics"):
        fs.simulate(dataclasses.replace(MODEL, supports={}, programme=(fs.Press(0.2e-3, 1e-3),)))
    assert "supports: there are none" in caplog.text
