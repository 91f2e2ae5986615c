"""Rigid bodies between two fingers, on a pad, and by themselves."""

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import axes_of, box, components, formulation_of

SQUEEZE, GRAVITY, MU, MODULUS = 0.5e-3, 9.81, 0.5, 1e5
ELASTIC = fs.Elastic(MODULUS, 0.3, 1000.0)
# Squeezed at once, and slowly enough for a push of a hundredth of the squeeze.
CLOSING = fs.Ramp((0.0, 0.05), (0.0, 1.0))


def two_fingers(element="Q4", cells=3, high=4):
    """Return two blocks of 10 mm with 10 mm between them, `left` and `right`, joined; cells along and up each."""
    across, up = np.linspace(0.0, 10e-3, 3), np.linspace(-5e-3, 5e-3, high + 1)
    sides = {"left": np.linspace(-15e-3, -5e-3, cells + 1), "right": np.linspace(5e-3, 15e-3, cells + 1)}
    return fs.join_meshes({name: box(element, along, across, up) for name, along in sides.items()})


def held(element="Q4", *, body=None, friction=None, squeeze=SQUEEZE, closing=CLOSING, penalty=4e8, **changes):
    """Return two fingers that close on a rigid body, which their friction holds."""
    axes, law = axes_of(element), friction or fs.Coulomb(MU)

    def along(value):
        return components(element, value, 0.0, 0.0)

    values = {
        "mesh": two_fingers(element),
        "materials": {"left_bulk": ELASTIC, "right_bulk": ELASTIC},
        "formulation": formulation_of(element),
        "depth": 10e-3 if len(axes) == 2 else 1.0,
        "supports": {"left_left": axes, "right_right": axes},
        "support_motions": {
            "left_left": fs.SupportMotion(along(squeeze), closing),
            "right_right": fs.SupportMotion(along(-squeeze), closing),
        },
        "contacts": tuple(
            fs.Contact(side, fs.Plane(along(sign)), law, penalty, penalty, rigid_body="jug")
            for side, sign in (("left_right", -1.0), ("right_left", 1.0))
        ),
        "bodies": {"jug": body or fs.RigidBody(0.02, free=axes, filling=fs.Ramp((0.05, 0.1), (0.0, 1.0)))},
        "gravity": components(element, 0.0, 0.0, -GRAVITY),
        "time": fs.TimeStepping(1e-3, end=0.2),
    }
    return fs.Model(**(values | changes))


def apart(body, dim=2, **changes):
    """Return a held mesh that does not matter, and a rigid body by itself."""
    element = "Q4" if dim == 2 else "H8"
    values = {
        "mesh": box(element, *[np.linspace(0.0, 1.0, 3)] * dim),
        "materials": {"bulk": ELASTIC},
        "formulation": formulation_of(element),
        "supports": {"bottom": axes_of(element)},
        "bodies": {"block": body},
        "time": fs.TimeStepping(1e-3, alpha=0.0, end=0.1),
    }
    return fs.Model(**(values | changes))
