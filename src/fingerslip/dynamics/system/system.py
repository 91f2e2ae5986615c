"""The discrete system of a model: matrices, loads, contact candidates and their maps."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.contact.candidates import Candidates, Counterfaces, join_candidates
from fingerslip.dynamics.finite.body import Body
from fingerslip.dynamics.system.bodies import (
    Load,
    Motion,
    MovingComponent,
    Supports,
    held_rows,
    moving_components,
    rigid_freedoms,
)
from fingerslip.dynamics.system.checks import CheckedModel, inspect_model
from fingerslip.dynamics.system.doubts import doubts
from fingerslip.dynamics.system.operators import (
    Coordinates,
    Outsiders,
    Pose,
    Rotations,
    Unknowns,
    relative_operator,
    rotations_of,
)
from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.finite.bulk import large_strain
from fingerslip.fe.forms import ViscoelasticLayers, mass_matrix, stiffness_matrix, viscoelastic_layers
from fingerslip.fe.space import Space, carrying_nodes, vector_dofs
from fingerslip.materials.material import Material
from fingerslip.model.model import Model

_logger = logging.getLogger("fingerslip.dynamics")

# Rounding of forces, relative to the largest stiffness times the size of the body.
_ROUNDING = 1e-15


@dataclass(frozen=True)
class System:
    """A model's discrete system of n unknowns: those of the mesh, or the coordinates of a reduced body."""

    space: Space  # displacement space
    materials: CellMaterials[Material]  # material of every cell at small strain
    unknowns: Unknowns  # free degrees of freedom, free directions of rigid bodies and moving supports
    coordinates: Coordinates  # what the unknowns are and how fields are read from them
    # bodies with a rigid motion that inertia, supports and springs leave to the contact, as errors name them
    held_by_contact: tuple[str, ...]
    stiffness: sparse.csr_matrix  # (n, n) [N/m]
    mass: sparse.csr_matrix  # (n, n) [kg]
    loads: tuple[Load, ...]  # forces with their factors over time
    initial_velocity: Floats  # (n,), [m/s]
    candidates: Candidates  # contact candidates of all counterfaces
    counterfaces: Counterfaces  # the counterfaces and the friction on them
    relative: sparse.csr_matrix  # map (n_c * dim, n) to displacements of the candidates relative to their counterfaces
    outsiders: tuple[Outsiders, ...]  # for each counterface, the nodes of its boundary that are no candidates
    motions: tuple[Motion, ...]  # prescribed motion of each counterface
    site_nodes: Integers  # (n_sites,), mesh nodes of the recorded sites
    supports: Supports  # what acts on what supports hold
    # the components of supports that move as prescribed, the last unknowns
    moving_supports: tuple[MovingComponent, ...] = ()
    viscoelastic: tuple[ViscoelasticLayers, ...] = ()  # matrices (n, n) of the viscoelastic layers
    body: Body | None = None  # the deformable body at large strain
    dampers: Floats | None = None  # (n,) [N s/m]
    commanded: tuple[Load, ...] = ()  # forces that commands have added to the loads

    @cached_property
    def at_candidates(self) -> sparse.csr_matrix:
        """Map from forces of the candidates to those on the unknowns, shape (n, n_c * dim) [-]."""
        return sparse.csr_matrix(self.relative.T)

    @property
    def free(self) -> Integers:
        """Free degrees of freedom of the mesh, shape (n_free,)."""
        return self.unknowns.free

    @cached_property
    def size(self) -> float:
        """Size of the mesh [m]."""
        return float(np.ptp(self.space.positions, axis=0).max())

    @cached_property
    def rounding(self) -> float:
        """Force that is rounding [N], from the largest stiffness and the size of the body."""
        return _ROUNDING * self.size * float(np.abs(self.stiffness.diagonal()).max())

    def require_body(self) -> Body:
        """Return the deformable body at large strain, where there is one."""
        assert self.body is not None, "a system at small strain"
        return self.body

    def load(self, time: float) -> Floats:
        """Return the forces at a time [s], shape (n,) [N]."""
        return sum((load.at(time) for load in (*self.loads, *self.commanded)), np.zeros(self.mass.shape[0]))

    def displacements(self, time: float) -> Floats:
        """Return the prescribed displacement of every counterface at a time [s], shape (n_counterfaces, dim) [m]."""
        if not self.motions:
            return np.zeros((0, self.space.dim))
        return np.stack([motion.displacement(np.array([time]))[0] for motion in self.motions])

    def constant_frames(self) -> Floats | None:
        """Return the candidates' frames (n_c, dim, dim) [-] where they never turn; None where they do."""
        if not self.counterfaces.are_flat or self.rotations is not None:
            return None
        return self.counterfaces.frames(self.candidates.positions, self.candidates.counterface)

    def moved(self, displacement: Floats, counterfaces: Floats) -> Floats:
        """Return the displacement of the candidates relative to counterfaces (n_counterfaces, dim) [m], (n_c, dim) [m].

        Counterfaces of bodies that turn count as if they did not: :meth:`pose` has what rotations do.
        """
        moved: Floats = (self.relative @ displacement).reshape(-1, self.space.dim)
        return moved - counterfaces[self.candidates.counterface]

    @cached_property
    def rotations(self) -> Rotations | None:
        """The rotations of rigid bodies with counterfaces; None where none turns."""
        return rotations_of(self.unknowns.freedoms, self.coordinates.rigid, len(self.counterfaces.shapes))

    def pose(self, displacement: Floats, moved: Floats) -> Pose | None:
        """Return candidates that have moved by (n_c, dim) [m] as turned bodies see them; None where none turns."""
        if self.rotations is None:
            return None
        candidates = self.candidates
        return self.rotations.pose(
            displacement[self.rotations.at], candidates.positions + moved, candidates.counterface
        )

    def push(self, forces: Floats, pose: Pose | None) -> Floats:
        """Return forces (n_c, dim) on the candidates as forces on the unknowns, shape (n,) [N]."""
        nodal_forces: Floats = self.at_candidates @ forces.ravel()
        if self.rotations is not None and pose is not None:
            nodal_forces[self.rotations.at] = forces.ravel() @ pose.columns
        return nodal_forces


