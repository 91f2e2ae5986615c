"""Moving supports of compiled steps, which take the coordinates z of a basis alone.

Displacements s of supports, as prescribed, are coordinates x = (z, s) beside z. Let K', M' and C' be the matrices of x
without their diagonals on z, which compiled code has. What they add to the equations of a step is ::

    H = C' v + K' x - V,    w_1 V_1 = w_0 V_0 - M' a_1

with the inertia as a force that the scheme weights like all others. On z it follows from s, and acts as a load -H; on s
it is what supports exert. What it does to the energies is computed for many steps at once.
"""

from __future__ import annotations

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.compact.kernel import ENERGIES, Motion, Records
from fingerslip.dynamics.reduced.reduction import ReducedCoordinates
from fingerslip.dynamics.step.state import State, with_supports
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.system.scheme import start_push
from fingerslip.dynamics.system.system import System
from fingerslip.linear.symmetric import row_products


class MovingSupports:
    """The matrices that couple moving supports to the coordinates of a motion."""

    def __init__(self, stepper: Stepper) -> None:
        coordinates = stepper.system.coordinates
        assert isinstance(coordinates, ReducedCoordinates)
        self._scheme, self._moving, nothing = stepper.scheme, coordinates.moving, 0.0 * coordinates.basis.eigenvalues
        self._size = nothing.size
        self._stiffness, self._mass = (coordinates.matrix(nothing, rows) for rows in coordinates.basis.prescribed)
        self._damping = stepper.damping.mass * self._mass + stepper.damping.stiffness * self._stiffness

    def start(self, state: State) -> tuple[Floats, Floats, Floats]:
        """Return what :meth:`move` and :meth:`finish` go on from: x, v and a, V now and one step before, and H."""
        rows = np.stack([state.displacement, state.velocity, state.acceleration])
        unbalances = np.zeros((2, rows.shape[1]))
        unbalances[:, self._moving] = np.stack([state.unbalance_before, state.unbalance])[:, self._moving]
        push = start_push(self._scheme) * (unbalances[1] - unbalances[0])
        return rows, unbalances, self._damping @ rows[1] - unbalances[1] + push

    def move(self, system: System, carried: tuple[Floats, ...], times: Floats) -> tuple[Floats, Floats]:
        """Return s and its rates, with z = 0, from the start to times (k,) [s], (3, k + 1, n); loads on z (k, m)."""
        rows = np.zeros((3, times.size + 1, carried[0].shape[1]))
        rows[:, 0, self._moving] = carried[0][:, self._moving]
        for step, time in enumerate(times.tolist()):
            rows[:, step + 1] = with_supports(system, self._scheme, [*rows[:, step]], time)
        return rows, -self._forces(rows, carried[1])[1][1:, : self._size]

    def finish(
        self, fields: Floats, path: Floats, carried: tuple[Floats, ...], motion: Motion, records: Records
    ) -> tuple[Floats, Floats, Floats]:
        """Write s into the fields (3, k, n) of steps, and add to their energies; return what the next go on from."""
        fields[..., self._moving] = path[:, 1 : fields.shape[1] + 1, self._moving]
        rows = np.concatenate([carried[0][:, None], fields], axis=1)
        unbalances, forces = self._forces(rows, carried[1])
        forces[0] = carried[2]
        (_, velocity, acceleration), (of_rates, of_moves, earliest, first, last) = rows, self._scheme.losses
        moves, pushes = np.diff(rows[:2], axis=1), np.diff(row_products(self._mass, acceleration), axis=0)
        drag = row_products(self._damping, velocity[1:] + velocity[:-1])
        lost = earliest * unbalances[:-2] + first * unbalances[1:-1] + last * unbalances[2:] + of_moves * pushes
        added = {
            "damping": 0.5 * np.vecdot(moves[0], drag).cumsum(),
            "numerical": (of_rates * np.vecdot(moves[1], pushes) + np.vecdot(moves[0], lost)).cumsum(),
            "external_work": 0.5 * np.vecdot(moves[0], forces[1:] + forces[:-1]).cumsum(),
        }
        for name, energy in added.items():
            motion.energies[ENERGIES.index(name)] += energy[-1]
        inertia = self._scheme.inertia_factor * row_products(self._mass, velocity[1:])
        added["kinetic"] = 0.5 * np.vecdot(velocity[1:], inertia)
        added["strain"] = 0.5 * np.vecdot(rows[0, 1:], row_products(self._stiffness, rows[0, 1:]))
        for name, energy in added.items():
            records.energies[:, ENERGIES.index(name)] += energy
        return rows[:, -1], unbalances[-2:], forces[-1]

    def _forces(self, rows: Floats, unbalances: Floats) -> tuple[Floats, Floats]:
        """Return V from one step before the start on, (k + 2, m), and H from the start on, (k + 1, m)."""
        displacement, velocity, acceleration = rows
        unbalance = [*unbalances]
        for inertia in row_products(self._mass, acceleration)[1:]:
            unbalance.append((self._scheme.start_weight * unbalance[-1] - inertia) / self._scheme.end_weight)
        force = row_products(self._damping, velocity) + row_products(self._stiffness, displacement)
        return np.stack(unbalance), force - np.stack(unbalance[1:])
