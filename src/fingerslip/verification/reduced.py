"""A reduced basis of all modes beside the mesh: each ability of the compiled steps by itself; rounding is left."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb, SlipWeakening, StaticKinetic
from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.model.model import Contact, Drive, Model, Recording, ReducedBasis, SupportMotion, Traction
from fingerslip.model.programme import Hold, Lift, Press, Ramp, Slide
from fingerslip.model.rigid_bodies import BodyLoad, Dampers, RigidBody, Springs
from fingerslip.model.timing import QuasiStatic, TimeStepping
from fingerslip.sites import Site
from fingerslip.verification.blocks import block_on_plate
from fingerslip.verification.problem import Check, Problem, VerificationError, absolute, solve_problem

_STEP, _ON_PLATE = 2e-3, Contact("bottom", Plane((0.0, 1.0)), Coulomb(0.4))
_SPRUNG = RigidBody(1e-3, free=("y",), springs=Springs(y=5.0), loads=(BodyLoad(y=0.02),))
#: What a model has in place of the block's own, by the ability that it shows.
ABILITIES: Mapping[str, Mapping[str, Any]] = {
    "one counterface": {},
    "static and kinetic friction": {"contacts": (replace(_ON_PLATE, friction=StaticKinetic(0.5, 0.3, 2e-3)),)},
    "weakening friction": {"contacts": (replace(_ON_PLATE, friction=SlipWeakening(0.6, 0.3, 50e-6)),)},
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
        "contacts": (_ON_PLATE, Contact("top", Plane((0.0, -1.0)), Coulomb(0.2))),
    },
    "force on the plate": {
        "contacts": (replace(_ON_PLATE, drive=Drive(force=0.1, mass=0.05)),),
        "programme": (Hold(20e-3), Slide(0.4e-3, 5e-3, (1.0, 0.0))),
    },
    "free rigid body": {
        "contacts": (replace(_ON_PLATE, rigid_body="table"),),
        "bodies": {"table": _SPRUNG},
        "programme": (),
        "time": TimeStepping(_STEP, end=0.2),
    },
    "moving supports": {
        "support_motions": {"top": SupportMotion((0.4e-3, -0.2e-3), Ramp((0.0, 0.04, 0.1), (0.0, 1.0, 0.2)))},
        "damping": RayleighDamping(mass=5.0, stiffness=1e-3),
        "initial_velocity": (0.0, -1e-3),
        "gravity": (0.0, -9.81),
    },
    "moving supports without inertia": {
        "support_motions": {"top": SupportMotion((0.4e-3, -0.2e-3), Ramp((0.0, 0.04, 0.1), (0.0, 1.0, 0.2)))},
        "time": QuasiStatic(_STEP),
    },
    "rigid body with a damper": {
        "contacts": (replace(_ON_PLATE, rigid_body="table"),),
        "bodies": {"table": replace(_SPRUNG, dampers=Dampers(y=0.5))},
        "damping": RayleighDamping(mass=5.0, stiffness=1e-3),
        "programme": (),
        "time": TimeStepping(_STEP, end=0.2),
    },
}
# Rounding itself, and a ratio of forces that may be no more.
_NOT_COMPARED = ("energy_imbalance", "contact_residual", "friction_utilisation")


def block(changes: Mapping[str, Any]) -> Model:
    """Return a block that is pressed, slid to and fro until all of it slips, and let go, in a basis of all modes."""
    forth, back = (Slide(0.4e-3, 5e-3, (along, 0.0)) for along in (1.0, -1.0))
    model = block_on_plate(
        *("Q4", np.linspace(0.0, 8e-3, 11), np.linspace(0.0, 4e-3, 5)),
        material=Elastic(50e3, 0.45, 1000.0),
        plate={"friction": Coulomb(0.4)},
        supports={"top": ("x", "y")},
        depth=0.01,
        programme=(Press(0.3e-3, 5e-3), forth, back, Lift(0.1e-3, 5e-3)),
        time=TimeStepping(_STEP),
        record=Recording((Site("inside", "probe", (4e-3, 1e-3)),)),
        basis=ReducedBasis(1e-12, 1e-10),
    )
    return replace(model, **changes)


def _beside_the_mesh(changes: Mapping[str, Any]) -> Iterator[Check]:
    model = block(changes)
    reduced, full = solve_problem(model), solve_problem(replace(model, basis=None))
    if reduced.attrs["basis"] != "reduced":
        raise VerificationError("the motion was not computed in a reduced basis")
    compared = {name: item for name, item in full.drop_vars(_NOT_COMPARED).items() if item.dtype.kind == "f"}
    errors = [abs(reduced[name] - item).max() / abs(item).max() for name, item in compared.items() if item.any()]
    balance = abs(reduced["energy_imbalance"]).max() / abs(full["external_work"]).max()
    wrong = (full["contact_state"].values != reduced["contact_state"].values).sum()
    yield absolute("largest difference of any variable / largest", 0.0, float(max(errors)), 1e-9)
    yield absolute("imbalance of energy / work", 0.0, float(balance), 1e-12)
    yield absolute("nodes in another state", 0.0, float(wrong), 0.0)


_CASES = {name: (changes,) for name, changes in ABILITIES.items()}
_TITLE, _SOURCE = "A block in a reduced basis of all modes", "the same on the mesh"
PROBLEMS = (Problem("compiled-basis", _TITLE, _SOURCE, _beside_the_mesh, _CASES),)
