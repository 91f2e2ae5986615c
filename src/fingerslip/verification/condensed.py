"""The condensed solver against an independent one that keeps every degree of freedom.

The reference is Newton's method on all displacements with dense matrices. Its contact law is the penalty law with
return mapping in the displacements, not the complementarity problem in the forces that the condensed solver solves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.bodies import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.dynamics.simulate import step_times
from fingerslip.dynamics.step import State, Stopwatch, advance, build_stepper, first_state
from fingerslip.dynamics.system import System, build_system
from fingerslip.errors import ConvergenceError
from fingerslip.fe.assembly import cell_constants, mass_matrix, stiffness_matrix
from fingerslip.fe.space import boundary_nodes, build_space, nodal_areas, vector_dofs
from fingerslip.materials import Elastic, RayleighDamping
from fingerslip.model import Contact, Model, Press, Slide, TimeStepping
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, absolute, solved

__all__ = ["PROBLEMS"]

Array = NDArray[np.float64]

_STEP, _ALPHA, _PENALTY, _MU = 2e-3, -0.05, 1e8, 0.4
_BETA, _GAMMA = (1 - _ALPHA) ** 2 / 4, 0.5 - _ALPHA
# Two and seven per cent of critical damping at the block's slowest shear vibration, 1.3e3 rad/s.
_DAMPING = RayleighDamping(mass=50.0, stiffness=1e-4)
Integration = Literal["selective", "nodal"]
_PLANE: tuple[tuple[str, Integration], ...] = (
    ("Q4", "selective"),
    ("T3", "selective"),
    ("T3", "nodal"),
    ("T6", "selective"),
)
_SPACE: tuple[tuple[str, Integration], ...] = (
    ("H8", "selective"),
    ("T4", "selective"),
    ("T4", "nodal"),
    ("T10", "selective"),
)


def _model(element: str, integration: Integration) -> Model:
    """Return a soft block whose edges lift and slip first, pressed and dragged into overall slip."""
    plane = (element, integration) in _PLANE
    length, width, height = np.linspace(0, 10e-3, 9), np.linspace(0, 6e-3, 3), np.linspace(0, 4e-3, 4)
    # Quadratic cells have nodes on their sides too.
    every = 2 if element in {"T6", "T10"} else 1
    axes = (length[::every], height[::every]) if plane else (length[:: 2 * every], width[::every], height[:3:every])
    contact = Contact(
        boundary="bottom",
        body=Plane((0.0, 1.0) if plane else (0.0, 0.0, 1.0)),
        friction=Coulomb(_MU),
        normal_penalty=_PENALTY,
        tangential_penalty=_PENALTY,
        reach=1.0,
    )
    return Model(
        mesh=box(element, *axes),
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
        constants = cell_constants(space, model.materials, model.formulation)
        self.stiffness = stiffness_matrix(space, constants, 1.0, model.integration).toarray()
        self.mass = mass_matrix(space, constants, 1.0).toarray()
        self.damping = _DAMPING.mass * self.mass + _DAMPING.stiffness * self.stiffness
        self.dim, self.size = space.dim, space.n_dofs
        held = vector_dofs(boundary_nodes(space, "top"), self.dim).ravel()
        self.free = np.setdiff1d(np.arange(self.size), held)
        areas = nodal_areas(space, "bottom", 1.0)
        # Corners of quadratic tetrahedra have no area.
        self.nodes = np.flatnonzero(areas > 1e-9 * areas.max())
        self.dofs = vector_dofs(self.nodes, self.dim)
        self.springs = _PENALTY * areas[self.nodes]

    def contact(self, displacement: Array, before: _Motion, plates: tuple[Array, Array]) -> tuple[Array, Array]:
        """Return the contact forces (n_c, dim) and their derivative by all displacements (size, size)."""
        forces, slopes = np.zeros(self.dofs.shape), np.zeros((self.size, self.size))
        for i, (dofs, spring) in enumerate(zip(self.dofs, self.springs, strict=True)):
            normal = -spring * (displacement[dofs[-1]] - plates[1][-1])
            if normal <= 0.0:
                continue
            moved = displacement[dofs] - before.displacement[dofs] - (plates[1] - plates[0])
            trial = before.forces[i, :-1] - spring * moved[:-1]
            length, slope = float(np.linalg.norm(trial)), np.zeros((self.dim, self.dim))
            slope[-1, -1] = -spring
            if length <= _MU * normal:
                forces[i, :-1], slope[:-1, :-1] = trial, -spring * np.eye(self.dim - 1)
            else:
                way = trial / length
                forces[i, :-1], slope[:-1, -1] = _MU * normal * way, -_MU * spring * way
                across = np.eye(self.dim - 1) - np.outer(way, way)
                slope[:-1, :-1] = -spring * _MU * normal / length * across
            forces[i, -1] = normal
            slopes[np.ix_(dofs, dofs)] = slope
        return forces, slopes

    def spread(self, forces: Array) -> Array:
        """Return contact forces on all degrees of freedom."""
        total = np.zeros(self.size)
        total[self.dofs.ravel()] = forces.ravel()
        return total

    def residual(self, acceleration: Array, before: _Motion, plates: tuple[Array, Array]) -> tuple[Array, Array]:
        """Return the residual of a step on the free degrees of freedom, and its derivative by the acceleration."""
        forces, slopes = self.contact(self.place(acceleration, before), before, plates)
        old = self.inner(before.displacement, before.velocity) - self.spread(before.forces)
        new = self.inner(self.place(acceleration, before), self.speed(acceleration, before)) - self.spread(forces)
        residual = self.mass @ acceleration + (1 + _ALPHA) * new - _ALPHA * old
        slope = _BETA * _STEP**2 * (self.stiffness - slopes) + _GAMMA * _STEP * self.damping
        tangent = self.mass + (1 + _ALPHA) * slope
        return residual[self.free], tangent[np.ix_(self.free, self.free)]

    def inner(self, displacement: Array, velocity: Array) -> Array:
        """Return the forces of stiffness and damping."""
        forces: Array = self.stiffness @ displacement + self.damping @ velocity
        return forces

    def place(self, acceleration: Array, before: _Motion) -> Array:
        """Return the displacement at the end of a step with some acceleration there."""
        mean = (0.5 - _BETA) * before.acceleration + _BETA * acceleration
        displacement: Array = before.displacement + _STEP * before.velocity + _STEP**2 * mean
        return displacement

    def speed(self, acceleration: Array, before: _Motion) -> Array:
        """Return the velocity at the end of a step with some acceleration there."""
        velocity: Array = before.velocity + _STEP * ((1 - _GAMMA) * before.acceleration + _GAMMA * acceleration)
        return velocity

    def step(self, before: _Motion, plates: tuple[Array, Array], time: float) -> _Motion:
        """Take one step: Newton's method, with steps halved until they help."""
        acceleration = before.acceleration.copy()
        residual, tangent = self.residual(acceleration, before, plates)
        change = np.full(self.free.size, np.inf)
        for _ in range(200):
            change = np.linalg.solve(tangent, residual)
            # Near steady sliding accelerations vanish; they are known to the rounding of displacements, no better.
            rounding = 1e-14 * np.abs(before.displacement).max() / (_BETA * _STEP**2)
            tiny = np.abs(change).max() <= max(1e-11 * np.abs(acceleration).max(), rounding)
            for length in 0.5 ** np.arange(21):
                trial = acceleration.copy()
                trial[self.free] -= length * change
                new, tangent = self.residual(trial, before, plates)
                if tiny or np.linalg.norm(new) < np.linalg.norm(residual):
                    break
            acceleration, residual = trial, new
            if tiny:
                return self.after(acceleration, before, plates)
        raise ConvergenceError(time, -1, float(np.abs(change).max()), 1e-11, "the reference has to be mended")

    def after(self, acceleration: Array, before: _Motion, plates: tuple[Array, Array]) -> _Motion:
        """Return the motion at the end of a step from the acceleration there."""
        displacement = self.place(acceleration, before)
        forces, _ = self.contact(displacement, before, plates)
        return _Motion(displacement, self.speed(acceleration, before), acceleration, forces)

    def march(self, times: Array, plates: Array) -> list[_Motion]:
        """Return the motion at all times, under the plate's displacement (n_times, dim) at them."""
        none = np.zeros(self.size)
        motions = [_Motion(none, none, none, np.zeros(self.dofs.shape))]
        for number in range(1, times.size):
            plate = (plates[number - 1], plates[number])
            motions.append(self.step(motions[-1], plate, float(times[number])))
        return motions


