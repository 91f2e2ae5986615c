"""Fields of the whole mesh and at sites: how they follow from motions, and the snapshots."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.contact.candidates import node_operator
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.viscoelastic import Viscous
from fingerslip.dynamics.system.operators import NodalComponents
from fingerslip.dynamics.system.system import System
from fingerslip.fe.finite.recovery import FiniteRecovery, finite_cell_recovery
from fingerslip.fe.recovery import Recovery, Relax, cell_recovery, site_recovery, von_mises
from fingerslip.history import VARIABLES
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.viscoelastic import Relaxed, with_across


@dataclass(frozen=True)
class AtSites:
    """How displacement and strain at sites are read."""

    recovery: Recovery  # strains at the sites, as a map of the mesh's displacement, with the materials there
    near: NodalComponents  # what of a field in the coordinates is taken, k numbers
    motion: Floats | sparse.csr_matrix  # (n_sites * dim, k), the field at the sites, as a map of these
    strain: Floats | sparse.csr_matrix  # (n_strains, k), the strains, as a map of these [1/m]

    @property
    def strain_shape(self) -> tuple[int, int]:
        """Points at which strains are read, and strain components at each."""
        return self.strain.shape[0] // self.recovery.components, self.recovery.components

    def strains(self, field: Floats) -> Floats:
        """Return the strains (n_sites, m) of a field (n,) of the unknowns."""
        return np.asarray(self.strain @ self.near.read(field)).reshape(self.strain_shape)


class Recoveries:
    """The recovery of strains of a body, made when it is first needed."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._at_sites: dict[tuple[bytes, tuple[str | None, ...]], AtSites] = {}

    @functools.cached_property
    def cells(self) -> Recovery:
        """The strains of all cells at small strain."""
        return cell_recovery(self._system.space, self._system.materials)

    def cell_strains(self, field: Floats) -> Floats:
        """Return the strains (n_cells, m) of a field (n,) of the unknowns."""
        return self.cells.strains(self._system.coordinates.on_mesh(field))

    @functools.cached_property
    def finite_cells(self) -> FiniteRecovery:
        """The stresses of all cells at large strain."""
        return finite_cell_recovery(self._system.require_body().bulk)

    def at_sites(self, nodes: Integers, regions: Sequence[str | None]) -> AtSites:
        """Return how displacement and strain at the nodes of sites are read."""
        key, system = (nodes.tobytes(), tuple(regions)), self._system
        if key in self._at_sites:
            return self._at_sites[key]
        # At large strain, stresses are taken from the body in every step.
        strained, sides = (nodes, regions) if system.body is None else (nodes[:0], [])
        recovery = site_recovery(system.space, system.materials, strained, sides)
        motion = node_operator(nodes, system.space.dim, system.space.n_dofs)
        near, both = system.coordinates.apply_map(sparse.csr_matrix(sparse.vstack([motion, recovery.strain])))
        self._at_sites[key] = AtSites(recovery, near, both[: motion.shape[0]], both[motion.shape[0] :])
        return self._at_sites[key]


#: Gives the strains (n, m) at n points of a field (n,) of the unknowns.
_Strains = Callable[[Floats], Floats]


def _dashpots_reader(viscous: Sequence[Viscous], state: State, strains_of: _Strains) -> Relax:
    """Return what gives the dashpots of materials at the points of a recovery from what a state remembers."""

    def relax(material: Elastic, strains: Floats, points: Integers) -> Relaxed:
        pairs = zip(viscous, state.history_variables, strict=True)
        variables = next(variables for layer, variables in pairs if layer.layers.belongs_to(material))
        dashpots = np.stack([strains_of(field)[points] for field in variables.fields[1:, 0]])
        if len(variables.relaxed) == 2:
            return Relaxed(with_across(strains), with_across(dashpots))
        thinned = [-strains_of(field)[points, :2].sum(axis=-1) for field in variables.fields[:, 2]]
        return Relaxed(with_across(strains, thinned[0]), with_across(dashpots, np.stack(thinned[1:])))

    return relax


