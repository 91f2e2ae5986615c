"""What stays the same from step to step: the factorised matrix, and the compliance of the contact nodes."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.solve.compliance import Compliance
from fingerslip.dynamics.condensation import Condensed, condense
from fingerslip.dynamics.scheme import Scheme, Static, hht
from fingerslip.dynamics.system import System
from fingerslip.materials.damping import RayleighDamping
from fingerslip.model import QuasiStatic, TimeStepping

__all__ = ["Stepper", "Stopwatch", "build_steppers"]

Array = NDArray[np.float64]


@dataclass
class Stopwatch:
    """Seconds spent in each part of the work."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Add the time that the block takes to `name`."""
        start = clock.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + clock.perf_counter() - start


@dataclass(frozen=True)
class Stepper:
    """All of one motion that stays the same from step to step.

    Parameters
    ----------
    system : System
        Matrices and candidates.
    scheme : HHT or Static
        Time integration.
    damping : RayleighDamping
        Material damping.
    condensed : Condensed
        The effective matrix, factorised and condensed on the candidates of all motions that share it.
    rows : (m,) array
        The rows among these of the system's own candidates.
    compliance : Compliance
        Compliance of a step on the own candidates.
    flat_frames : (n_c, dim, dim) array or None
        Frames of the candidates where all counterfaces are planes, so that they never turn; `compliance` is in
        them then.
    """

    system: System
    scheme: Scheme
    damping: RayleighDamping
    condensed: Condensed
    rows: NDArray[np.int64]
    compliance: Compliance
    flat_frames: Array | None

    @property
    def force_weight(self) -> float:
        """Weight 1 + alpha of the forces at the end of a step."""
        return 1.0 + self.scheme.alpha


def build_steppers(
    systems: Sequence[System], time: TimeStepping | QuasiStatic, damping: RayleighDamping, later: int = 0
) -> list[Stepper]:
    """Factorise and condense for a fixed step.

    Parameters
    ----------
    systems : sequence of System
        Systems with the same stiffness and mass; their candidates, programmes and loads may differ.
    time : TimeStepping or QuasiStatic
        The step.
    damping : RayleighDamping
        Material damping.
    later : int, optional
        Memory that the histories will take [bytes].

    Raises
    ------
    InputError
        Where the memory will not suffice.
    """
    scheme = Static(time.step) if isinstance(time, QuasiStatic) else hht(time.step, time.alpha)
    weight = 1.0 + scheme.alpha
    stiffness_part = scheme.displacement_factor + scheme.velocity_factor * damping.stiffness
    mass_part = scheme.inertia_factor + weight * scheme.velocity_factor * damping.mass
    effective = mass_part * systems[0].mass + weight * stiffness_part * systems[0].stiffness
    local, rows = _joint_rows(systems)
    condensed, compliance = condense(sparse.csr_matrix(effective), local, later)
    # A force at the end of the step has the weight 1 + alpha, a unit of the unknown the displacement factor.
    factor = weight * scheme.displacement_factor
    known: dict[bytes, tuple[Compliance, Array | None]] = {}
    steppers = []
    for system, own in zip(systems, rows, strict=True):
        key = _key(system)
        if key not in known:
            known[key] = _own_compliance(system, compliance, own, factor)
        steppers.append(Stepper(system, scheme, damping, condensed, own, *known[key]))
    return steppers


def _joint_rows(systems: Sequence[System]) -> tuple[sparse.csr_matrix, list[NDArray[np.int64]]]:
    """Return the local displacements of all candidates of all systems, and the rows of each system's own."""
    dim = systems[0].space.dim
    marks = [
        system.candidates.counterface * len(system.space.positions) + system.candidates.nodes for system in systems
    ]
    joint, first = np.unique(np.concatenate(marks), return_index=True)
    rows = [_components(np.searchsorted(joint, own), dim) for own in marks]
    if all(own.size == dim * joint.size for own in rows):
        return systems[0].relative, rows
    stacked = sparse.vstack([system.relative for system in systems], format="csr")
    return stacked[_components(first, dim)], rows


def _components(nodes: NDArray[np.int64], dim: int) -> NDArray[np.int64]:
    components: NDArray[np.int64] = (nodes[:, None] * dim + np.arange(dim)).ravel()
    return components


def _own_compliance(
    system: System, joint: Array, rows: NDArray[np.int64], factor: float
) -> tuple[Compliance, Array | None]:
    """Return the compliance of a system's candidates, in their frames where these stay, and these frames."""
    candidates = system.candidates
    stiffness = [candidates.normal_stiffness] + [candidates.tangential_stiffness] * (system.space.dim - 1)
    own = joint if rows.size == len(joint) else joint[np.ix_(rows, rows)]
    compliance = Compliance(factor * own, 1.0 / np.column_stack(stiffness))
    if not system.counterfaces.flat:
        return compliance, None
    frames = _flat_frames(system)
    return compliance.turned(frames), frames


def _flat_frames(system: System) -> Array:
    return system.counterfaces.frames(system.candidates.positions, system.candidates.counterface)


def _key(system: System) -> bytes:
    """Return what tells the compliances of systems with the same matrices apart."""
    frames = _flat_frames(system).tobytes() if system.counterfaces.flat else b""
    candidates = system.candidates
    return b"".join([candidates.nodes.tobytes(), candidates.counterface.tobytes(), frames])
