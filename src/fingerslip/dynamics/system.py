"""From a model to matrices, loads, supports and contact candidates: all checks happen here."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.candidates import (
    Candidates,
    Counterfaces,
    automatic_penalty,
    find_candidates,
    join_candidates,
    node_operator,
)
from fingerslip.contact.counterfaces import Counterface
from fingerslip.contact.friction import Anisotropic
from fingerslip.dynamics.loads import Load, model_loads
from fingerslip.dynamics.motion import Motion, counterface_motion, largest_approach, phase_table
from fingerslip.errors import InputError
from fingerslip.fe.cell_materials import CellMaterials, cell_materials
from fingerslip.fe.forms import mass_matrix, stiffness_matrix
from fingerslip.fe.space import (
    Space,
    boundary_nodes,
    build_space,
    carrying_nodes,
    nodal_areas,
    region_nodes,
    vector_dofs,
)
from fingerslip.mesh.site_nodes import site_nodes
from fingerslip.model import Contact, Model, QuasiStatic, Slide

__all__ = ["Outsiders", "System", "build_system", "check_model"]

Array = NDArray[np.float64]

# Candidates lie within this many times the way that the plate comes forward: the skin beside the contact
# bulges towards the plate and rolls onto it while sliding.
_SEARCH = 1.5

# Of the soft thickness. A mean strain of a half is small in no sense (the published press is less than a third); one
# of 99 % leaves nothing that could be a body.
_LARGEST_SHARE = 0.5
_WHOLE_SHARE = 0.99

_logger = logging.getLogger("fingerslip.dynamics")


@dataclass(frozen=True)
class Outsiders:
    """Nodes of a body's boundary that are no candidates and must not reach it.

    Parameters
    ----------
    nodes : (k,) array
        Mesh nodes.
    positions : (k, dim) array
        Reference positions [m].
    relative : sparse matrix, shape (k * dim, n)
        Their displacement relative to what the counterface's drive adds to its prescribed motion.
    """

    nodes: NDArray[np.int64]
    positions: Array
    relative: sparse.csr_matrix


@dataclass(frozen=True)
class System:
    """A model's discrete system.

    Its unknowns are the free degrees of freedom of the mesh, then one for every counterface that a force drives:
    n altogether.

    Parameters
    ----------
    space : Space
        Displacement space.
    materials : CellMaterials
        Material of every cell.
    free : (n_free,) array
        Free degrees of freedom of the mesh among all of it.
    driven : (n_driven,) array
        Indices of the counterfaces that a force drives.
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
        Displacement of the candidates relative to what the drives add to the counterfaces' prescribed motion.
    outsiders : tuple of Outsiders
        For each counterface, the nodes of its boundary that are no candidates.
    motions : tuple of Motion
        Prescribed motion of each counterface.
    site_nodes : (n_sites,) array
        Mesh nodes of the recorded sites.
    """

    space: Space
    materials: CellMaterials
    free: NDArray[np.int64]
    driven: NDArray[np.int64]
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

    def load(self, time: float) -> Array:
        """Return the forces at a time [s], shape (n,) [N]."""
        total = np.zeros(self.mass.shape[0])
        for load in self.loads:
            total += load.ramp.at(time) * load.forces
        return total


@dataclass(frozen=True)
class _Checked:
    """What the checks have found out, before anything is assembled."""

    space: Space
    materials: CellMaterials
    free: NDArray[np.int64]
    loads: tuple[Load, ...]
    counterfaces: tuple[Counterface, ...]
    motions: tuple[Motion, ...]
    candidates: tuple[Candidates, ...]
    site_nodes: NDArray[np.int64]


def check_model(model: Model) -> None:
    """Find out whether a model can be computed, without assembling or solving.

    Raises
    ------
    InputError
        For anything that cannot: names that the mesh lacks, materials that are missing or cannot be
        represented, a plate that starts inside the body, a slide before contact, sites outside the mesh.
    """
    _check(model)


def build_system(model: Model, twin: System | None = None) -> System:
    """Check and assemble a model.

    Parameters
    ----------
    model : Model
        The model.
    twin : System, optional
        The system of a model with the same mesh, materials, supports and drives, whose matrices are taken over.
    """
    known = _check(model, twin.space if twin else None)
    space, free = known.space, known.free
    driven = np.array([i for i, contact in enumerate(model.contacts) if contact.drive], dtype=np.int64)
    stiffness, mass = (twin.stiffness, twin.mass) if twin else _matrices(model, known)
    candidates = join_candidates(list(known.candidates), space.dim)

    def picked(nodes: NDArray[np.int64]) -> sparse.csr_matrix:
        return node_operator(nodes, space.dim, space.n_dofs)[:, free]

    outsiders = [
        np.setdiff1d(carrying_nodes(space, contact.boundary), own.nodes)
        for contact, own in zip(model.contacts, known.candidates, strict=True)
    ]
    return System(
        space=space,
        materials=known.materials,
        free=free,
        driven=driven,
        stiffness=stiffness,
        mass=mass,
        loads=tuple(_on_unknowns(load, free, driven.size) for load in known.loads) + _drive_loads(model, free.size),
        initial_velocity=_initial_velocity(model, space, free, driven.size),
        candidates=candidates,
        counterfaces=Counterfaces(known.counterfaces, tuple(contact.friction for contact in model.contacts)),
        relative=_relative_operator(picked(candidates.nodes), candidates.counterface, driven, known.counterfaces),
        outsiders=tuple(
            Outsiders(
                nodes,
                space.positions[nodes],
                _relative_operator(picked(nodes), np.full(nodes.size, number), driven, known.counterfaces),
            )
            for number, nodes in enumerate(outsiders)
        ),
        motions=known.motions,
        site_nodes=known.site_nodes,
    )


def _matrices(model: Model, known: _Checked) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Assemble stiffness and mass of the unknowns."""
    space, free = known.space, known.free
    drives = [contact.drive for contact in model.contacts if contact.drive]
    mass = mass_matrix(space, known.materials, model.depth)[free][:, free]
    stiffness = stiffness_matrix(space, known.materials, model.depth, model.integration)[free][:, free]
    return (
        sparse.block_diag([stiffness, *(sparse.csr_matrix((1, 1)) for _ in drives)], format="csr"),
        sparse.block_diag([mass, *([[drive.mass]] for drive in drives)], format="csr"),
    )


