"""The discrete system of a model: matrices, loads, contact candidates and their maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.candidates import Candidates, Counterfaces, join_candidates
from fingerslip.dynamics.checks import CheckedModel, checked
from fingerslip.dynamics.coordinates import Coordinates, MeshCoordinates
from fingerslip.dynamics.loads import Load
from fingerslip.dynamics.motion import Motion
from fingerslip.dynamics.operators import Outsiders, Unknowns, relative_operator
from fingerslip.dynamics.supports import MovingComponent, Supports, held_rows, moving_components, supports_of
from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.forms import mass_matrix, stiffness_matrix
from fingerslip.fe.space import Space, carrying_nodes
from fingerslip.model import Drive, Model

__all__ = ["System", "build_system"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class System:
    """A model's discrete system of n unknowns: those of the mesh, or the coordinates of a reduced body.

    Parameters
    ----------
    space : Space
        Displacement space.
    materials : CellMaterials
        Material of every cell.
    unknowns : Unknowns
        Free degrees of freedom and driven counterfaces.
    coordinates : Coordinates
        What the unknowns are and how fields are read from them.
    is_held : bool
        Whether inertia or supports leave no rigid motion to the contact.
    stiffness, mass : sparse matrix, shape (n, n)
        [N/m], [kg].
    loads : tuple of Load
        Forces with their factors over time.
    initial_velocity : (n,) array
        [m/s].
    candidates : Candidates
        Contact candidates of all counterfaces.
    counterfaces : Counterfaces
        The counterfaces and the friction on them.
    relative : sparse matrix, shape (n_c * dim, n)
        Map to the displacement of the candidates relative to what the drives add to the counterfaces' motion.
    outsiders : tuple of Outsiders
        For each counterface, the nodes of its boundary that are no candidates.
    motions : tuple of Motion
        Prescribed motion of each counterface.
    site_nodes : (n_sites,) array
        Mesh nodes of the recorded sites.
    supports : Supports
        What acts on what supports hold.
    moving_supports : tuple of MovingComponent
        The components of supports that move as prescribed, the last unknowns.
    """

    space: Space
    materials: CellMaterials
    unknowns: Unknowns
    coordinates: Coordinates
    is_held: bool
    stiffness: sparse.csr_matrix
    mass: sparse.csr_matrix
    loads: tuple[Load, ...]
    initial_velocity: Array
    candidates: Candidates
    counterfaces: Counterfaces
    relative: sparse.csr_matrix
    outsiders: tuple[Outsiders, ...]
    motions: tuple[Motion, ...]
    site_nodes: NDArray[np.int64]
    supports: Supports
    moving_supports: tuple[MovingComponent, ...] = ()

    @property
    def free(self) -> NDArray[np.int64]:
        """Free degrees of freedom of the mesh, shape (n_free,)."""
        return self.unknowns.free

    def load(self, time: float) -> Array:
        """Return the forces at a time [s], shape (n,) [N]."""
        total = np.zeros(self.mass.shape[0])
        for load in self.loads:
            total += load.ramp.at(time) * load.forces
        return total

    def prescribed(self, time: float) -> Array:
        """Return the displacements of the moving supports at a time [s], the last unknowns, shape (k,) [m]."""
        return np.array([component.at(time) for component in self.moving_supports])

    def constant_frames(self) -> Array | None:
        """Return the candidates' frames (n_c, dim, dim) [-] where they never turn; None where they do."""
        if not self.counterfaces.are_flat:
            return None
        return self.counterfaces.frames(self.candidates.positions, self.candidates.counterface)

    def moved(self, displacement: Array, counterfaces: Array) -> Array:
        """Return the displacement of the candidates relative to their counterfaces, shape (n_c, dim) [m].

        Parameters
        ----------
        displacement : (n,) array
            Displacement of the unknowns [m].
        counterfaces : (n_counterfaces, dim) array
            Prescribed displacement of the counterfaces [m].
        """
        moved: Array = (self.relative @ displacement).reshape(-1, self.space.dim)
        return moved - counterfaces[self.candidates.counterface] if counterfaces.size else moved


