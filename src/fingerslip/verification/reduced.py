"""A reduced basis of all modes beside the mesh: all that compiled code takes, of which a block shows one at a time.

In a basis as large as the mesh both solve the same equations, so that only rounding tells them apart.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb, SlipWeakening, StaticKinetic
from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.model.model import Contact, Drive, Model, Recording, ReducedBasis, Traction
from fingerslip.model.programme import Hold, Lift, Press, Ramp, Slide
from fingerslip.model.rigid_bodies import BodyLoad, RigidBody, Springs
from fingerslip.model.timing import QuasiStatic, TimeStepping
from fingerslip.sites import Site
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, VerificationError, absolute, solve_problem

_PLATE, _STEP = Plane((0.0, 1.0)), 2e-3
_SPRUNG = RigidBody(1e-3, free=("y",), springs=Springs(y=5.0), loads=(BodyLoad(y=0.02),))
#: What a model has in place of the block's own, by the ability that it shows.
ABILITIES: Mapping[str, Mapping[str, Any]] = {
    "one counterface": {},
    "static and kinetic friction": {"contacts": (Contact("bottom", _PLATE, StaticKinetic(0.5, 0.3, 2e-3)),)},
    "weakening friction": {"contacts": (Contact("bottom", _PLATE, SlipWeakening(0.6, 0.3, 50e-6)),)},
    "damping": {"damping": RayleighDamping(mass=5.0, stiffness=1e-3)},
    "no inertia": {"time": QuasiStatic(_STEP)},
    "impacts and releases": {"time": TimeStepping(1e-3, alpha=0.0)},
    "loads, and a start in motion": {
        "gravity": (0.0, -9.81),
        "initial_velocity": (0.0, -1e-3),
        "tractions": {"left": Traction((0.0, 30.0), Ramp((0.0, 0.1), (0.0, 1.0)))},
    },
    "two counterfaces": {
        "supports": {"left": ("x", "y")},
        "contacts": (Contact("bottom", _PLATE, Coulomb(0.4)), Contact("top", Plane((0.0, -1.0)), Coulomb(0.2))),
    },
    "force on the plate": {
        "contacts": (Contact("bottom", _PLATE, Coulomb(0.4), drive=Drive(force=0.1, mass=0.05)),),
        "programme": (Hold(20e-3), Slide(0.4e-3, 5e-3, (1.0, 0.0))),
    },
    "free rigid body": {
        "contacts": (Contact("bottom", _PLATE, Coulomb(0.4), rigid_body="table"),),
        "bodies": {"table": _SPRUNG},
        "programme": (),
        "time": TimeStepping(_STEP, end=0.2),
    },
}
_COMPARED = (
    *("displacement", "contact_displacement", "contact_velocity", "contact_acceleration", "stress", "support_force"),
    *("normal_traction", "tangential_traction", "slip_distance", "counterface_displacement", "counterface_force"),
    *("rigid_body_displacement", "kinetic_energy", "strain_energy", "contact_energy", "friction_dissipation"),
    *("damping_dissipation", "numerical_dissipation", "external_work"),
)


def block(changes: Mapping[str, Any]) -> Model:
    """Return a block that is pressed, slid to and fro until all of it slips, and let go, in a basis of all modes."""
    values: dict[str, Any] = {
        "mesh": box("Q4", np.linspace(0.0, 8e-3, 11), np.linspace(0.0, 4e-3, 5)),
        "materials": {"bulk": Elastic(50e3, 0.45, 1000.0)},
        "formulation": "plane_strain",
        "depth": 0.01,
        "supports": {"top": ("x", "y")},
        "contacts": (Contact("bottom", _PLATE, Coulomb(0.4)),),
        "programme": (
            Press(0.3e-3, 5e-3),
            *(Slide(0.4e-3, 5e-3, (along, 0.0)) for along in (1.0, -1.0)),
            Lift(0.1e-3, 5e-3),
        ),
        "time": TimeStepping(_STEP),
        "record": Recording((Site("inside", "probe", (4e-3, 1e-3)),)),
        "basis": ReducedBasis(1e-12, 1e-10),
    }
    return Model(**{**values, **changes})


def _beside_the_mesh(changes: Mapping[str, Any]) -> Iterator[Check]:
    model = block(changes)
    reduced, full = solve_problem(model), solve_problem(replace(model, basis=None))
    if reduced.attrs["basis"] != "reduced":
        raise VerificationError("the motion was not computed in a reduced basis")
    largest = {name: np.abs(full[name].values).max(initial=0.0) for name in _COMPARED}
    errors = [np.abs(reduced[name] - full[name]).max() / size for name, size in largest.items() if size]
    yield absolute("largest difference of any variable / largest", 0.0, float(max(errors)), 1e-9)
    balance = np.abs(reduced["energy_imbalance"]).max() / largest["external_work"]
    yield absolute("imbalance of energy / work", 0.0, float(balance), 1e-12)
    wrong = (full["contact_state"].values != reduced["contact_state"].values).sum()
    yield absolute("nodes in another state", 0.0, float(wrong), 0.0)


PROBLEMS = (
    Problem(
        "compiled-basis",
        "A block in a reduced basis of all modes",
        "the same on the mesh",
        _beside_the_mesh,
        {name: (changes,) for name, changes in ABILITIES.items()},
    ),
)