def _check(model: Model, space: Space | None = None) -> _Checked:
    space = space or build_space(model.mesh)
    materials = cell_materials(space, model.materials, model.formulation)
    _check_contacts(model, space)
    counterfaces = tuple(
        contact.counterface.placed(space.positions[boundary_nodes(space, contact.boundary)])
        for contact in model.contacts
    )
    motions = tuple(
        counterface_motion(
            programme, contact.counterface, "programme" if contact.programme is None else f"contacts.{n}.programme"
        )
        for n, (contact, programme) in enumerate(zip(model.contacts, model.programmes, strict=False))
    )
    candidates = tuple(
        _candidates(model, space, number, counterface, motion)
        for number, (counterface, motion) in enumerate(zip(counterfaces, motions, strict=True))
    )
    _check_order(model, counterfaces, motions, candidates)
    free = _free_dofs(model, space)
    _check_depth(model, space, counterfaces, motions, free)
    return _Checked(
        space=space,
        materials=materials,
        free=free,
        loads=model_loads(model, space, materials),
        counterfaces=counterfaces,
        motions=motions,
        candidates=candidates,
        site_nodes=site_nodes(model.mesh, model.record.sites),
    )


def _check_contacts(model: Model, space: Space) -> None:
    """Refuse counterfaces and friction laws of another dimension than the mesh, and drives without inertia."""
    for number, contact in enumerate(model.contacts):
        where = f"contacts.{number}"
        if contact.counterface.dim != space.dim:
            raise InputError(
                f"{where}.counterface.normal", f"got {contact.counterface.dim} components", f"needs {space.dim}"
            )
        if isinstance(contact.friction, Anisotropic) and space.dim == 2:
            raise InputError(f"{where}.friction", "got Anisotropic in the plane", "needs a model in space")
        if contact.drive and isinstance(model.time, QuasiStatic):
            found = "got a body that a force drives in a quasi-static model"
            raise InputError(f"{where}.drive", found, "needs prescribed motion", "take TimeStepping")


