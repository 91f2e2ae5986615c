"""Rigid bodies as data: what they take, in Python and from files, and mistakes."""

from __future__ import annotations

import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.model.rigid_bodies import directions_in
from fingerslip.parameters import as_mapping, from_mapping

JUG = {
    "mass": "300 g",
    "free": ["y", "rz"],
    "centre": ["0 mm", "40 mm"],
    "inertia": ["2 g m^2"],
    "filling": {"times": ["0 s", "2 s"], "factors": [0, 1]},
    "loads": [{"rz": "1 N mm", "ramp": {"times": ["0 s"], "factors": [2]}}, {"y": "-1 N"}],
    "springs": {"y": "2 N/mm", "rz": "3 N mm"},
    "dampers": {"rz": "4 N m s"},
    "initial_velocity": {"y": "5 mm/s", "rz": "1 rad/s"},
    "programme": [],
}


def test_a_body_is_read_from_a_file_with_units_and_written_back():
    jug = from_mapping(fs.RigidBody, JUG)
    assert jug == fs.RigidBody(
        mass=0.3,
        free=("y", "rz"),
        centre=(0.0, 0.04),
        inertia=(2e-3,),
        filling=fs.Ramp((0.0, 2.0), (0.0, 1.0)),
        loads=(fs.BodyLoad(rz=1e-3, ramp=fs.Ramp((0.0,), (2.0,))), fs.BodyLoad(y=-1.0)),
        springs=fs.Springs(y=2e3, rz=3e-3),
        dampers=fs.Dampers(rz=4.0),
        initial_velocity=fs.BodyVelocity(y=5e-3, rz=1.0),
    )
    assert from_mapping(fs.RigidBody, as_mapping(jug)) == jug


def test_directions_of_the_plane_are_three():
    assert directions_in(2) == ("x", "y", "rz")
    assert directions_in(3) == ("x", "y", "z", "rx", "ry", "rz")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"mass": 0.0}, r"RigidBody.mass: got 0 g, needs a value > 0"),
        ({"free": ("x", "x")}, r"RigidBody.free: got x, x, needs each direction once"),
        ({"free": ("along",)}, r"RigidBody.free.0: got 'along'"),
        (
            {"free": ("rz",), "inertia": (1.0,)},
            r"centre: is missing, a body that is free about an axis \(rz\) needs it",
        ),
        ({"free": ("rz",), "centre": (0.0, 0.0)}, r"inertia: is missing"),
        ({"free": ("rz",), "centre": (0.0, 0.0), "inertia": (0.0,)}, r"inertia.0: got 0 kg m\^2, needs a value > 0"),
        ({"filling": fs.Ramp((0.0,), (-1.0,))}, r"filling: got -1, needs shares of the mass, 0 or more"),
        ({"springs": fs.Springs(x=1.0)}, r"springs.x: acts where the body is not free, free is: none; add x to free"),
        ({"free": ("y",), "dampers": fs.Dampers(x=1.0)}, r"dampers.x: acts where the body is not free, free is: y"),
        ({"free": ("y",), "loads": (fs.BodyLoad(rz=1.0),)}, r"loads.0.rz: acts where the body is not free"),
        ({"initial_velocity": fs.BodyVelocity(z=1.0)}, r"initial_velocity.z: acts where the body is not free"),
    ],
)
def test_what_a_body_cannot_be_is_refused(values, message):
    with pytest.raises(InputError, match=message):
        fs.RigidBody(**({"mass": 1.0} | values))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fs.Springs(x=-1.0), r"Springs.x: got -1 N/m, needs a value >= 0"),
        (lambda: fs.Dampers(rx=-1.0), r"Dampers.rx: got -1 N m s, needs a value >= 0"),
        (lambda: from_mapping(fs.Springs, {"rz": "1 N/m"}), r"rz: got '1 N/m', needs a unit of \[N m\]"),
    ],
)
def test_springs_and_dampers_of_wrong_sign_or_unit_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
