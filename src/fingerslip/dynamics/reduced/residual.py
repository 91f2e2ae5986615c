"""How far a motion in a reduced basis is from one on the mesh: what the residual of the full equations excites.

With contact forces as they are, the error e of a reduced motion obeys the equations of the scheme under minus their
residual ::

    rho = M a_1 + w_1 (C v_1 + K u_1 - f_1) - w_0 (C v_0 + K u_0 - f_0)

which is orthogonal to the basis. The shapes W that would come next into the basis see the most of it: they are
computed beside the motion, each an oscillator under -W^T rho, and their inertia and stiffness excite the coordinates of
the basis in turn. Both are diagonal, so that a step of the error costs a fraction of one of the motion, and what little
numerical damping adds up over many steps is added up here, too.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats
from fingerslip.dynamics.loop import Check, Steps
from fingerslip.dynamics.reduced.reduction import ReducedCoordinates
from fingerslip.dynamics.system.bodies import Load
from fingerslip.dynamics.system.scheme import Scheme, make_scheme
from fingerslip.dynamics.system.system import System
from fingerslip.fe.space import vector_dofs
from fingerslip.linear.craig_bampton import CraigBampton
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.model.model import Model, ReducedBasis

# The share of steps whose errors are compared with the motion.
_ONE_OF = 4
# Errors over what the shapes that follow show of them: 1.2 in the middle of 83 random models, below 2.1 in nine of ten.
_BEYOND = 1.5

_logger = logging.getLogger("fingerslip.dynamics")


class ResidualCheck:
    """Estimates the errors of reduced motions; each of its `motions` looks at the states of one."""

    def __init__(
        self,
        models: Sequence[Model],
        systems: Sequence[System],
        coordinates: Sequence[ReducedCoordinates],
        basis: CraigBampton,
    ) -> None:
        scheme, damping = make_scheme(models[0].time), models[0].damping
        pairs = zip(systems, coordinates, strict=True)
        self.motions = [_MotionError(system, reduced, scheme, damping) for system, reduced in pairs]
        self._basis = basis

    @property
    def error(self) -> float:
        """The largest error of displacements at contact and sites over the largest of these displacements [-]."""
        return _BEYOND * max(motion.error for motion in self.motions)

    @property
    def acceleration_error(self) -> float:
        """The error of accelerations over these, at the contact or at sites, as roots of mean squares [-]."""
        return _BEYOND * max(motion.acceleration_error for motion in self.motions)

    def excess(self, wanted: ReducedBasis) -> float:
        """Return the errors over their tolerances, the larger of both [-]."""
        return max(self.error / wanted.tolerance, self.acceleration_error / wanted.acceleration_tolerance)

    def warn(self, wanted: ReducedBasis) -> None:
        """Warn of errors beyond the tolerances."""
        if self.excess(wanted) > 1.0:
            counts = self._basis.frequencies.size, self.error, self.acceleration_error
            _logger.warning("basis: %d normal modes leave errors of %.2g and %.2g", *counts)

    @property
    def attributes(self) -> dict[str, object]:
        """What histories say of the basis and of the errors that it has left."""
        basis = self._basis
        return {
            "basis": "reduced",
            "basis_constraint_modes": basis.interface.size,
            "basis_normal_modes": basis.frequencies.size,
            "basis_highest_frequency": float(basis.frequencies.max(initial=0.0)) / (2.0 * np.pi),
            "basis_error": self.error,
            "basis_acceleration_error": self.acceleration_error,
        }


class _Oscillators:
    """Oscillators of mass one in a scheme, from rest: squares (m,) of their frequencies [1/s^2], own dampers [1/s]."""

    def __init__(
        self, squares: Floats, scheme: Scheme, damping: RayleighDamping, dampers: Floats | float = 0.0
    ) -> None:
        viscous = damping.mass + damping.stiffness * squares + dampers
        resistance = scheme.displacement_factor * squares + scheme.velocity_factor * viscous
        compliance = 1.0 / (scheme.inertia_factor + scheme.end_weight * resistance)
        self._factors = scheme.factors
        self._constants = squares, viscous, compliance, np.array(scheme.prediction)
        self.fields = np.zeros((3, squares.size))

    def step(self, forces: Floats) -> Floats:
        """Take a step under each of the forces (k, m) [m/s^2]; return what :func:`_oscillate` does."""
        fields: Floats = _oscillate(*self._constants, self._factors, self.fields, forces)
        self.fields = fields[:3, -1].copy()
        return fields


@numba.njit(cache=True, nogil=True)
def _oscillate(squares, viscous, compliance, prediction, factors, start, forces):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return displacement, velocity, acceleration, and both first ones as the scheme weighs them, (5, k, m)."""
    of_displacement, of_velocity, of_inertia, start_weight, end_weight = factors
    fields = np.empty((5, *forces.shape))
    displacement, velocity, acceleration = start[0].copy(), start[1].copy(), start[2].copy()
    for step in range(len(forces)):
        for j in range(squares.size):
            u, v, a = displacement[j], velocity[j], acceleration[j]
            end = prediction[0, 0] * u + prediction[0, 1] * v + prediction[0, 2] * a
            rate = prediction[1, 0] * u + prediction[1, 1] * v + prediction[1, 2] * a
            moved, moving = end_weight * end - start_weight * u, end_weight * rate - start_weight * v
            unknown = compliance[j] * (forces[step, j] - squares[j] * moved - viscous[j] * moving)
            displacement[j], velocity[j] = end + of_displacement * unknown, rate + of_velocity * unknown
            acceleration[j] = of_inertia * unknown
            fields[3, step, j] = moved + of_displacement * end_weight * unknown
            fields[4, step, j] = moving + of_velocity * end_weight * unknown
            # Element by element: a row at a time compiles four times as long.
            fields[0, step, j], fields[1, step, j], fields[2, step, j] = displacement[j], velocity[j], acceleration[j]
    return fields


