"""How strains and motions are read from the coordinates of a system: made once for motions of one body."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.candidates import node_operator
from fingerslip.dynamics.step.memory import Viscous
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.operators import NodalComponents
from fingerslip.dynamics.system.system import System
from fingerslip.fe.finite.recovery import FiniteRecovery, finite_cell_recovery
from fingerslip.fe.recovery import Recovery, Relax, cell_recovery, site_recovery
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.viscoelastic import Relaxed, with_across

__all__ = ["AtSites", "Recoveries", "dashpots_reader"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AtSites:
    """How displacement and strain at sites are read."""

    recovery: Recovery  # strains at the sites, as a map of the mesh's displacement, with the materials there
    near: NodalComponents  # what of a field in the coordinates is taken, k numbers
    motion: Array | sparse.csr_matrix  # (n_sites * dim, k), the field at the sites, as a map of these
    strain: Array | sparse.csr_matrix  # (n_strains, k), the strains, as a map of these [1/m]

    @property
    def strain_shape(self) -> tuple[int, int]:
        """Points at which strains are read, and strain components at each."""
        return self.strain.shape[0] // self.recovery.components, self.recovery.components


class Recoveries:
    """The recovery of strains of a body, made when it is first needed."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._at_sites: dict[tuple[bytes, tuple[str | None, ...]], AtSites] = {}

    @functools.cached_property
    def cells(self) -> Recovery:
        """The strains of all cells at small strain."""
        return cell_recovery(self._system.space, self._system.materials)

    @functools.cached_property
    def finite_cells(self) -> FiniteRecovery:
        """The stresses of all cells at large strain."""
        return finite_cell_recovery(self._system.require_body().bulk)

    def at_sites(self, nodes: NDArray[np.int64], regions: Sequence[str | None]) -> AtSites:
        """Return how displacement and strain at sites are read.

        Arrays: nodes (n_sites,).
        """
        key = nodes.tobytes(), tuple(regions)
        if key not in self._at_sites:
            self._at_sites[key] = self._made_at_sites(nodes, regions)
        return self._at_sites[key]

    def _made_at_sites(self, nodes: NDArray[np.int64], regions: Sequence[str | None]) -> AtSites:
        system = self._system
        # At large strain, stresses are taken from the body in every step.
        strained, sides = (nodes, regions) if system.body is None else (nodes[:0], [])
        recovery = site_recovery(system.space, system.materials, strained, sides)
        motion = node_operator(nodes, system.space.dim, system.space.n_dofs)
        near, both = system.coordinates.apply_map(sparse.csr_matrix(sparse.vstack([motion, recovery.strain])))
        return AtSites(recovery, near, both[: motion.shape[0]], both[motion.shape[0] :])


def dashpots_reader(system: System, viscous: Sequence[Viscous], state: State, recovery: Recovery) -> Relax:
    """Return what gives the dashpots of materials at the points of a recovery from what a state remembers."""

    def read(field: Array, points: NDArray[np.int64]) -> Array:
        strains: Array = recovery.strains(system.coordinates.on_mesh(field))[points]
        return strains

    def relax(material: Elastic, strains: Array, points: NDArray[np.int64]) -> Relaxed:
        pairs = zip(viscous, state.memories, strict=True)
        memory = next(memory for layer, memory in pairs if layer.layers.belongs_to(material))
        dashpots = np.stack([read(field, points) for field in memory.dashpots[:, 0]])
        if not memory.across.size:
            return Relaxed(with_across(strains), with_across(dashpots))
        fields = [memory.across[0], *memory.across_dashpots[:, 0]]
        thinned = [-read(field, points)[:, :2].sum(axis=-1) for field in fields]
        return Relaxed(with_across(strains, thinned[0]), with_across(dashpots, np.stack(thinned[1:])))

    return relax
