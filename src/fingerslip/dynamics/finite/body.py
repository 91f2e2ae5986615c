"""The deformable body of a motion at large strain: its forces on the unknowns, and what of it a state keeps."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.dynamics.system.operators import MeshCoordinates
from fingerslip.fe.finite.bulk import LargeStrain
from fingerslip.fe.finite.history import Deformed

__all__ = ["Body", "BodyState"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BodyState:
    """A body at one displacement."""

    deformed: Deformed  # strains and stresses at its quadrature points
    nodal: Array  # (n_dofs,), elastic forces on all degrees of freedom of the mesh [N]
    force: Array  # (n,), elastic forces on the unknowns [N]
    displacement: Array  # (n,), displacement of the unknowns [m]
    energy: float = 0.0  # strain energy [J]
    change: Array | None = None  # (n,), what the last step added to the displacement [m]


@dataclass(frozen=True)
class Body:
    """A body at large strain in the unknowns of a system."""

    bulk: LargeStrain  # mesh and laws
    coordinates: MeshCoordinates  # what the unknowns are
    springs: Array  # (n,), stiffness of the springs at rigid bodies [N/m], zero for all other unknowns

    @property
    def relaxes(self) -> bool:
        """Whether some of its materials relax."""
        return self.bulk.relaxation is not None

    def at_rest(self, step: float) -> BodyState:
        """Return the body that has never moved, for steps of a length [s]."""
        nothing = np.zeros(self.springs.size)
        deformed = self.bulk.at_rest(step)
        return BodyState(deformed, np.zeros(self.coordinates.n_dofs), nothing, nothing)

    def begun(self, state: BodyState, step: float) -> BodyState:
        """Return a body at the start of a step [s], near which its end is searched."""
        return replace(state, deformed=self.bulk.begun(state.deformed, step)) if self.relaxes else state

    def ended(self, state: BodyState) -> BodyState:
        """Return a body at the end of a step with what it remembers, and its energy."""
        ended = replace(state, deformed=self.bulk.ended(state.deformed)) if self.relaxes else state
        return replace(ended, energy=self.energy(ended))

    def at(self, displacement: Array, near: BodyState | None = None) -> BodyState:
        """Return the body at a displacement (n,) [m], searched from a state near it; refuse cells turned inside out."""
        guess = None if near is None else near.deformed
        deformed = self.bulk.deformed(self.coordinates.on_mesh(displacement), guess)
        nodal = self.bulk.force(deformed)
        force = self.coordinates.unknowns.restrict(nodal) + self.springs * displacement
        return BodyState(deformed, nodal, force, displacement)

    def energy(self, state: BodyState) -> float:
        """Return the strain energy of a state, that of springs included [J]."""
        return self.bulk.energy(state.deformed) + 0.5 * float(self.springs @ state.displacement**2)

    def tangent(self, state: BodyState, *, positive: bool = False) -> sparse.csr_matrix:
        """Return the derivative of the force by the displacement, shape (n, n) [N/m]; see :class:`LargeStrain`."""
        unknowns, of_mesh = self.coordinates.unknowns, self.bulk.tangent(state.deformed, positive=positive)
        if unknowns.count == unknowns.free.size:
            return of_mesh[unknowns.free][:, unknowns.free]
        expansion = unknowns.expansion(self.coordinates.n_dofs)
        return sparse.csr_matrix(expansion.T @ of_mesh @ expansion + sparse.diags(self.springs))
