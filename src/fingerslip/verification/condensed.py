"""The condensed solver against an independent one that keeps every degree of freedom.

The reference is Newton's method on all displacements with dense matrices. Its contact law is the penalty law with
return mapping in the displacements, not the complementarity problem in the forces that the condensed solver solves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.dynamics.simulation import step_times
from fingerslip.dynamics.step import State, advance, first_state
from fingerslip.dynamics.stepper import Stopwatch, build_steppers
from fingerslip.dynamics.system import System, build_system
from fingerslip.errors import ConvergenceError
from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import mass_matrix, stiffness_matrix
from fingerslip.fe.integration import Integration
from fingerslip.fe.space import boundary_nodes, build_space, nodal_areas, vector_dofs
from fingerslip.linear.threads import suitable_threads
from fingerslip.materials.damping import RayleighDamping
from fingerslip.materials.elastic import Elastic
from fingerslip.model import Contact, Model, Press, Slide, TimeStepping
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, absolute

__all__ = ["PROBLEMS"]

Array = NDArray[np.float64]

_STEP, _ALPHA, _PENALTY, _MU = 2e-3, -0.05, 1e8, 0.4
_BETA, _GAMMA = (1 - _ALPHA) ** 2 / 4, 0.5 - _ALPHA
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


@dataclass(frozen=True)
class _Motion:
    """Displacement, velocity and acceleration of all degrees of freedom, and the contact forces (n_c, dim)."""

    displacement: Array
    velocity: Array
    acceleration: Array
    forces: Array


class _Full:
    """The reference: HHT-alpha with all degrees of freedom."""

    def __init__(self, model: Model) -> None:
        space = build_space(model.mesh)
        materials = cell_materials(space, model.materials, model.formulation)
        self.stiffness = stiffness_matrix(space, materials, 1.0, model.integration).toarray()
        self.mass = mass_matrix(space, materials, 1.0).toarray()
        self.damping = _DAMPING.mass * self.mass + _DAMPING.stiffness * self.stiffness
        self.dim, self.size = space.dim, space.n_dofs
        held = vector_dofs(boundary_nodes(space, "top"), self.dim).ravel()
        self.free = np.setdiff1d(np.arange(self.size), held)
        self.nodes = boundary_nodes(space, "bottom")
        self.dofs = vector_dofs(self.nodes, self.dim)
        self.springs = _PENALTY * nodal_areas(space, "bottom", 1.0)[self.nodes]
        weighted = _GAMMA * _STEP * self.damping + _BETA * _STEP**2 * self.stiffness
        self.tangent = self.mass + (1 + _ALPHA) * weighted

    def contact(self, displacement: Array, before: _Motion, plates: tuple[Array, Array]) -> tuple[Array, Array]:
        """Return the contact forces (n_c, dim) and their derivatives by the nodes' displacements (n_c, dim, dim)."""
        forces, slopes = np.zeros(self.dofs.shape), np.zeros((*self.dofs.shape, self.dim))
        for i, (dofs, spring) in enumerate(zip(self.dofs, self.springs, strict=True)):
            normal = -spring * (displacement[dofs[-1]] - plates[1][-1])
            if normal <= 0.0:
                continue
            moved = displacement[dofs] - before.displacement[dofs] - (plates[1] - plates[0])
            trial = before.forces[i, :-1] - spring * moved[:-1]
            length, slope = float(np.linalg.norm(trial)), slopes[i]
            slope[-1, -1] = -spring
            if length <= _MU * normal:
                forces[i, :-1], slope[:-1, :-1] = trial, -spring * np.eye(self.dim - 1)
            else:
                way = trial / length
                forces[i, :-1], slope[:-1, -1] = _MU * normal * way, -_MU * spring * way
                across = np.eye(self.dim - 1) - np.outer(way, way)
                slope[:-1, :-1] = -spring * _MU * normal / length * across
            forces[i, -1] = normal
        return forces, slopes

    def unbalance(self, displacement: Array, velocity: Array, forces: Array) -> Array:
        """Return C v + K u less the contact forces on all degrees of freedom."""
        total: Array = self.damping @ velocity + self.stiffness @ displacement
        total[self.dofs.ravel()] -= forces.ravel()
        return total

    def residual(self, acceleration: Array, before: _Motion, plates: tuple[Array, Array]) -> tuple[Array, Array]:
        """Return the residual of a step on the free degrees of freedom, and its derivative by the acceleration."""
        displacement, velocity = self.place(acceleration, before)
        forces, slopes = self.contact(displacement, before, plates)
        old = self.unbalance(before.displacement, before.velocity, before.forces)
        new = self.unbalance(displacement, velocity, forces)
        residual = self.mass @ acceleration + (1 + _ALPHA) * new - _ALPHA * old
        tangent = self.tangent.copy()
        for dofs, slope in zip(self.dofs, slopes, strict=True):
            tangent[np.ix_(dofs, dofs)] -= (1 + _ALPHA) * _BETA * _STEP**2 * slope
        return residual[self.free], tangent[np.ix_(self.free, self.free)]

    def place(self, acceleration: Array, before: _Motion) -> tuple[Array, Array]:
        """Return displacement and velocity at the end of a step with some acceleration there."""
        mean = (0.5 - _BETA) * before.acceleration + _BETA * acceleration
        displacement = before.displacement + _STEP * before.velocity + _STEP**2 * mean
        velocity = before.velocity + _STEP * ((1 - _GAMMA) * before.acceleration + _GAMMA * acceleration)
        return displacement, velocity

    def step(self, before: _Motion, plates: tuple[Array, Array], time: float, scale: float) -> _Motion:
        """Take one step: Newton's method, with steps halved until they help; `scale` is the largest acceleration."""
        acceleration = before.acceleration.copy()
        residual, tangent = self.residual(acceleration, before, plates)
        change = np.full(self.free.size, np.inf)
        for _ in range(200):
            change = np.linalg.solve(tangent, residual)
            tiny = np.abs(change).max() <= 1e-11 * max(scale, np.abs(acceleration).max())
            for length in 0.5 ** np.arange(21):
                trial = acceleration.copy()
                trial[self.free] -= length * change
                new, tangent = self.residual(trial, before, plates)
                if tiny or np.linalg.norm(new) < np.linalg.norm(residual):
                    break
            acceleration, residual = trial, new
            if tiny:
                displacement, velocity = self.place(acceleration, before)
                return _Motion(displacement, velocity, acceleration, self.contact(displacement, before, plates)[0])
        raise ConvergenceError(time, -1, float(np.abs(change).max()), 1e-11, "the reference has to be repaired")

    def march(self, plates: Array, times: Array) -> list[_Motion]:
        """Return the motion at every time, under the plate's displacements (n_times, dim)."""
        none = np.zeros(self.size)
        motions, scale = [_Motion(none, none, none, np.zeros(self.dofs.shape))], 0.0
        for number in range(1, times.size):
            motions.append(self.step(motions[-1], (plates[number - 1], plates[number]), float(times[number]), scale))
            scale = max(scale, float(np.abs(motions[-1].acceleration).max()))
        return motions