def build_system(model: Model, twin: System | None = None) -> System:
    """Check and assemble a model.

    Parameters
    ----------
    model : Model
        The model.
    twin : System, optional
        The system of a model with the same mesh, materials, supports and drives, whose matrices are taken over.

    Raises
    ------
    InputError
        For a model that cannot be computed; see :func:`fingerslip.dynamics.checks.check_model`.
    """
    known = checked(model, twin.space if twin else None)
    driven = [number for number, contact in enumerate(model.contacts) if contact.drive]
    rows = held_rows(known.held, known.space)
    moving = tuple(moving_components(model.support_motions, rows, list(known.held)))
    unknowns = Unknowns(known.free, np.array(driven, dtype=np.int64), tuple(own.dofs for own in moving))
    (stiffness, mass), held = _taken_over(twin) if twin else _matrices(model, known, unknowns, rows)
    candidates = join_candidates(list(known.candidates), known.space.dim)
    return System(
        space=known.space,
        materials=known.materials,
        unknowns=unknowns,
        coordinates=MeshCoordinates(unknowns, known.space.n_dofs),
        is_held=known.is_held,
        stiffness=stiffness,
        mass=mass,
        loads=_loads(model, known, unknowns),
        initial_velocity=_initial_velocity(model, known.space, unknowns),
        candidates=candidates,
        counterfaces=Counterfaces(known.counterfaces, tuple(contact.friction for contact in model.contacts)),
        relative=relative_operator(known.space, unknowns, candidates.nodes, candidates.counterface, known.counterfaces),
        outsiders=tuple(_outsiders(model, known, unknowns, number) for number in range(len(model.contacts))),
        motions=known.motions,
        site_nodes=known.site_nodes,
        supports=supports_of(rows, held, known.loads, candidates.nodes, known.space.dim),
        moving_supports=moving,
    )


def _drives(model: Model) -> list[Drive]:
    return [contact.drive for contact in model.contacts if contact.drive]


_Pair: TypeAlias = tuple[sparse.csr_matrix, sparse.csr_matrix]


def _taken_over(twin: System) -> tuple[_Pair, _Pair]:
    """Return stiffness and mass of a system on the mesh, and their rows at what supports hold."""
    held = twin.supports
    return (twin.stiffness, twin.mass), (sparse.csr_matrix(held.stiffness), sparse.csr_matrix(held.mass))


def _matrices(model: Model, known: CheckedModel, unknowns: Unknowns, rows: sparse.csr_matrix) -> tuple[_Pair, _Pair]:
    """Assemble stiffness and mass of the unknowns, and their rows at what supports hold."""
    space, free, drives = known.space, known.free, _drives(model)
    of_mesh = (
        stiffness_matrix(space, known.materials, model.depth, model.integration),
        mass_matrix(space, known.materials, model.depth),
    )
    expansion = unknowns.expansion(space.n_dofs)
    held = tuple(sparse.csr_matrix((rows @ matrix) @ expansion) for matrix in of_mesh)
    if unknowns.carried:
        stiffness, mass = (sparse.csr_matrix(expansion.T @ matrix @ expansion) for matrix in of_mesh)
        driven = unknowns.free.size + np.arange(len(drives))
        masses = np.array([drive.mass for drive in drives])
        mass += sparse.csr_matrix((masses, (driven, driven)), shape=mass.shape)
        return (stiffness, mass), (held[0], held[1])
    stiffness, mass = (matrix[free][:, free] for matrix in of_mesh)
    drawn = (
        sparse.block_diag([stiffness, *(sparse.csr_matrix((1, 1)) for _ in drives)], format="csr"),
        sparse.block_diag([mass, *([[drive.mass]] for drive in drives)], format="csr"),
    )
    return drawn, (held[0], held[1])


def _loads(model: Model, known: CheckedModel, unknowns: Unknowns) -> tuple[Load, ...]:
    """Return the loads on the unknowns: those on the mesh, then the forces of the drives."""
    on_mesh = [Load(unknowns.restrict(load.forces), load.ramp) for load in known.loads]
    drives, first = _drives(model), unknowns.free.size
    on_drives = [
        Load(drive.force * np.eye(1, unknowns.count, first + number)[0], drive.ramp)
        for number, drive in enumerate(drives)
    ]
    return (*on_mesh, *on_drives)


def _initial_velocity(model: Model, space: Space, unknowns: Unknowns) -> Array:
    velocity = np.tile(model.initial_velocity or (0.0,) * space.dim, len(space.positions))
    return np.concatenate([velocity[unknowns.free], np.zeros(unknowns.count - unknowns.free.size)])


def _outsiders(model: Model, known: CheckedModel, unknowns: Unknowns, number: int) -> Outsiders:
    space, shapes = known.space, known.counterfaces
    nodes = np.setdiff1d(carrying_nodes(space, model.contacts[number].boundary), known.candidates[number].nodes)
    relative = relative_operator(space, unknowns, nodes, np.full(nodes.size, number), shapes)
    return Outsiders(nodes, space.positions[nodes], relative)
