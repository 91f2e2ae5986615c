"""The contact interface over a step: from free motion to forces, states, slip and energies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.candidates import Candidates
from fingerslip.contact.states import OPEN, SLIP, STICK

__all__ = ["InterfaceState", "StepOutcome", "contact_problem", "rest_state", "settle"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InterfaceState:
    """The contact candidates at one time.

    Parameters
    ----------
    forces : (n_c, dim) array
        Nodal forces of the counterface on the skin in its frame, the normal one first [N].
    relative : (n_c, dim) array
        Gap, and tangential displacement relative to the counterface [m].
    slip_distance : (n_c,) array
        Slip accumulated while in contact [m].
    slip : (n_c,) array
        Slip of the last step [m].
    state : (n_c,) array of int
        0 open, 1 stick, 2 slip; without friction every closed node slips.
    """

    forces: Array
    relative: Array
    slip_distance: Array
    slip: Array
    state: NDArray[np.int8]


@dataclass(frozen=True)
class StepOutcome:
    """What a step did to the interface.

    Parameters
    ----------
    state : InterfaceState
        The interface at the end of the step.
    stored : float
        Energy in the penalty springs at the end [J].
    friction : float
        Energy that friction dissipated in the step [J].
    numerical : float
        Energy that the implicit step of the contact law lost [J].
    """

    state: InterfaceState
    stored: float
    friction: float
    numerical: float


def rest_state(candidates: Candidates, gaps: Array) -> InterfaceState:
    """Return the interface at the start, without forces; `gaps` (n_c,) are those of the reference state [m]."""
    count, dim = len(candidates.nodes), candidates.dim
    relative = np.zeros((count, dim))
    relative[:, 0] = gaps
    none = np.zeros(count)
    return InterfaceState(np.zeros((count, dim)), relative, none, none, np.zeros(count, dtype=np.int8))


def contact_problem(candidates: Candidates, before: InterfaceState, free_relative: Array) -> Array:
    """Return q of :mod:`fingerslip.contact.solve.newton`, shape (n_c, dim) [m].

    The normal part is the gap without contact forces. The tangential part is the motion of the step without
    contact forces, less the elastic slip from which it starts.
    """
    free = free_relative.copy()
    elastic = -before.forces[:, 1:] / candidates.tangential_stiffness[:, None]
    free[:, 1:] += elastic - before.relative[:, 1:]
    return free


def settle(
    candidates: Candidates,
    before: InterfaceState,
    forces: Array,
    relative: Array,
    *,
    friction_coefficient: Array,
    stretch: Array,
    work: float,
) -> StepOutcome:
    """Update states, slip and energies with the forces that were found.

    Parameters
    ----------
    candidates : Candidates
        The candidates.
    before : InterfaceState
        The interface at the start of the step.
    forces : (n_c, dim) array
        Forces at the end of the step [N].
    relative : (n_c, dim) array
        Gap and relative tangential displacement at the end of the step [m].
    friction_coefficient : (n_c,) array
        Friction coefficient of the step [-].
    stretch : (n_c, dim - 1) array
        Length of the frames' tangents [-]: 1 but for anisotropic friction.
    work : float
        Work that went into the interface in the step, by the mean of the forces at both ends [J].
    """
    stiffness = candidates.tangential_stiffness[:, None]
    closed, was_closed = forces[:, 0] > 0.0, before.forces[:, 0] > 0.0
    slip = relative[:, 1:] - before.relative[:, 1:] + (forces[:, 1:] - before.forces[:, 1:]) / stiffness
    limit = friction_coefficient * forces[:, 0]
    slides = closed & (np.linalg.norm(forces[:, 1:], axis=1) >= limit * (1.0 - 1e-9))
    # A node that lands during the step has moved freely for part of it: that is no slip.
    length = np.linalg.norm(slip / stretch, axis=1) * (slides & was_closed)
    state = InterfaceState(
        forces=forces,
        relative=relative,
        slip_distance=before.slip_distance + length,
        slip=length,
        state=np.where(closed, np.where(slides, SLIP, STICK), OPEN).astype(np.int8),
    )
    stored = _stored(candidates, forces)
    friction = -float(np.sum(forces[:, 1:] * slip))
    return StepOutcome(state, stored, friction, work - (stored - _stored(candidates, before.forces)) - friction)


def _stored(candidates: Candidates, forces: Array) -> float:
    normal = forces[:, 0] ** 2 / candidates.normal_stiffness
    tangential = np.sum(forces[:, 1:] ** 2, axis=1) / candidates.tangential_stiffness
    return 0.5 * float(np.sum(normal + tangential))