def _march(model: Model, system: System, plates: Array, times: Array) -> list[State]:
    """Return the condensed solver's state at every time, under the plate's displacements (n_times, dim)."""
    stepper = build_steppers([system], model.time, model.damping)[0]
    states, watch = [first_state(stepper)], Stopwatch()
    for number in range(1, times.size):
        states += advance([stepper], states[-1:], float(times[number]), [plates[number : number + 1]], watch)
    return states


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
    system, times = build_system(model), step_times(model)
    plates = system.motions[0].displacement(times)
    full = _Full(model)
    with suitable_threads(full.size):
        states, motions = _march(model, system, plates, times), full.march(plates, times)
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
        absolute(f"{label}: states that never occur", 0.0, len({0, 1, 2} - seen), 0.0),
    ]


def _compare(*elements: tuple[str, Integration]) -> Callable[[], tuple[Check, ...]]:
    return lambda: tuple(check for element in elements for check in _checks(*element))


_TITLE, _SOURCE = "Condensed solver against the full system", "Newton's method"
PROBLEMS = (
    Problem(
        "condensed-2d",
        f"{_TITLE}, in the plane",
        _SOURCE,
        slow=False,
        compute=_compare(("Q4", "selective"), ("T3", "selective"), ("T6", "selective"), ("T3", "nodal")),
    ),
    Problem(
        "condensed-3d",
        f"{_TITLE}, in space",
        _SOURCE,
        slow=True,
        compute=_compare(("H8", "selective"), ("T4", "selective"), ("T10", "selective"), ("T4", "nodal")),
    ),
)
