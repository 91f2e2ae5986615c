"""The condensed solver against an independent one that keeps every degree of freedom.

The reference is :mod:`problems.verification.reference`: Newton's method on all displacements with dense matrices.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.dynamics.recording.steps import step_times
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.system import System
from fingerslip.fe.integration import Integration
from fingerslip.linear.resources import allowed_threads, limited_threads, suitable_threads
from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.model.model import Contact, Model
from fingerslip.model.programme import Press, Slide
from fingerslip.model.timing import TimeStepping
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, absolute
from problems.verification.reference import condensed_states, full_motions, full_system, make_stepper

__all__ = ["PROBLEMS"]

Array = NDArray[np.float64]

_STEP, _ALPHA, _PENALTY, _MU = 2e-3, -0.05, 1e8, 0.4
# 7 % of critical damping in the block's first shear mode, at about 1300 rad/s.
_DAMPING = RayleighDamping(mass=2.0, stiffness=1e-4)
_FIELDS = ("displacement", "velocity", "acceleration", "forces")


def _model(element: str, integration: Integration) -> Model:
    """Return a soft block whose edges lift and slip first, pressed and dragged into overall slip."""
    quadratic, plane = element in {"T6", "T10"}, element in {"Q4", "T3", "T6"}
    counts = ((9, 4) if plane else (5, 3, 3)) if not quadratic else ((5, 3) if plane else (4, 2, 2))
    sides = (10e-3, 4e-3) if plane else (10e-3, 6e-3, 4e-3)
    contact = Contact(
        boundary="bottom",
        counterface=Plane((0.0, 1.0) if plane else (0.0, 0.0, 1.0)),
        friction=Coulomb(_MU),
        normal_penalty=_PENALTY,
        tangential_penalty=_PENALTY,
        search_distance=1.0,
    )
    return Model(
        mesh=box(element, *(np.linspace(0.0, side, count) for side, count in zip(sides, counts, strict=True))),
        materials={"bulk": Elastic(34e3, 0.45, 1000.0)},
        formulation="plane_strain" if plane else "solid",
        supports={"top": ("x", "y") if plane else ("x", "y", "z")},
        contacts=(contact,),
        programme=(Press(0.3e-3, 3e-3), Slide(4e-3, 20e-3)),
        time=TimeStepping(_STEP, _ALPHA),
        damping=_DAMPING,
        integration=integration,
    )


def _everywhere(states: list[State], name: str, system: System) -> Array:
    """Return a field on all degrees of freedom at every time, zero where they are held, shape (n_times, n_dofs)."""
    field = np.zeros((len(states), system.space.n_dofs))
    field[:, system.free] = [getattr(state, name) for state in states]
    return field


def _difference(found: Array, expected: Array) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def _checks(element: str, integration: Integration) -> list[Check]:
    """Compare one element over a whole press and slide, at every node and every step."""
    model = _model(element, integration)
    stepper, times, full = make_stepper(model), step_times(model), full_system(model)
    system = stepper.system
    with limited_threads(suitable_threads(len(full.mass), allowed_threads(), system.space.dim)):
        states = list(condensed_states(stepper, model))
        motions = full_motions(full, system.motions[0].displacement(times), times)
    found = {name: _everywhere(states, name, system) for name in _FIELDS[:3]}
    found["forces"] = np.stack([state.contact_forces for state in states])
    own = {name: np.stack([getattr(motion, name) for motion in motions]) for name in _FIELDS}
    own["forces"] = own["forces"][:, np.searchsorted(full.nodes, system.candidates.nodes)]
    label = f"{element} nodal" if integration == "nodal" else element
    seen = {number for state in states for number in state.interface.state.tolist()}
    return [
        *(
            absolute(f"{label}: {name}, largest difference / largest", 0.0, _difference(found[name], own[name]), 1e-9)
            for name in _FIELDS
        ),
        absolute(f"{label}: states that never occur", 0.0, len({OPEN, STICK, SLIP} - seen), 0.0),
    ]


def _compare(*elements: tuple[str, Integration]) -> Callable[[], tuple[Check, ...]]:
    return lambda: tuple(check for element in elements for check in _checks(*element))


_TITLE, _SOURCE = "Condensed solver against the full system", "Newton's method"
PROBLEMS = (
    Problem(
        "condensed-2d",
        f"{_TITLE}, in 2D",
        _SOURCE,
        slow=False,
        compute=_compare(("Q4", "selective"), ("T3", "selective"), ("T6", "selective"), ("T3", "nodal")),
    ),
    Problem(
        "condensed-3d",
        f"{_TITLE}, in 3D",
        _SOURCE,
        slow=True,
        compute=_compare(("H8", "selective"), ("T4", "selective"), ("T10", "selective"), ("T4", "nodal")),
    ),
)
