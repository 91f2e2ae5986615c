"""What a history says of the whole body at some of its steps.

A step only leaves its motion. What follows from it is computed at the end, for several snapshots at once.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.recording.recoveries import Recoveries, dashpots_reader
from fingerslip.dynamics.step.memory import Viscous
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.system import System
from fingerslip.fe.recovery import Recovery, von_mises

__all__ = ["SnapshotRecords"]

Array = NDArray[np.float64]

# Cells times snapshots whose strains are computed at once: what is computed of them stays in the processor's cache.
_AT_ONCE = 50_000


class SnapshotRecords:
    """Fields of the whole body at some steps."""

    def __init__(
        self, system: System, recoveries: Recoveries, viscous: Sequence[Viscous], steps: Sequence[int]
    ) -> None:
        self._system, self._recoveries, self._viscous = system, recoveries, viscous
        self._numbers = {step: number for number, step in enumerate(steps)}
        self._waiting: list[tuple[int, Array, Array]] = []
        # Of large strain and of materials that relax, stresses follow from more than what is kept of a state.
        self._of_states = system.body is not None or bool(viscous)

    def __contains__(self, step: int) -> bool:
        """Tell whether a step is one of the snapshots."""
        return step in self._numbers

    @property
    def steps(self) -> list[int]:
        """The steps."""
        return list(self._numbers)

    def part(self, start: int, end: int) -> tuple[SnapshotRecords, slice]:
        """Return the records of the snapshots from one step to before another, and which ones these are."""
        steps = [step for step in self._numbers if start <= step < end]
        first = self._numbers[steps[0]] if steps else 0
        records = copy.copy(self)
        vars(records).update(_numbers={step: number for number, step in enumerate(steps)}, _waiting=[])
        return records, slice(first, first + len(steps))

    def record(self, step: int, state: State, values: dict[str, Any]) -> None:
        """Keep the motion of those steps from one on that there are snapshots of."""
        fields = np.atleast_2d(state.displacement), np.atleast_2d(state.velocity)
        for row, (displacement, velocity) in enumerate(zip(*fields, strict=True)):
            number = self._numbers.get(step + row)
            if number is None:
                continue
            # Copies: a state that waits would keep all that it holds.
            self._waiting.append((number, displacement.copy(), velocity.copy()))
            if len(self._waiting) >= self._system.coordinates.snapshots_at_once:
                self.carry(values)
            if self._of_states:
                self._record_state(number, state, values)

    def carry(self, values: dict[str, Any]) -> None:
        """Carry the motions that wait to the mesh, together."""
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        fields = [field for _, *fields in waiting for field in fields]
        on_mesh = self._system.coordinates.on_mesh(np.stack(fields).T).T.reshape(len(waiting), 2, -1)
        for (number, *_), (displacement, velocity) in zip(waiting, on_mesh, strict=True):
            for name, field in (("displacement", displacement), ("velocity", velocity)):
                target = values[f"snapshot_{name}"][number]
                target[:] = field.reshape(target.shape)

    def complete(self, values: dict[str, Any]) -> None:
        """Fill in what follows from the motions."""
        if self._of_states or not self._numbers:
            return
        cells = self._recoveries.cells
        at_once = max(1, _AT_ONCE // max(1, len(cells.strain.indptr) // cells.components))
        for start in range(0, len(self._numbers), at_once):
            some = slice(start, start + at_once)
            displacement = values["snapshot_displacement"][some]
            _record(cells, cells.strains(displacement.reshape(len(displacement), -1)), some, values)

    def _record_state(self, number: int, state: State, values: dict[str, Any]) -> None:
        """Record what follows from a state."""
        if state.body is not None:
            deformed, finite = state.body.deformed, self._recoveries.finite_cells
            values["snapshot_strain_energy_density"][number] = finite.energy_densities(deformed)
            _record_tensors(number, finite.stresses(deformed), finite.tensors(deformed), values)
            return
        cells = self._recoveries.cells
        strains = cells.strains(self._system.coordinates.on_mesh(state.displacement))
        relax = dashpots_reader(self._system, self._viscous, state, cells)
        _record(replace(cells, relax=relax), strains, number, values)


def _record(cells: Recovery, strains: Array, which: int | slice, values: dict[str, Any]) -> None:
    """Record what follows from the strains of all cells (..., n_cells, m) [-] in snapshots."""
    values["snapshot_strain_energy_density"][which] = cells.energy_densities(strains)
    _record_tensors(which, cells.stresses(strains), cells.tensors(strains), values)


def _record_tensors(which: int | slice, stresses: Array, strains: Array, values: dict[str, Any]) -> None:
    """Record stresses [Pa] and strains [-] of all cells (..., n_cells, 4 or 6) in snapshots."""
    for name, tensors in (("stress", stresses), ("strain", strains)):
        target = values[f"snapshot_{name}"][which]
        # What is computed lies in memory component by component.
        for component in range(target.shape[-1]):
            target[..., component] = tensors[..., component]
    values["snapshot_von_mises"][which] = von_mises(stresses)
