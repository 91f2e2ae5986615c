"""How far a motion in a reduced basis is from one on the mesh, estimated from the residual of the full equations.

The fields of a step are carried to the mesh, where the equations of the scheme leave a residual inside, where no contact
acts ::

    rho = M a_1 + w_1 (C v_1 + K u_1 - f_1) - w_0 (C v_0 + K u_0 - f_0)

The vibrations that the basis lacks are faster than those that it has, and follow such a force nearly statically: what
they would add to the displacement is e = -K_ii^-1 rho_i / w_1 with the interface held.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.reduction import ReducedCoordinates
from fingerslip.dynamics.scheme import Scheme, make_scheme
from fingerslip.dynamics.state import State
from fingerslip.dynamics.system import System
from fingerslip.materials.damping import RayleighDamping
from fingerslip.model import Model

__all__ = ["ResidualCheck", "missing_displacement"]

Array = NDArray[np.float64]

# Checks at equal distances in a motion, and how much faster a motion has to become to be checked out of turn.
_CHECKS, _FASTER = 16, 1.5


class ResidualCheck:
    """Looks at some steps of reduced motions: at equal distances, and wherever accelerations are larger than before.

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
        self.count = 0

    @property
    def error(self) -> float:
        """The largest missing displacement over the largest displacement, of all motions [-]."""
        moving = self._largest > 0.0
        return float((self._missing[moving] / self._largest[moving]).max(initial=0.0))

    def __call__(self, moving: Sequence[int], before: Sequence[State], after: Sequence[State]) -> None:
        """Look at a step of the motions `moving`, from their states before and after."""
        self._step += 1
        for number in moving:
            acceleration = after[number].acceleration
            fast = float(np.sqrt(acceleration @ after[number].inertia))
            if self._step % self._every == 0 or fast > _FASTER * self._fastest[number]:
                self._look(number, before[number], after[number])
                self._fastest[number] = max(fast, self._fastest[number])

    def _look(self, number: int, before: State, after: State) -> None:
        self.count += 1
        displacement, missing = missing_displacement(
            self._systems[number], self._coordinates[number], self._scheme, self._damping, (before, after)
        )
        self._missing[number] = max(self._missing[number], _largest(missing))
        self._largest[number] = max(self._largest[number], _largest(displacement))


def missing_displacement(
    system: System,
    coordinates: ReducedCoordinates,
    scheme: Scheme,
    damping: RayleighDamping,
    states: tuple[State, State],
) -> tuple[Array, Array]:
    """Return the displacement at the end of a step, and what the basis misses of it, both (n,) [m].

    Parameters
    ----------
    system : System
        The system on the mesh.
    coordinates : ReducedCoordinates
        Those of the reduced system.
    scheme : Scheme
        Time integration.
    damping : RayleighDamping
        Material damping.
    states : tuple of two State
        The reduced states at the start and at the end of the step.
    """
    first, last = states
    fields = (first.displacement, first.velocity, last.displacement, last.velocity, last.acceleration)
    u_0, v_0, u_1, v_1, a_1 = coordinates.lifted(np.stack(fields, axis=1)).T
    # The equations are linear in the fields at both ends, so that each matrix is read once.
    end, start = scheme.end_weight, scheme.start_weight
    velocity = end * v_1 - start * v_0
    strained = end * u_1 - start * u_0 + damping.stiffness * velocity
    loads = end * system.load(last.time) - start * system.load(first.time)
    inertia = scheme.inertia_factor * a_1 + damping.mass * velocity
    residual = system.mass @ inertia + system.stiffness @ strained - loads
    return u_1, -coordinates.body.give_way(residual) / end


def _largest(field: Array) -> float:
    return float(np.abs(field).max(initial=0.0))
