"""How far a motion in a reduced basis is from one on the mesh: what the residual of the full equations excites.

With contact forces as they are, the error e of a reduced motion obeys the equations of the scheme under minus their
residual ::

    rho = M a_1 + w_1 (C v_1 + K u_1 - f_1) - w_0 (C v_0 + K u_0 - f_0)

which is orthogonal to the basis. The shapes W that would come next into the basis see the most of it: they are
marched beside the motion, each an oscillator under -W^T rho, and their inertia and stiffness excite the coordinates of
the basis in turn. Both are diagonal, so that a step of the error costs a fraction of one of the motion, and what little
numerical damping adds up over many steps is added up here, too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.dynamics.reduced.reduction import ReducedCoordinates
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.loads import Load
from fingerslip.dynamics.system.scheme import Scheme, make_scheme
from fingerslip.dynamics.system.system import System
from fingerslip.fe.space import vector_dofs
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.model.model import Model

__all__ = ["ResidualCheck"]

Array = NDArray[np.float64]

# Steps that are looked at together.
_AT_ONCE = 32
# Errors over what the shapes that follow show of them: 1.2 in the middle of 83 random models, below 2.1 in nine of ten.
_BEYOND = 1.5


class ResidualCheck:
    """Estimates the errors of reduced motions, step by step."""

    def __init__(
        self, models: Sequence[Model], systems: Sequence[System], coordinates: Sequence[ReducedCoordinates]
    ) -> None:
        scheme, damping = make_scheme(models[0].time), models[0].damping
        pairs = zip(systems, coordinates, strict=True)
        self._errors = [_MotionError(system, reduced, scheme, damping) for system, reduced in pairs]

    @property
    def error(self) -> float:
        """The largest error of displacements at contact and sites over the largest of these displacements [-]."""
        return _BEYOND * max(motion.error for motion in self._errors)

    @property
    def acceleration_error(self) -> float:
        """The error of accelerations over these, at the contact or at sites, as roots of mean squares [-]."""
        return _BEYOND * max(motion.acceleration_error for motion in self._errors)

    def __call__(self, moving: Sequence[int], before: Sequence[State], after: Sequence[State]) -> None:
        """Follow a step of the motions `moving`, from their states before and after."""
        for number in moving:
            self._errors[number].step(before[number], after[number])

    def finish(self) -> None:
        """Look at the steps that wait."""
        for motion in self._errors:
            motion.finish()


class _Oscillators:
    """Oscillators of mass one in a scheme, from rest: squares (m,) of their frequencies [1/s^2]."""

    def __init__(self, squares: Array, scheme: Scheme, damping: RayleighDamping) -> None:
        self._squares, self._scheme = squares, scheme
        self._viscous = damping.mass + damping.stiffness * squares
        resistance = scheme.displacement_factor * squares + scheme.velocity_factor * self._viscous
        self._compliance = 1.0 / (scheme.inertia_factor + scheme.end_weight * resistance)
        self.displacement, self.velocity, self.acceleration = np.zeros((3, squares.size))

    def step(self, force: Array) -> tuple[Array, Array, Array]:
        """Return displacement, velocity, both as the scheme weighs them, and acceleration under forces, all (m,)."""
        scheme = self._scheme
        free = scheme.predict(self.displacement, self.velocity, self.acceleration)
        displacement = scheme.end_weight * free.displacement - scheme.start_weight * self.displacement
        velocity = scheme.end_weight * free.velocity - scheme.start_weight * self.velocity
        unknown = self._compliance * (force - self._squares * displacement - self._viscous * velocity)
        self.displacement = free.displacement + scheme.displacement_factor * unknown
        self.velocity = free.velocity + scheme.velocity_factor * unknown
        self.acceleration = scheme.inertia_factor * unknown
        weight = scheme.end_weight * unknown
        displacement = displacement + scheme.displacement_factor * weight
        return displacement, velocity + scheme.velocity_factor * weight, self.acceleration


class _MotionError:
    """The error of one motion, in the coordinates of the basis and in the shapes that follow it."""

    def __init__(
        self, system: System, coordinates: ReducedCoordinates, scheme: Scheme, damping: RayleighDamping
    ) -> None:
        basis = coordinates.basis
        self._basis, self._scheme, self._damping = basis, scheme, damping
        self._following = _Oscillators(basis.following_squares, scheme, damping)
        self._inside = _Oscillators(basis.eigenvalues, scheme, damping)
        self._loads = [Load(basis.following.T @ load.forces, load.ramp) for load in system.loads]
        # Where contact stands in the interface, and displacement of sites per coordinate and per shape that follows.
        candidates = coordinates.components(vector_dofs(system.candidates.nodes, system.space.dim).ravel())
        self._contact = candidates.rows[~candidates.held] - basis.eigenvalues.size
        at_sites = _free_rows(system, vector_dofs(system.site_nodes, system.space.dim).ravel())
        self._sites = coordinates.restrict(at_sites), at_sites @ basis.following
        # Of both: largest error and displacement [m], sums of squares of the accelerations' error and of them.
        self._sizes = np.zeros((2, 4))
        self._waiting: list[tuple[Array, Array, Array]] = []
        self._started = False

    @property
    def error(self) -> float:
        error, largest = self._sizes[:, :2].max(axis=0)
        return float(error / largest) if largest else 0.0

    @property
    def acceleration_error(self) -> float:
        ratios = [error / whole for error, whole in self._sizes[:, 2:] if whole]
        return float(np.sqrt(max(ratios, default=0.0)))

    def step(self, before: State, after: State) -> None:
        scheme, size = self._scheme, self._basis.eigenvalues.size
        if not self._started:
            self._start(before)
        displacement, velocity = (
            scheme.end_weight * getattr(after, name)[:size] - scheme.start_weight * getattr(before, name)[:size]
            for name in ("displacement", "velocity")
        )
        load = scheme.end_weight * self._load(after.time) - scheme.start_weight * self._load(before.time)
        self._excite(displacement, velocity, after.acceleration[:size], load)
        self._remember(after)

    def finish(self) -> None:
        if not self._waiting:
            return
        motion, inside, following = (np.stack(fields, axis=2) for fields in zip(*self._waiting, strict=True))
        self._waiting = []
        size, (of_inside, of_following) = len(inside[0]), self._sites
        contact = (self._basis.at_interface @ inside)[:, self._contact], motion[:, size:][:, self._contact]
        sites = of_inside @ inside + of_following @ following, of_inside @ motion[:, :size]
        for (error, whole), sizes in zip((contact, sites), self._sizes, strict=True):
            sizes[:2] = np.maximum(sizes[:2], [np.abs(error[0]).max(initial=0.0), np.abs(whole[0]).max(initial=0.0)])
            sizes[2:] += np.sum(error[1] ** 2), np.sum(whole[1] ** 2)

    def _start(self, state: State) -> None:
        """Take the acceleration that the basis misses at the start."""
        size, damping = self._basis.eigenvalues.size, self._damping
        acceleration, velocity = state.acceleration[:size], state.velocity[:size]
        force = self._basis.following_mass @ (acceleration + damping.mass * velocity)
        force += self._basis.following_stiffness @ (damping.stiffness * velocity)
        self._following.acceleration = self._scheme.inertia_factor * (self._load(state.time) - force)
        self._inside.acceleration = -self._basis.following_mass.T @ self._following.acceleration
        self._started = True
        self._remember(state)

    def _excite(self, displacement: Array, velocity: Array, acceleration: Array, load: Array) -> None:
        """Take a step under what a motion, weighed as in the scheme, leaves in its equations."""
        mass, stiffness, damping = self._basis.following_mass, self._basis.following_stiffness, self._damping
        force = load - mass @ (acceleration + damping.mass * velocity)
        force -= stiffness @ (displacement + damping.stiffness * velocity)
        displacement, velocity, acceleration = self._following.step(force)
        force = mass.T @ (acceleration + damping.mass * velocity)
        self._inside.step(-force - stiffness.T @ (displacement + damping.stiffness * velocity))

    def _load(self, time: float) -> Array:
        return sum((load.ramp.at(time) * load.forces for load in self._loads), np.zeros(len(self._basis.following.T)))

    def _remember(self, state: State) -> None:
        """Keep displacement and acceleration at the end of a step, and their errors, to look at some together."""
        pairs = (state, self._inside, self._following)
        motion, inside, following = (np.stack([pair.displacement, pair.acceleration]) for pair in pairs)
        self._waiting.append((motion, inside, following))
        if len(self._waiting) >= _AT_ONCE:
            self.finish()


def _free_rows(system: System, dofs: NDArray[np.int64]) -> sparse.csr_matrix:
    """Return the map (k, n) from unknowns of the mesh to those degrees of freedom that are free."""
    components = system.coordinates.components(dofs)
    rows = components.rows[~components.held]
    at = np.arange(rows.size), rows
    return sparse.csr_matrix((np.ones(rows.size), at), shape=(rows.size, system.mass.shape[0]))
