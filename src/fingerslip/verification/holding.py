"""An object held by friction: between rigid pads that squeeze too late, and at rest for a long time.

Stiff pads, 1 GPa, stand for rigid ones: they shear by less than a thousandth of a millimetre. Load and grip are sampled
at the ends of steps of 0.5 ms, so a force that begins inside a step is wrong by a part of it: at a latency of 20 ms
that is within the 1 % that are allowed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fingerslip.dynamics.simulation import simulate
from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.materials.prony import Prony, PronyTerm
from fingerslip.model.model import Contact, Model, ReducedBasis
from fingerslip.model.timing import QuasiStatic, TimeStepping
from fingerslip.react.detectors import AtOnce
from fingerslip.react.loads import BuiltInLoad, RampLoad, StepLoad
from fingerslip.react.loop import Grasp
from fingerslip.react.reflex import Actuator, Reaction, Reflex
from fingerslip.react.scenario import HeldObject, held_model, travel_after
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, absolute, relative

_MASS, _FRICTION, _LIMIT_RATE, _MARGIN = 0.2, 0.5, 20.0, 0.25
_LATENCIES = (74e-3, 20e-3)
_STEP, _EXCESS, _LOAD_RATE = 0.5e-3, 0.5, 4.0


def _pads(modulus: float, prony: Prony = ()) -> Model:
    """Return a square pad of 10 mm of a modulus [Pa]."""
    return Model(
        mesh=box("Q4", np.linspace(-5e-3, 5e-3, 7), np.linspace(0.0, 4e-3, 4)),
        materials={"bulk": Elastic(modulus, 0.45, 1000.0, prony=prony)},
        supports={"top": ("x", "y")},
        formulation="plane_strain",
        contacts=(Contact("bottom", search_distance=4e-3),),
        depth=10e-3,
        damping=RayleighDamping(stiffness=2e-3),
        basis=ReducedBasis(acceleration_tolerance=0.1),
        time=TimeStepping(step=1e-3, end=1.0),
    )


def _travels(load: BuiltInLoad, since: float) -> list[float]:
    """Return the travels [m] where the grip rises some latencies after a time since the load began [s]."""
    held = HeldObject(
        load=load, mass=_MASS, friction=_FRICTION, margin=_MARGIN, travel_limit=0.1, settle=0.1, rest=0.02, step=_STEP
    )
    reaction = Reaction(Reflex(gain=10.0), Actuator(force_rate=_LIMIT_RATE / (2.0 * _FRICTION), largest_force=1e3))
    with Grasp(held, _pads(1e9), {"at once": AtOnce()}) as grasp:
        return [grasp.branch(reaction.response(since + latency, held.first_grip)).travel for latency in _LATENCIES]


def _rigid_pads() -> Iterator[Check]:
    """Press, load by a step and by a ramp, and squeeze after a latency."""
    margin = _MARGIN * _MASS * 9.81
    # The step takes one step of the solver: it acts from the middle of that on.
    middle = _STEP * (1.0 - 0.5 * _EXCESS / (margin + _EXCESS))
    ramp = RampLoad(rate=_LOAD_RATE, force=margin + 4.0)
    cases: tuple[tuple[str, BuiltInLoad, float, float, float], ...] = (
        ("step of 0.5 N", StepLoad(force=margin + _EXCESS, rise=_STEP), middle, _EXCESS, 0.0),
        ("ramp of 4 N/s", ramp, margin / _LOAD_RATE, 0.0, _LOAD_RATE),
    )
    for name, load, since, excess, rate in cases:
        for latency, travel in zip(_LATENCIES, _travels(load, since), strict=True):
            expected = travel_after(_MASS, latency, _LIMIT_RATE, excess=excess, load_rate=rate)
            yield relative(f"{name}, {1e3 * latency:.0f} ms: travel [mm]", 1e3 * expected, 1e3 * travel, 0.01)


_HOLD, _RELAXING = 1000.0, 800  # [s]; steps after which nothing is left of a relaxation in 20 s


def _no_creep() -> Iterator[Check]:
    """Grasp an object at nine tenths of what friction bears, between soft pads."""
    held = HeldObject(
        load=StepLoad(force=0.0, rise=1.0),
        friction=_FRICTION,
        margin=1.0 / 0.9 - 1.0,
        settle=100.0,
        rest=100.0,
        after=_HOLD,
        step=1.0,
    )
    # Without inertia there is no vibration left to tell from creep.
    time = QuasiStatic(held.step, end=held.begins + held.duration)
    begins = round(held.begins / held.step)
    # Pads that relax give way until they have relaxed.
    for name, prony, first in (("elastic", (), begins), ("relaxed", (PronyTerm(0.5, 20.0),), begins + _RELAXING)):
        history = simulate(replace(held_model(held, _pads(100e3, prony)), time=time))
        position = history["rigid_body_displacement"].sel(component="x").values[:, 0]
        speed = 1e6 * (position[-1] - position[first]) / (held.step * (len(position) - 1 - first))
        yield absolute(f"{name} pads: creep [um/s]", 0.0, float(speed), 1e-9)
        used = float(history["friction_utilisation"].values[-1, 0])
        yield relative(f"{name} pads: share of the friction that is used", 0.9, used, 1e-9)


PROBLEMS = (
    Problem("rigid-pads", "Object that slides until the grip stops it", "equation of motion", _rigid_pads),
    Problem("no-creep", "Object held at 0.9 of the slip limit for 1,000 s", "Coulomb's law", _no_creep),
)
