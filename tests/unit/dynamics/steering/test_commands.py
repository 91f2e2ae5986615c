"""Commands: what they change in a system, and what stays."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.steering.commands import with_command
from fingerslip.dynamics.system.system import build_system
from fingerslip.errors import InputError
from fingerslip.verification.meshes import box


def a_model(**changes: object) -> fs.Model:
    """Return a block under a plate that presses and slides."""
    values = {
        "mesh": box("Q4", np.linspace(0.0, 2.0, 3), np.linspace(0.0, 1.0, 2)),
        "materials": {"bulk": fs.Elastic(1e5, 0.3, 1000.0)},
        "formulation": "plane_strain",
        "supports": {"top": ("x", "y")},
        "contacts": (fs.Contact("bottom", fs.Plane((0.0, 1.0)), fs.Coulomb(0.3)),),
        "programme": (fs.Press(0.1, 0.1), fs.Slide(0.2, 0.1, (1.0, 0.0))),
        "time": fs.TimeStepping(0.1),
    }
    return fs.Model(**{**values, **changes})


def test_a_velocity_replaces_the_motion_from_its_time_on() -> None:
    model = a_model()
    system = build_system(model)
    found = with_command(system, model, fs.Command("bottom", velocity=(0.0, -0.05)), 1.5)
    times = np.array([0.5, 1.5, 2.5])
    np.testing.assert_allclose(found.motions[0].displacement(times), [[0.0, 0.05], [0.05, 0.1], [0.05, 0.05]])
    np.testing.assert_allclose(system.motions[0].displacement(times)[2], [0.15, 0.1])


def test_a_later_force_replaces_an_earlier_one_and_adds_to_the_drive() -> None:
    contact = fs.Contact("bottom", fs.Plane((0.0, 1.0)), fs.Coulomb(0.3), drive=fs.Drive(mass=2.0, force=3.0))
    model = a_model(contacts=(contact,), programme=(), time=fs.TimeStepping(0.1, end=1.0))
    system = build_system(model)
    at = int(system.coordinates.rigid[0])
    assert system.load(0.5)[at] == 3.0
    for force, total in ((1.0, 4.0), (-0.5, 2.5)):
        system = with_command(system, model, fs.Command("bottom", force=(force,)), 0.2)
        assert system.load(0.5)[at] == pytest.approx(total)


def test_a_free_direction_is_not_prescribed() -> None:
    body = fs.RigidBody(mass=1.0, free=("x",))
    contact = fs.Contact("bottom", fs.Plane((0.0, 1.0)), fs.Coulomb(0.3), rigid_body="block")
    model = a_model(contacts=(contact,), bodies={"block": body}, programme=(), time=fs.TimeStepping(0.1, end=1.0))
    system = build_system(model)
    with pytest.raises(InputError, match=r"command.velocity: moves along a direction in which the body is free"):
        with_command(system, model, fs.Command("block", velocity=(0.1, 0.0)), 0.0)
    moved = with_command(system, model, fs.Command("block", velocity=(0.0, 0.1)), 0.0)
    np.testing.assert_allclose(moved.displacements(0.5), [[0.0, 0.05]])