def build_system(model: Model, twin: System | None = None) -> System:
    """Check and assemble a model; one that shares its matrices with a twin takes them over."""
    checked_model = inspect_model(model, twin.space if twin else None)
    for doubt in doubts(model, checked_model):
        _logger.warning("%s", doubt.text)
    space = checked_model.space
    rows = held_rows(checked_model.held, space)
    moving = tuple(moving_components(model.support_motions, rows, list(checked_model.held)))
    carried = tuple(motion.dofs for motion in moving)
    unknowns = Unknowns(checked_model.free, space.n_dofs, rigid_freedoms(model), carried)
    if twin is None:
        (stiffness, mass, viscoelastic), of_held = _assemble(model, checked_model, unknowns, rows)
    else:
        stiffness, mass, viscoelastic = twin.stiffness, twin.mass, twin.viscoelastic
        of_held = twin.supports.stiffness, twin.supports.mass, twin.supports.viscoelastic
    candidates = join_candidates(list(checked_model.candidates), space.dim)
    dampers, springs = np.zeros((2, unknowns.count))
    dampers[unknowns.rigid] = [freedom.viscous(model.damping) for freedom in unknowns.freedoms]
    body = None
    if checked_model.finite_materials is not None:
        springs[unknowns.rigid] = [freedom.stiffness for freedom in unknowns.freedoms]
        bulk = large_strain(space, checked_model.finite_materials, model.depth, model.integration)
        body = Body(bulk, unknowns, springs)
    return System(
        space=space,
        materials=checked_model.materials,
        unknowns=unknowns,
        coordinates=unknowns,
        held_by_contact=checked_model.held_by_contact,
        stiffness=stiffness,
        mass=mass,
        loads=_loads(checked_model, unknowns),
        initial_velocity=_initial_velocity(model, space, unknowns),
        candidates=candidates,
        counterfaces=Counterfaces(checked_model.counterfaces, tuple(contact.friction for contact in model.contacts)),
        relative=relative_operator(space, unknowns, candidates.nodes, candidates.counterface),
        outsiders=tuple(_outsiders(model, checked_model, unknowns, number) for number in range(len(model.contacts))),
        motions=checked_model.motions,
        site_nodes=checked_model.site_nodes,
        supports=Supports(
            rows,
            stiffness=of_held[0],
            mass=of_held[1],
            contact=sparse.csr_matrix(rows[:, vector_dofs(candidates.nodes, space.dim).ravel()]),
            loads=tuple(Load(rows @ load.forces, load.ramp) for load in checked_model.loads),
            viscoelastic=of_held[2],
        ),
        moving_supports=moving,
        viscoelastic=viscoelastic,
        body=body,
        dampers=dampers if dampers.any() else None,
    )


