"""Rigid bodies between two fingers, on a pad, and by themselves."""

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import box

SQUEEZE, GRAVITY, MU, MODULUS = 0.5e-3, 9.81, 0.5, 1e5
ELASTIC = fs.Elastic(MODULUS, 0.3, 1000.0)
# Squeezed at once, and slowly enough for a push of a hundredth of the squeeze.
CLOSING = fs.Ramp((0.0, 0.05), (0.0, 1.0))


def two_fingers(element="Q4"):
    """Return two blocks of 10 mm with 10 mm between them, `left` and `right`, joined."""
    across = [np.linspace(0.0, 10e-3, 3)] if element in {"H8", "T4", "T10"} else []
    high = np.linspace(-5e-3, 5e-3, 5)
    sides = {"left": np.linspace(-15e-3, -5e-3, 4), "right": np.linspace(5e-3, 15e-3, 4)}
    return fs.join_meshes({name: box(element, along, *across, high) for name, along in sides.items()})


def held(element="Q4", *, body=None, friction=None, **changes):
    """Return two fingers that close on a rigid body, which their friction holds."""
    mesh = two_fingers(element)
    dim = mesh.dim()
    axes = ("x", "y", "z")[:dim]
    normal, none = (1.0,) + (0.0,) * (dim - 1), (0.0,) * (dim - 1)
    law, penalty = friction or fs.Coulomb(MU), 10 * MODULUS / 2.5e-3
    values = {
        "mesh": mesh,
        "materials": {"left_bulk": ELASTIC, "right_bulk": ELASTIC},
        "formulation": "plane_strain" if dim == 2 else "solid",
        "depth": 10e-3 if dim == 2 else 1.0,
        "supports": {"left_left": axes, "right_right": axes},
        "support_motions": {
            "left_left": fs.SupportMotion((SQUEEZE, *none), CLOSING),
            "right_right": fs.SupportMotion((-SQUEEZE, *none), CLOSING),
        },
        "contacts": (
            fs.Contact(
                "left_right", fs.Plane(tuple(-value for value in normal)), law, penalty, penalty, rigid_body="jug"
            ),
            fs.Contact("right_left", fs.Plane(normal), law, penalty, penalty, rigid_body="jug"),
        ),
        "bodies": {"jug": body or fs.RigidBody(0.02, free=axes, filling=fs.Ramp((0.05, 0.1), (0.0, 1.0)))},
        "gravity": (*none, -GRAVITY),
        "time": fs.TimeStepping(1e-3, end=0.2),
    }
    return fs.Model(**(values | changes))


def apart(body, dim=2, **changes):
    """Return a held mesh that does not matter, and a rigid body by itself."""
    values = {
        "mesh": box("Q4" if dim == 2 else "H8", *[np.linspace(0.0, 1.0, 3)] * dim),
        "materials": {"bulk": ELASTIC},
        "formulation": "plane_strain" if dim == 2 else "solid",
        "supports": {"bottom": ("x", "y", "z")[:dim]},
        "bodies": {"block": body},
        "time": fs.TimeStepping(1e-3, alpha=0.0, end=0.1),
    }
    return fs.Model(**(values | changes))
