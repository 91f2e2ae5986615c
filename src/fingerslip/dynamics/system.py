"""From a model to matrices, loads, supports and contact candidates: all checks happen here."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.bodies import Plane
from fingerslip.contact.candidates import Candidates, automatic_penalty, find_candidates, join_candidates
from fingerslip.dynamics.motion import Motion, body_motion, largest_approach, phase_table
from fingerslip.errors import InputError
from fingerslip.fe.assembly import CellConstants, cell_constants, mass_matrix, stiffness_matrix, traction_load
from fingerslip.fe.space import Space, boundary_nodes, build_space, nodal_areas, region_nodes, vector_dofs
from fingerslip.mesh.sites import site_nodes
from fingerslip.model import Contact, Model, Slide

__all__ = ["System", "build_system", "check_model"]

Array = NDArray[np.float64]

# Candidates lie within this many times the way that the plate comes forward: the skin beside the contact
# bulges towards the plate and rolls onto it while sliding.
_REACH = 1.5


@dataclass(frozen=True)
class System:
    """A model's discrete system; matrices and vectors are on the free degrees of freedom.

    Parameters
    ----------
    space : Space
        Displacement space.
    constants : CellConstants
        Material of every cell.
    free : (n,) array
        Free degrees of freedom among all.
    stiffness, mass : sparse matrix, shape (n, n)
        [N/m], [kg].
    load : (n,) array
        Nodal forces of the tractions [N].
    candidates : Candidates
        Contact candidates of all bodies.
    local : sparse matrix, shape (n_c * dim, n)
        Displacement of the candidates in their bodies' frames.
    outsiders : tuple of arrays
        For each body, nodes of its boundary that are no candidates.
    outsider_normals : tuple of sparse matrices, shape (n_outsiders, n)
        Their displacement along the body's normal.
    planes : tuple of Plane
        The rigid bodies.
    offsets : tuple of float
        Offset of each plane at the start [m].
    motions : tuple of Motion
        Motion of each body.
    site_nodes : (n_sites,) array
        Mesh nodes of the recorded sites.
    """

    space: Space
    constants: CellConstants
    free: NDArray[np.int64]
    stiffness: sparse.csr_matrix
    mass: sparse.csr_matrix
    load: Array
    candidates: Candidates
    local: sparse.csr_matrix
    outsiders: tuple[NDArray[np.int64], ...]
    outsider_normals: tuple[sparse.csr_matrix, ...]
    planes: tuple[Plane, ...]
    offsets: tuple[float, ...]
    motions: tuple[Motion, ...]
    site_nodes: NDArray[np.int64]


@dataclass(frozen=True)
class _Checked:
    """What the checks have found out, before anything is assembled."""

    space: Space
    constants: CellConstants
    free: NDArray[np.int64]
    load: Array
    motions: tuple[Motion, ...]
    offsets: tuple[float, ...]
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


def build_system(model: Model) -> System:
    """Check and assemble a model."""
    known = _check(model)
    space = known.space
    free = known.free
    stiffness = stiffness_matrix(space, known.constants, model.depth, model.integration)
    mass = mass_matrix(space, known.constants, model.depth)
    candidates = join_candidates(list(known.candidates), space.dim)
    outsiders = [
        np.setdiff1d(boundary_nodes(space, contact.boundary), own.nodes)
        for contact, own in zip(model.contacts, known.candidates, strict=True)
    ]
    return System(
        space=space,
        constants=known.constants,
        free=free,
        stiffness=stiffness[free][:, free].tocsr(),
        mass=mass[free][:, free].tocsr(),
        load=known.load[free],
        candidates=candidates,
        local=candidates.local_operator(space.n_dofs)[:, free].tocsr(),
        outsiders=tuple(outsiders),
        outsider_normals=tuple(
            _normal_operator(nodes, contact.body, space.n_dofs)[:, free].tocsr()
            for nodes, contact in zip(outsiders, model.contacts, strict=True)
        ),
        planes=tuple(contact.body for contact in model.contacts),
        offsets=known.offsets,
        motions=known.motions,
        site_nodes=known.site_nodes,
    )


def _check(model: Model) -> _Checked:
    space = build_space(model.mesh)
    constants = cell_constants(space, model.materials, model.formulation)
    _check_normals(model, space)
    motions = tuple(body_motion(model.programme, contact.body) for contact in model.contacts)
    candidates = tuple(
        _candidates(model, space, number, contact, motion)
        for number, (contact, motion) in enumerate(zip(model.contacts, motions, strict=True))
    )
    offsets = tuple(_offset(space, contact) for contact in model.contacts)
    _check_order(model, motions, candidates)
    return _Checked(
        space=space,
        constants=constants,
        free=_free_dofs(model, space),
        load=traction_load(space, model.tractions, model.depth),
        motions=motions,
        offsets=offsets,
        candidates=candidates,
        site_nodes=site_nodes(model.mesh, model.record.sites),
    )


def _check_normals(model: Model, space: Space) -> None:
    for number, normal in enumerate(contact.body.normal for contact in model.contacts):
        if len(normal) != space.dim:
            raise InputError(f"contacts.{number}.body.normal", f"got {len(normal)} components", f"needs {space.dim}")


def _free_dofs(model: Model, space: Space) -> NDArray[np.int64]:
    fixed = [np.zeros(0, dtype=np.int64)]
    for name, components in model.supports.items():
        if "z" in components and space.dim == 2:
            raise InputError(f"supports.{name}", "got component 'z'", "needs x or y: the mesh is two-dimensional")
        is_region = name not in (space.mesh.boundaries or {}) and name in (space.mesh.subdomains or {})
        nodes = region_nodes(space, name) if is_region else boundary_nodes(space, name)
        axes = ["xyz".index(component) for component in components]
        fixed.append(vector_dofs(nodes, space.dim)[:, axes].ravel())
    free = np.setdiff1d(np.arange(space.n_dofs), np.concatenate(fixed))
    if not free.size:
        raise InputError("supports", "fix every degree of freedom", "something has to be free to move")
    return free


def _offset(space: Space, contact: Contact) -> float:
    if contact.body.offset is not None:
        return contact.body.offset
    return contact.body.touching_offset(space.positions[boundary_nodes(space, contact.boundary)])


def _candidates(model: Model, space: Space, number: int, contact: Contact, motion: Motion) -> Candidates:
    where = f"contacts.{number}"
    nodes, areas = boundary_nodes(space, contact.boundary), nodal_areas(space, contact.boundary, model.depth)
    approach = largest_approach(motion, contact.body)
    size = float(np.ptp(space.positions, axis=0).max())
    return find_candidates(
        contact.body,
        space.positions,
        nodes,
        areas,
        body=number,
        reach=contact.reach if contact.reach is not None else _automatic_reach(model, approach, size),
        friction_coefficient=contact.friction.coefficient,
        penalties=_penalties(model, space, contact),
        where=where,
    )


def _automatic_reach(model: Model, approach: float, size: float) -> float:
    """Return the largest initial gap of a candidate [m]; tractions may press any part onto the plate."""
    return np.inf if model.tractions else _REACH * approach + 1e-6 * size


def _penalties(model: Model, space: Space, contact: Contact) -> tuple[float, float]:
    """Return normal and tangential penalty [Pa/m], automatic ones from the stiffest material under the boundary."""
    facets = np.asarray(space.mesh.boundaries[contact.boundary])
    cells = space.mesh.f2t[0, facets]
    names = [name for name, own in space.mesh.subdomains.items() if np.isin(cells, own).any()]
    modulus = max(model.materials[name].youngs_modulus for name in names)
    ends = space.mesh.p[:, space.mesh.facets[:, facets]]
    size = float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0)))
    automatic = automatic_penalty(modulus, size)
    return contact.normal_penalty or automatic, contact.tangential_penalty or automatic


def _normal_operator(nodes: NDArray[np.int64], plane: Plane, n_dofs: int) -> sparse.csr_matrix:
    """Return the map from displacements (n_dofs,) to those of `nodes` along a plane's normal."""
    normal = plane.unit_normal
    rows = np.repeat(np.arange(nodes.size), normal.size)
    columns = vector_dofs(nodes, normal.size).ravel()
    return sparse.csr_matrix((np.tile(normal, nodes.size), (rows, columns)), shape=(nodes.size, n_dofs))


def _check_order(model: Model, motions: tuple[Motion, ...], candidates: tuple[Candidates, ...]) -> None:
    """Refuse a programme that slides before any body can touch."""
    first_slide = next((i for i, phase in enumerate(model.programme) if isinstance(phase, Slide)), None)
    if first_slide is None or not model.contacts or model.tractions:
        return
    for contact, motion, own in zip(model.contacts, motions, candidates, strict=True):
        approach = float(np.max(motion.positions[: first_slide + 1] @ contact.body.unit_normal))
        if approach > own.gap.min():
            return
    kinds = ", ".join(phase_table(model.programme)[0])
    raise InputError(
        "programme",
        f"slides before the plate touches (phases: {kinds})",
        "needs contact before the first slide",
        "put a press before it that is deeper than the gap",
    )