def of_state(
    viscous: Sequence[Viscous], state: State, recovery: Recovery | FiniteRecovery, strains_of: _Strains
) -> tuple[Recovery | FiniteRecovery, Any]:
    """Return what recovers stresses of a state, with what viscoelastic materials remember, and what it is to read."""
    if isinstance(recovery, FiniteRecovery):
        return recovery, state.large_body.deformed
    return replace(recovery, relax=_dashpots_reader(viscous, state, strains_of)), strains_of(state.displacement)


_MOTION = frozenset({"snapshot_displacement", "snapshot_velocity"})
_FOLLOWING = frozenset(name for name in VARIABLES if name.startswith("snapshot_")) - _MOTION
# Motions that are carried to the mesh at once.
_CARRIED_AT_ONCE = 16
# Cells times snapshots whose strains are computed at once: what is computed of them stays in the processor's cache.
_AT_ONCE = 50_000


class SnapshotRecords:
    """Fields of the whole body at some steps."""

    def __init__(
        self, system: System, recoveries: Recoveries, viscous: Sequence[Viscous], steps: Sequence[int]
    ) -> None:
        self._system, self._recoveries, self._viscous = system, recoveries, viscous
        self._numbers = {step: number for number, step in enumerate(steps)}
        self._waiting: list[tuple[int, Floats, Floats]] = []
        # Of large strain and of viscoelastic materials, stresses follow from more than what is kept of a state.
        self._of_states = system.body is not None or bool(viscous)

    def __contains__(self, step: int) -> bool:
        """Tell whether a step is one of the snapshots."""
        return step in self._numbers

    @property
    def recorded(self) -> frozenset[str]:
        """The variables that are kept step by step; others follow from them."""
        return _FOLLOWING | _MOTION if self._of_states else _MOTION

    def between(self, start: int, end: int) -> slice:
        """Return which snapshots are of steps from one to before another."""
        numbers = [number for step, number in self._numbers.items() if start <= step < end]
        return slice(numbers[0], numbers[-1] + 1) if numbers else slice(0)

    def record(self, step: int, state: State, values: dict[str, Any]) -> None:
        """Keep the motion of those steps from one on that there are snapshots of."""
        if not self._numbers:
            return
        fields = np.atleast_2d(state.displacement), np.atleast_2d(state.velocity)
        for row, (displacement, velocity) in enumerate(zip(*fields, strict=True)):
            number = self._numbers.get(step + row)
            if number is None:
                continue
            # Copies: a state that waits would keep all that it holds.
            self._waiting.append((number, displacement.copy(), velocity.copy()))
            if len(self._waiting) >= _CARRIED_AT_ONCE:
                self.carry(values)
            if self._of_states:
                recovery = self._recoveries.cells if state.body is None else self._recoveries.finite_cells
                _record(*of_state(self._viscous, state, recovery, self._recoveries.cell_strains), number, values)

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
        if self._of_states or not len(values["snapshot_time"]):
            return
        cells = self._recoveries.cells
        at_once = max(1, _AT_ONCE // max(1, len(cells.strain.indptr) // cells.components))
        for start in range(0, len(values["snapshot_time"]), at_once):
            some = slice(start, start + at_once)
            displacement = values["snapshot_displacement"][some]
            _record(cells, cells.strains(displacement.reshape(len(displacement), -1)), some, values)


def _record(cells: Recovery | FiniteRecovery, strained: Any, which: int | slice, values: dict[str, Any]) -> None:
    """Record what follows from the strains of all cells (..., n_cells, m) [-], or a deformed body, in snapshots."""
    stresses = cells.stresses(strained)
    for name, tensors in (("stress", stresses), ("strain", cells.tensors(strained))):
        target = values[f"snapshot_{name}"][which]
        # What is computed lies in memory component by component.
        for component in range(target.shape[-1]):
            target[..., component] = tensors[..., component]
    values["snapshot_strain_energy_density"][which] = cells.energy_densities(strained)
    values["snapshot_von_mises"][which] = von_mises(stresses)
