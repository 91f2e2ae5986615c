"""What acts on a body: loads, the forces of supports and their prescribed motion.

A support's force follows from the equations of motion of what it holds. The scheme weights it like all other forces, so
that the body with its supports obeys the scheme's balance of momentum. With F = C v + K u - f - B^T r and M a in these
rows, summed up, it is ::

    R = F - U,    w_1 U_1 = w_0 U_0 - M a_1
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.errors import InputError
from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.forms import ViscoelasticLayers, mass_matrix, traction_load
from fingerslip.fe.space import Space
from fingerslip.materials.material import Material
from fingerslip.model.model import Model, SupportMotion, Traction
from fingerslip.model.programme import CONSTANT, Ramp

Array = NDArray[np.float64]


def require_components(where: str, values: Sequence[float], dim: int) -> None:
    """Refuse a vector of another dimension than the mesh."""
    if len(values) != dim:
        raise InputError(where, f"got {len(values)} components", f"needs {dim}")


@dataclass(frozen=True)
class Load:
    """Nodal forces with a factor over time."""

    forces: Array  # (n,), nodal forces at factor one [N]
    ramp: Ramp  # factor over time


def model_loads(model: Model, space: Space, materials: CellMaterials[Material]) -> tuple[Load, ...]:
    """Return the tractions and the gravity of a model on all degrees of freedom of its mesh."""
    loads = []
    for name, traction in model.tractions.items():
        value, ramp = (traction.value, traction.ramp) if isinstance(traction, Traction) else (traction, CONSTANT)
        loads.append(Load(traction_load(space, {name: value}, model.depth), ramp))
    if model.gravity is not None:
        require_components("gravity", model.gravity, space.dim)
        acceleration = np.tile(model.gravity, len(space.positions))
        loads.append(Load(mass_matrix(space, materials, model.depth) @ acceleration, CONSTANT))
    return tuple(loads)


Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Supports:
    """What acts on the degrees of freedom that m supports hold, summed up over each support and component."""

    rows: sparse.csr_matrix  # map that sums up forces on the mesh over each support and component [-]
    stiffness: sparse.csr_matrix | Array  # (m * dim, n) [N/m]
    mass: sparse.csr_matrix | Array  # (m * dim, n) [kg]
    contact: sparse.csr_matrix  # map from the contact forces to those that act on what is held at once
    loads: tuple[Load, ...]  # loads on what is held, (m * dim,) each [N]
    viscoelastic: tuple[ViscoelasticLayers, ...] = ()  # maps (m * dim, n) of the viscoelastic layers

    @property
    def columns(self) -> Indices:
        """The unknowns that stiffness and mass read, shape (k,): those of the cells next to what is held."""
        return np.union1d(*(np.flatnonzero(abs(matrix).sum(axis=0)) for matrix in (self.stiffness, self.mass)))

    def load(self, time: float) -> Array:
        """Return the loads on what is held at a time [s], shape (m * dim,) [N]."""
        return sum((load.ramp.at(time) * load.forces for load in self.loads), np.zeros(self.contact.shape[0]))


@dataclass(frozen=True)
class MovingComponent:
    """One component of a moving support."""

    support: str  # its boundary or region
    axis: int  # its component
    dofs: Indices  # (k,), the mesh's degrees of freedom that move with it
    displacement: float  # displacement at factor one [m]
    ramp: Ramp  # factor over time

    def at(self, time: float) -> float:
        """Return the displacement at a time [s], in m."""
        return self.displacement * self.ramp.at(time)


def moving_components(
    motions: Mapping[str, SupportMotion], rows: sparse.csr_matrix, names: Sequence[str]
) -> list[MovingComponent]:
    """Return the components of moving supports."""
    components = []
    for name, motion in motions.items():
        dim = len(motion.displacement)
        for axis, displacement in enumerate(motion.displacement):
            dofs = rows[names.index(name) * dim + axis].indices.astype(np.int64)
            if displacement and dofs.size:
                components.append(MovingComponent(name, axis, np.sort(dofs), displacement, motion.ramp))
    return components


def held_rows(held: Mapping[str, Indices], space: Space) -> sparse.csr_matrix:
    """Return the map [-] that sums up forces (n_dofs,) over supports and components, shape (m * dim, n_dofs).

    Arrays: held (k,).

    Examples
    --------
    A square with node 0 held by the first of two supports:

    >>> import skfem
    >>> from fingerslip.fe.space import build_space
    >>> mesh = skfem.MeshQuad().with_subdomains({"bulk": lambda x: x[0] > -1.0})
    >>> rows = held_rows({"corner": np.array([0, 1]), "side": np.array([0, 1, 2, 3])}, build_space(mesh))
    >>> rows.toarray().astype(int)[:, :4].tolist()
    [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    """
    holder = np.full(space.n_dofs, -1)
    for number, dofs in reversed(list(enumerate(held.values()))):
        holder[dofs] = number
    columns = np.flatnonzero(holder >= 0)
    shape = (len(held) * space.dim, space.n_dofs)
    return sparse.csr_matrix(
        (np.ones(columns.size), (holder[columns] * space.dim + columns % space.dim, columns)), shape
    )