def _programme_name(contact: Contact, number: int) -> str:
    """Return how errors call the programme of a contact."""
    return "programme" if contact.programme is None else f"contacts.{number}.programme"


def _free_dofs(model: Model, space: Space) -> NDArray[np.int64]:
    fixed = [np.zeros(0, dtype=np.int64)]
    for name, components in model.supports.items():
        beyond = [component for component in components if component not in "xyz"[: space.dim]]
        if beyond:
            raise InputError(f"supports.{name}", f"got component '{beyond[0]}'", f"needs {_axes(space.dim)}")
        is_region = name not in (space.mesh.boundaries or {}) and name in (space.mesh.subdomains or {})
        nodes = region_nodes(space, name) if is_region else boundary_nodes(space, name)
        axes = ["xyz".index(component) for component in components]
        fixed.append(vector_dofs(nodes, space.dim)[:, axes].ravel())
    free = np.setdiff1d(np.arange(space.n_dofs), np.concatenate(fixed))
    if not free.size:
        raise InputError("supports", "fix every degree of freedom", "something has to be free to move")
    return free


def _axes(dim: int) -> str:
    return " or ".join("xyz"[:dim]) if dim == 2 else "x, y or z"


def _on_unknowns(load: Load, free: NDArray[np.int64], n_driven: int) -> Load:
    """Restrict a load on the mesh to the unknowns."""
    return Load(np.concatenate([load.forces[free], np.zeros(n_driven)]), load.ramp)


def _drive_loads(model: Model, n_free: int) -> tuple[Load, ...]:
    drives = [contact.drive for contact in model.contacts if contact.drive]
    units = np.eye(len(drives))
    return tuple(
        Load(np.concatenate([np.zeros(n_free), drive.force * unit]), drive.ramp)
        for drive, unit in zip(drives, units, strict=True)
    )


def _initial_velocity(model: Model, space: Space, free: NDArray[np.int64], n_driven: int) -> Array:
    velocity = model.initial_velocity or (0.0,) * space.dim
    if len(velocity) != space.dim:
        raise InputError("initial_velocity", f"got {len(velocity)} components", f"needs {space.dim}")
    return np.concatenate([np.tile(velocity, len(space.positions))[free], np.zeros(n_driven)])


def _relative_operator(
    of_mesh: sparse.csr_matrix,
    counterface: NDArray[np.int64],
    driven: NDArray[np.int64],
    counterfaces: tuple[Counterface, ...],
) -> sparse.csr_matrix:
    """Return the map from the unknowns to displacements of nodes relative to their driven counterfaces.

    `of_mesh` is the map to their displacements, `counterface` says which counterface each node may touch.
    """
    columns = [
        -((counterface == number)[:, None] * counterfaces[number].unit_normal[None, :]).reshape(-1, 1)
        for number in driven
    ]
    return sparse.csr_matrix(sparse.hstack([of_mesh, *(sparse.csr_matrix(column) for column in columns)]))


def _candidates(model: Model, space: Space, number: int, counterface: Counterface, motion: Motion) -> Candidates:
    contact = model.contacts[number]
    nodes, areas = boundary_nodes(space, contact.boundary), nodal_areas(space, contact.boundary, model.depth)
    size = float(np.ptp(space.positions, axis=0).max())
    automatic = np.inf if model.is_loaded else _SEARCH * largest_approach(motion, counterface) + 1e-6 * size
    return find_candidates(
        counterface,
        space.positions,
        nodes,
        areas,
        counterface=number,
        search_distance=automatic if contact.search_distance is None else contact.search_distance,
        penalties=contact_penalties(model, contact),
        where=f"contacts.{number}",
    )