def _condensed_march(model: Model, system: System, times: Array, plates: Array) -> Iterator[State]:
    """Yield the states that the simulation goes through, with all their degrees of freedom."""
    stepper, watch = build_stepper(system, model.time, model.damping), Stopwatch()
    state = first_state(stepper)
    yield state
    for number in range(1, times.size):
        state = advance(stepper, state, float(times[number]), plates[number : number + 1], watch)
        yield state


def _difference(found: Array, expected: Array) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def _compare(element: str, integration: Integration) -> tuple[Check, ...]:
    model = _model(element, integration)
    system, times, full = build_system(model), step_times(model), _Full(model)
    plates = system.motions[0].displacement(times)
    expected = full.march(times, plates)
    found = list(_condensed_march(model, system, times, plates))
    name = f"{element} nodal" if integration == "nodal" else element
    checks = []
    for field in ("displacement", "velocity", "acceleration"):
        own = np.stack([getattr(motion, field) for motion in expected])[:, full.free]
        checks.append(_check(name, field, np.stack([getattr(state, field) for state in found]), own))
    # The forces are those of the simulation itself, whose states the march repeats with all degrees of freedom.
    history = solved(model)
    own = np.stack([motion.forces[:, -1] for motion in expected])
    checks.append(_check(name, "pressure", (history["normal_traction"] * history["contact_area"]).values, own))
    states = set(history["contact_state"].values.ravel().tolist())
    return (*checks, absolute(f"{name}: states that never occur", 0.0, len({0, 1, 2} - states), 0.0))


def _check(name: str, field: str, found: Array, expected: Array) -> Check:
    return absolute(f"{name}: {field}, largest difference / largest", 0.0, _difference(found, expected), _ALLOWED)


# Rounding, which 1 / (beta h^2) amplifies in accelerations.
_ALLOWED = 1e-9


def _in_the_plane() -> tuple[Check, ...]:
    """Compare over a whole press and slide, at every step and in every degree of freedom."""
    return sum((_compare(*kind) for kind in _PLANE), ())


def _in_space() -> tuple[Check, ...]:
    return sum((_compare(*kind) for kind in _SPACE), ())


PROBLEMS = (
    Problem("condensed", "Condensed solver against the full system", "Newton's method", False, _in_the_plane),
    Problem("condensed-3d", "The same in space", "Newton's method", False, _in_space),
)
