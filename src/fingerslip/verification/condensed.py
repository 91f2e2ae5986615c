"""The condensed solver against an independent one that keeps every degree of freedom.

The reference is Newton's method on all displacements with dense matrices. Its contact law is the penalty law with
return mapping in the displacements, not the complementarity problem in the forces that the condensed solver solves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.contact.bodies import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.errors import ConvergenceError
from fingerslip.fe.assembly import cell_constants, mass_matrix, stiffness_matrix
from fingerslip.fe.space import boundary_nodes, build_space, nodal_areas, vector_dofs
from fingerslip.materials import Elastic
from fingerslip.model import Contact, Model, Press, Recording, Slide, TimeStepping
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, absolute, solved

__all__ = ["PROBLEMS"]

Array = NDArray[np.float64]

_STEP, _ALPHA, _PENALTY, _MU = 2e-3, -0.05, 1e8, 0.4
_BETA, _GAMMA = (1 - _ALPHA) ** 2 / 4, 0.5 - _ALPHA


def _model(element: str) -> Model:
    """Return a soft block whose edges lift and slip first, pressed and dragged into overall slip."""
    plane = element == "Q4"
    length, width, height = np.linspace(0, 10e-3, 9), np.linspace(0, 6e-3, 3), np.linspace(0, 4e-3, 4)
    axes = (length, height) if plane else (length[::2], width, height[:3])
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
        record=Recording(snapshots_every=_STEP),
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
        self.stiffness = stiffness_matrix(space, constants, 1.0, "selective").toarray()
        self.mass = mass_matrix(space, constants, 1.0).toarray()
        self.dim, self.size = space.dim, space.n_dofs
        held = vector_dofs(boundary_nodes(space, "top"), self.dim).ravel()
        self.free = np.setdiff1d(np.arange(self.size), held)
        nodes = boundary_nodes(space, "bottom")
        self.dofs = vector_dofs(nodes, self.dim)
        self.springs = _PENALTY * nodal_areas(space, "bottom", 1.0)[nodes]

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
        old = self.stiffness @ before.displacement - self.spread(before.forces)
        new = self.stiffness @ self.place(acceleration, before) - self.spread(forces)
        residual = self.mass @ acceleration + (1 + _ALPHA) * new - _ALPHA * old
        tangent = self.mass + (1 + _ALPHA) * _BETA * _STEP**2 * (self.stiffness - slopes)
        return residual[self.free], tangent[np.ix_(self.free, self.free)]

    def place(self, acceleration: Array, before: _Motion) -> Array:
        """Return the displacement at the end of a step with some acceleration there."""
        mean = (0.5 - _BETA) * before.acceleration + _BETA * acceleration
        displacement: Array = before.displacement + _STEP * before.velocity + _STEP**2 * mean
        return displacement

    def step(self, before: _Motion, plates: tuple[Array, Array], time: float) -> _Motion:
        """Take one step: Newton's method, with steps halved until they help."""
        acceleration = before.acceleration.copy()
        residual, tangent = self.residual(acceleration, before, plates)
        change = np.full(self.free.size, np.inf)
        for _ in range(200):
            change = np.linalg.solve(tangent, residual)
            tiny = np.abs(change).max() <= 1e-11 * np.abs(acceleration).max()
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
        velocity = before.velocity + _STEP * ((1 - _GAMMA) * before.acceleration + _GAMMA * acceleration)
        return _Motion(displacement, velocity, acceleration, self.contact(displacement, before, plates)[0])

    def march(self, history: xr.Dataset) -> list[_Motion]:
        """Return the motion at every time of a history, under the plate's motion in it."""
        plates, times = history["body_displacement"].values[:, 0], history["time"].values
        none = np.zeros(self.size)
        motions = [_Motion(none, none, none, np.zeros(self.dofs.shape))]
        for number in range(1, times.size):
            plate = (plates[number - 1], plates[number])
            motions.append(self.step(motions[-1], plate, float(times[number])))
        return motions


def _difference(found: Array, expected: Array) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def _condensed() -> tuple[Check, ...]:
    """Compare over a whole press and slide.

    In the plane both are exact, and 1e-9 is rounding, which 1 / (beta h^2) amplifies in accelerations. In space the
    direction of slip makes the law curved, and the condensed solver may stop at 1e-10 of the largest contact force:
    1e-7, as light nodes answer with a thousandfold of that.
    """
    checks: list[Check] = []
    for element, allowed in (("Q4", 1e-9), ("H8", 1e-7)):
        model = _model(element)
        history = solved(model)
        full = _Full(model)
        motions = full.march(history)
        order = np.searchsorted(full.dofs[:, 0] // full.dim, history["contact_node"].values)
        fields: dict[str, tuple[Any, Array]] = {
            "displacement": (history["snapshot_displacement"], _stack(motions, "displacement", full)),
            "velocity": (history["snapshot_velocity"], _stack(motions, "velocity", full)),
            "acceleration": (
                history["contact_acceleration"],
                _stack(motions, "acceleration", full)[:, history["contact_node"].values],
            ),
            "pressure": (
                history["normal_traction"] * history["contact_area"],
                np.stack([motion.forces[order, -1] for motion in motions]),
            ),
        }
        checks += [
            absolute(f"{element}: {name}, largest difference / largest", 0.0, _difference(found.values, own), allowed)
            for name, (found, own) in fields.items()
        ]
        missing = {0, 1, 2} - set(history["contact_state"].values.ravel().tolist())
        checks.append(absolute(f"{element}: states that never occur", 0.0, len(missing), 0.0))
    return tuple(checks)


def _stack(motions: list[_Motion], name: str, full: _Full) -> Array:
    return np.stack([getattr(motion, name).reshape(-1, full.dim) for motion in motions])


PROBLEMS = (Problem("condensed", "Condensed solver against the full system", "Newton's method", False, _condensed),)