def contact_penalties(model: Model, contact: Contact) -> tuple[float, float]:
    """Return normal and tangential penalty of a contact [Pa/m].

    Automatic ones follow from the stiffest material under the boundary and the size of its facets.

    Parameters
    ----------
    model : Model
        The model.
    contact : Contact
        One of its contacts.
    """
    mesh = model.mesh
    facets = np.asarray(mesh.boundaries[contact.boundary])
    cells = mesh.f2t[0, facets]
    names = [name for name, own in mesh.subdomains.items() if np.isin(cells, own).any()]
    stiffness = max(model.materials[name].stiffness for name in names)
    ends = mesh.p[:, mesh.facets[:2, facets]]
    size = float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0)))
    automatic = automatic_penalty(stiffness, size)
    return contact.normal_penalty or automatic, contact.tangential_penalty or automatic


def _check_order(
    model: Model, counterfaces: tuple[Counterface, ...], motions: tuple[Motion, ...], candidates: tuple[Candidates, ...]
) -> None:
    """Refuse programmes that slide before any counterface can touch."""
    sliding = [any(isinstance(phase, Slide) for phase in programme) for programme in model.programmes]
    if not model.contacts or model.is_loaded or not any(sliding):
        return
    for programme, counterface, motion, own in zip(model.programmes, counterfaces, motions, candidates, strict=True):
        first = next((i for i, phase in enumerate(programme) if isinstance(phase, Slide)), len(programme))
        approach = float(np.max(motion.positions[: first + 1] @ counterface.unit_normal))
        if approach > counterface.gap(own.positions).min():
            return
    kinds = ", ".join(phase_table(model.programme)[0])
    raise InputError(
        "programme",
        f"slides before the plate touches (phases: {kinds})",
        "needs contact before the first slide",
        "put a press before it that is deeper than the gap",
    )


def _check_depth(
    model: Model,
    space: Space,
    counterfaces: tuple[Counterface, ...],
    motions: tuple[Motion, ...],
    free: NDArray[np.int64],
) -> None:
    """Refuse motion that brings a counterface through what is held, and warn where strains cannot be small."""
    held = ~np.isin(vector_dofs(np.arange(len(space.positions)), space.dim), free)
    for number, (contact, counterface, motion) in enumerate(zip(model.contacts, counterfaces, motions, strict=True)):
        skin = boundary_nodes(space, contact.boundary)
        stopped: NDArray[np.bool_] = np.all(held[:, np.abs(counterface.unit_normal) > 1e-9], axis=1)
        lowest = float(counterface.gap(space.positions[skin]).min())
        inner = stopped & ~np.isin(np.arange(len(stopped)), skin)
        behind = space.positions[inner & (counterface.gap(space.positions) > lowest)]
        # Where the contact is held itself, nothing gives way and the penalties take the press up.
        if stopped[skin].all() or not len(behind):
            continue
        thickness = float(counterface.gap(behind).min()) - lowest
        left = min(float(counterface.gap(behind - position).min()) for position in motion.positions)
        where = _programme_name(contact, number)
        _judge_depth(where, thickness - left, thickness)


def _judge_depth(where: str, depth: float, thickness: float) -> None:
    between = f"the {thickness * 1e3:.4g} mm between the contact and what the supports hold"
    if depth > _WHOLE_SHARE * thickness:
        found = f"presses {depth * 1e3:.4g} mm deep"
        allowed = f"needs less than {between}"
        raise InputError(where, found, allowed, "press less deep; strains are taken as small, so stay far below it")
    if depth > _LARGEST_SHARE * thickness:
        _logger.warning(
            "%s: presses %.4g mm deep, %.0f %% of %s; strains are taken as small, so results are rough",
            *(where, depth * 1e3, 100 * depth / thickness, between),
        )