#: Stiffness, mass and viscoelastic layers.
_Matrices = tuple[sparse.csr_matrix | Floats, sparse.csr_matrix | Floats, tuple[ViscoelasticLayers, ...]]


def _assemble(
    model: Model, checked_model: CheckedModel, unknowns: Unknowns, rows: sparse.csr_matrix
) -> tuple[_Matrices, _Matrices]:
    """Assemble the matrices of the unknowns, and their rows at what supports hold.

    There are no viscoelastic layers at large strain, where the body itself remembers.
    """
    space, expansion = checked_model.space, unknowns.expansion
    of_rigid = np.array([(freedom.stiffness, freedom.mass) for freedom in unknowns.freedoms]).reshape(-1, 2).T
    of_mesh = (
        stiffness_matrix(space, checked_model.materials, model.depth, model.integration),
        mass_matrix(space, checked_model.materials, model.depth),
    )
    layers: Sequence[ViscoelasticLayers] = ()
    if checked_model.finite_materials is None:
        layers = viscoelastic_layers(space, checked_model.materials, model.depth, model.integration)
    stiffness, mass = map(unknowns.project, of_mesh, of_rigid)
    held = [sparse.csr_matrix((rows @ matrix) @ expansion) for matrix in of_mesh]
    viscoelastic = tuple(layer.apply_map(unknowns.project) for layer in layers)
    of_held = held[0], held[1], tuple(layer.apply_map(lambda matrix: rows @ matrix @ expansion) for layer in layers)
    return (stiffness, mass, viscoelastic), of_held


def _loads(checked_model: CheckedModel, unknowns: Unknowns) -> tuple[Load, ...]:
    """Return the loads on the unknowns: those on the mesh, then those on rigid bodies."""
    on_mesh = [Load(unknowns.restrict(load.forces), load.ramp) for load in checked_model.loads]
    on_bodies = [
        Load(value * np.eye(1, unknowns.count, at)[0], ramp)
        for at, freedom in zip(unknowns.rigid, unknowns.freedoms, strict=True)
        for value, ramp in freedom.loads
    ]
    return (*on_mesh, *on_bodies)


def _initial_velocity(model: Model, space: Space, unknowns: Unknowns) -> Floats:
    velocity = np.tile(model.initial_velocity or (0.0,) * space.dim, len(space.positions))
    of_rigid = [freedom.velocity for freedom in unknowns.freedoms]
    return np.concatenate([velocity[unknowns.free], of_rigid, np.zeros(len(unknowns.carried))])


def _outsiders(model: Model, checked_model: CheckedModel, unknowns: Unknowns, number: int) -> Outsiders:
    space = checked_model.space
    nodes = np.setdiff1d(carrying_nodes(space, model.contacts[number].boundary), checked_model.candidates[number].nodes)
    relative = relative_operator(space, unknowns, nodes, np.full(nodes.size, number))
    return Outsiders(nodes, space.positions[nodes], relative, model.contacts[number].search_distance)