class _MotionError(Check):
    """The error of one motion, in the coordinates of the basis and in the shapes that follow it."""

    def __init__(
        self, system: System, coordinates: ReducedCoordinates, scheme: Scheme, damping: RayleighDamping
    ) -> None:
        basis = coordinates.basis
        self._basis, self._scheme, self._damping = basis, scheme, damping
        self._following = _Oscillators(basis.following_squares, scheme, damping)
        # Moving supports have no error: what would excite it is zero. Dampers count by their diagonal.
        self._on_basis, size = coordinates.on_basis, basis.eigenvalues.size
        squares = np.append(basis.eigenvalues, np.ones(coordinates.moving.size))
        dampers = np.zeros(basis.interface.size)
        if system.dampers is not None:
            dampers[coordinates.rigid - size] = system.dampers[system.coordinates.rigid]
        self._inside = _Oscillators(squares, scheme, damping, dampers @ basis.at_interface**2)
        self._mass_inside = basis.following_mass.copy()
        self._mass_inside[:, size:] = 0.0
        self._loads = [Load(basis.following.T @ load.forces, load.ramp) for load in system.loads]
        # Displacement of contact and sites per coordinate, and of sites per shape that follows.
        candidates = coordinates.components(vector_dofs(system.candidates.nodes, system.space.dim).ravel())
        at_contact = basis.at_interface[candidates.rows[~candidates.held] - basis.eigenvalues.size]
        components = system.coordinates.components(vector_dofs(system.site_nodes, system.space.dim).ravel())
        at = components.rows[~components.held]
        shape = at.size, system.mass.shape[0]
        at_sites = sparse.csr_matrix((np.ones(at.size), (np.arange(at.size), at)), shape=shape)
        self._places = np.ascontiguousarray(at_contact.T), np.ascontiguousarray(coordinates.restrict(at_sites).T)
        self._following_at_sites = np.ascontiguousarray((at_sites @ basis.following).T)
        # Of both: largest error and displacement [m], sums of squares of the accelerations' error and of them.
        self._sizes = np.zeros((2, 4))
        self._last: tuple[Floats, Floats] | None = None

    @property
    def error(self) -> float:
        error, largest = self._sizes[:, :2].max(axis=0)
        return float(error / largest) if largest else 0.0

    @property
    def acceleration_error(self) -> float:
        ratios = [error / whole for error, whole in self._sizes[:, 2:] if whole]
        return float(np.sqrt(max(ratios, default=0.0)))

    def saved_state(self) -> Any:
        """Return what :meth:`restore` needs, as plain data and arrays."""
        return self._following.fields, self._inside.fields, self._sizes.copy(), *(self._last or (None, None))

    def restore(
        self, following: Floats, inside: Floats, sizes: Floats, times: Floats | None, rows: Floats | None
    ) -> None:
        """Go on where :meth:`saved_state` was called."""
        self._following.fields, self._inside.fields, self._sizes = following, inside, sizes.copy()
        self._last = None if times is None or rows is None else (times, rows)

    def look(self, steps: Steps) -> None:
        """Look at states: the errors are those of steps from the last state before them."""
        fields = steps.displacement, steps.velocity, steps.acceleration
        times, rows = steps.time, np.stack([field[:, self._on_basis] for field in fields])
        if self._last is None:
            self._start(rows[:, 0], float(times[0]))
        else:
            times, rows = np.append(self._last[0], times), np.concatenate([self._last[1], rows], axis=1)
        self._last = times[-1:], rows[:, -1:]
        if times.size > 1:
            inside, following = self._excite(times, rows)
            inside, following, motion = (fields[[0, 2], ::-_ONE_OF] for fields in (inside, following, rows[:, 1:]))
            self._compare(inside, following, motion)

    def _compare(self, inside: Floats, following: Floats, motion: Floats) -> None:
        """Compare errors with the motion, displacement and acceleration (2, k, m) of each."""
        both = np.stack([inside, motion])
        # One product of all rows.
        contact, sites = ((both.reshape(-1, both.shape[-1]) @ at).reshape(*both.shape[:-1], -1) for at in self._places)
        sites[0] += following @ self._following_at_sites
        for (error, whole), sizes in zip((contact, sites), self._sizes, strict=True):
            sizes[:2] = np.maximum(sizes[:2], [np.abs(error[0]).max(initial=0.0), np.abs(whole[0]).max(initial=0.0)])
            sizes[2:] += np.sum(error[1] ** 2), np.sum(whole[1] ** 2)

    def _start(self, motion: Floats, time: float) -> None:
        """Take the acceleration that the basis misses at the start."""
        (_, velocity, acceleration), damping, basis = motion, self._damping, self._basis
        force = basis.following_mass @ (acceleration + damping.mass * velocity)
        force += basis.following_stiffness @ (damping.stiffness * velocity)
        self._following.fields[2] = self._scheme.inertia_factor * (self._load(time) - force)
        self._inside.fields[2] = -self._mass_inside.T @ self._following.fields[2]
        # Nothing has moved so far.
        inside, following = self._inside.fields[[0, 2], None], self._following.fields[[0, 2], None]
        self._compare(inside, following, np.stack([0.0 * acceleration, acceleration])[:, None])

    def _excite(self, times: Floats, rows: Floats) -> tuple[Floats, Floats]:
        """Return the errors inside the basis and in the shapes that follow, under what steps leave in their equations.

        Arrays: times (k + 1,) [s]; rows (3, k + 1, m), the motion; returns what :func:`_oscillate` does.
        """
        start_weight, end_weight = self._scheme.start_weight, self._scheme.end_weight
        mass, stiffness, damping = self._basis.following_mass, self._basis.following_stiffness, self._damping
        displacement, velocity = end_weight * rows[:2, 1:] - start_weight * rows[:2, :-1]
        loads = np.stack([self._load(time) for time in times.tolist()])
        forces = end_weight * loads[1:] - start_weight * loads[:-1]
        forces -= (rows[2, 1:] + damping.mass * velocity) @ mass.T
        forces -= (displacement + damping.stiffness * velocity) @ stiffness.T
        following = self._following.step(forces)
        inertia, (displacement, velocity) = following[2], following[3:]
        forces = (
            -(inertia + damping.mass * velocity) @ self._mass_inside
            - (displacement + damping.stiffness * velocity) @ stiffness
        )
        return self._inside.step(forces), following

    def _load(self, time: float) -> Floats:
        return sum((load.ramp.at(time) * load.forces for load in self._loads), np.zeros(len(self._basis.following.T)))
