"""How far a motion in a reduced basis is from one on the mesh, estimated from the residual of the full equations.

The fields of a step are carried to the mesh, where the equations of the scheme leave a residual inside, where no
contact acts ::

    rho = M a_1 + w_1 (C v_1 + K u_1 - f_1) - w_0 (C v_0 + K u_0 - f_0)

The vibrations that the basis lacks are faster than those that it has, and follow such a force nearly statically: what
they would add to the displacement is e = -K_ii^-1 rho_i / w_1 with the interface held. The acceleration of a step
follows its displacement by c_a/c_u, so that the basis misses at most e c_a/c_u of it; a scheme that damps little adds
up what is missed in its last 1/(1 - r) steps, with r its spectral radius at the missing frequencies.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.reduced.reduction import ReducedCoordinates
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.scheme import Scheme, make_scheme
from fingerslip.dynamics.system.system import System
from fingerslip.materials.damping import RayleighDamping
from fingerslip.model import Model

__all__ = ["ResidualCheck", "missing_displacements", "steps_remembered"]

Array = NDArray[np.float64]

# Checks at equal distances in a motion, and how much faster a motion has to become to be checked out of turn.
_CHECKS, _FASTER = 16, 1.5
# Steps that are looked at together.
_AT_ONCE = 16
# Squares of missing frequencies, over that of the lowest.
_HIGHER = 10.0 ** np.arange(7)


class ResidualCheck:
    """Looks at some steps of reduced motions: at equal distances, and wherever accelerations are larger than before.

    What it found is known after :meth:`finish`.

    Parameters
    ----------
    models : sequence of Model
        What is simulated.
    systems : sequence of System
        Their systems on the mesh.
    coordinates : sequence of ReducedCoordinates
        Those of the reduced systems.
    steps : int
        Steps of the longest motion.
    """

    def __init__(
        self,
        models: Sequence[Model],
        systems: Sequence[System],
        coordinates: Sequence[ReducedCoordinates],
        steps: int,
    ) -> None:
        self._systems, self._coordinates = systems, coordinates
        self._scheme, self._damping = make_scheme(models[0].time), models[0].damping
        self._every, self._step = max(1, steps // _CHECKS), 0
        self._fastest = np.zeros(len(models))
        self._missing, self._largest = np.zeros(len(models)), np.zeros(len(models))
        self._missing_inertia, self._inertia = np.zeros(len(models)), np.zeros(len(models))
        self._waiting: list[tuple[list[int], tuple[State, State]]] = []
        # Vibrations above the middle of the frequencies are rough: what is like them may be missing.
        frequencies = coordinates[0].basis.frequencies
        missing = float(np.median(frequencies)) if frequencies.size else 1.0
        self._remembered = min(steps_remembered(self._scheme, self._damping, missing), steps)
        self.count = 0

    @property
    def error(self) -> float:
        """The largest missing displacement over the largest displacement, of all motions [-]."""
        return _ratio(self._missing, self._largest)

    @property
    def acceleration_error(self) -> float:
        """The largest missing acceleration over the largest acceleration, both as root of the mean square [-]."""
        return self._remembered * _ratio(self._missing_inertia, self._inertia)

    def __call__(self, moving: Sequence[int], before: Sequence[State], after: Sequence[State]) -> None:
        """Look at a step of the motions `moving`, from their states before and after, now or with some that follow."""
        self._step += 1
        wanted = []
        for number in moving:
            acceleration = after[number].acceleration
            fast = float(np.sqrt(acceleration @ after[number].inertia))
            self._inertia[number] = max(self._inertia[number], fast)
            if self._step % self._every == 0 or fast > _FASTER * self._fastest[number]:
                wanted.append(number)
                self._fastest[number] = max(fast, self._fastest[number])
        # Motions that are still the same share their states.
        same: dict[int, list[int]] = {}
        for number in wanted:
            same.setdefault(id(after[number]), []).append(number)
        self._waiting += [(members, (before[members[0]], after[members[0]])) for members in same.values()]
        if len(self._waiting) >= _AT_ONCE:
            self.finish()

    def finish(self) -> None:
        """Look at the steps that wait: at several at once, so that the factors are read once for them."""
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        systems, pairs = [self._systems[members[0]] for members, _ in waiting], [pair for _, pair in waiting]
        known = missing_displacements(systems, self._coordinates[0], self._scheme, self._damping, pairs)
        for (members, _), system, displacement, missing in zip(waiting, systems, *known, strict=True):
            self._take(members, system, displacement, missing)

    def _take(self, numbers: Sequence[int], system: System, displacement: Array, missing: Array) -> None:
        self.count += len(numbers)
        per_displacement = self._scheme.inertia_factor / self._scheme.displacement_factor
        inertia = per_displacement * float(np.sqrt(missing @ (system.mass @ missing)))
        for number in numbers:
            self._missing[number] = max(self._missing[number], _largest(missing))
            self._largest[number] = max(self._largest[number], _largest(displacement))
            self._missing_inertia[number] = max(self._missing_inertia[number], inertia)


def missing_displacements(
    systems: Sequence[System],
    coordinates: ReducedCoordinates,
    scheme: Scheme,
    damping: RayleighDamping,
    states: Sequence[tuple[State, State]],
) -> tuple[Array, Array]:
    """Return displacements at the end of steps, and what the basis misses of them, both (k, n) [m].

    Parameters
    ----------
    systems : sequence of System
        The systems on the mesh, of one body, of k motions.
    coordinates : ReducedCoordinates
        Those of the reduced systems.
    scheme : Scheme
        Time integration.
    damping : RayleighDamping
        Material damping.
    states : sequence of two State
        The reduced states of each motion at the start and at the end of its step.
    """
    # The equations are linear in the fields at both ends: few combinations of them are carried to the mesh.
    end, start = scheme.end_weight, scheme.start_weight
    velocity = np.stack([end * last.velocity - start * first.velocity for first, last in states])
    displacement = np.stack([last.displacement for _, last in states])
    moved = np.stack([end * last.displacement - start * first.displacement for first, last in states])
    acceleration = np.stack([last.acceleration for _, last in states])
    strained = moved + damping.stiffness * velocity
    inertia = scheme.inertia_factor * acceleration + damping.mass * velocity
    on_mesh = coordinates.lifted(np.concatenate([displacement, strained, inertia]).T)
    reached, strained, inertia = np.hsplit(on_mesh, 3)
    loads = [
        end * system.load(last.time) - start * system.load(first.time)
        for system, (first, last) in zip(systems, states, strict=True)
    ]
    residual = systems[0].mass @ inertia + systems[0].stiffness @ strained - np.transpose(loads)
    return reached.T, -coordinates.body.give_way(residual).T / end


def steps_remembered(scheme: Scheme, damping: RayleighDamping, frequency: float) -> float:
    """Return how many steps a scheme remembers of vibrations at or above an angular frequency [rad/s]; at least 1.

    Examples
    --------
    HHT with strong and with little numerical damping:

    >>> from fingerslip.dynamics.system.scheme import hht
    >>> [round(steps_remembered(hht(1e-3, alpha), RayleighDamping(), 1e6), 1) for alpha in (-1 / 3, -0.05)]
    [2.0, 10.5]
    """
    radius = max(_spectral_radius(scheme, damping, square) for square in frequency**2 * _HIGHER)
    return 1.0 / max(1.0 - radius, np.finfo(float).eps)


def _spectral_radius(scheme: Scheme, damping: RayleighDamping, square: float) -> float:
    """Return by how much a step may enlarge a free vibration with a squared angular frequency [1/s^2]."""
    u_0, v_0, a_0 = np.eye(3)
    viscous = damping.mass + damping.stiffness * square
    free = scheme.predict(u_0, v_0, a_0)
    force = scheme.start_weight * (square * u_0 + viscous * v_0)
    force = force - scheme.end_weight * (square * free.displacement + viscous * free.velocity)
    resistance = scheme.displacement_factor * square + scheme.velocity_factor * viscous
    unknown = force / (scheme.inertia_factor + scheme.end_weight * resistance)
    u_1 = free.displacement + scheme.displacement_factor * unknown
    v_1 = free.velocity + scheme.velocity_factor * unknown
    return float(np.abs(np.linalg.eigvals(np.stack([u_1, v_1, scheme.inertia_factor * unknown]))).max())


def _ratio(parts: Array, wholes: Array) -> float:
    """Return the largest of some parts over their wholes, those that are zero apart."""
    there = wholes > 0.0
    return float((parts[there] / wholes[there]).max(initial=0.0))


def _largest(field: Array) -> float:
    return float(np.abs(field).max(initial=0.0))
