"""What an elastic body without inertia answers to contact forces: computed once, for any number of motions.

The surface that may touch is divided into patches, in each of which the traction is constant: a patch moves by the
mean of its nodes, weighted by their areas. With the stiffness K of the body at small strain and B, which takes these
means, all that contact forces f do follows from few rows of K^-1::

    displacement of the patches     C f,   C = B K^-1 B^T
    of sites and of watched nodes   S f,   S = B_s K^-1 B^T

so that a quasi-static step costs its contact problem, and no substitution. Where each patch is one node, the motion is
that of any other simulation; larger patches are an approximation of the contact, and of nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import ConvexHull, cKDTree

from fingerslip.contact.candidates import node_operator
from fingerslip.dynamics.system.system import System, build_system
from fingerslip.errors import InputError
from fingerslip.fe.space import carrying_nodes, nodal_areas
from fingerslip.linear.solver import LinearSolver, preferred_solver
from fingerslip.model.model import Model
from fingerslip.model.timing import QuasiStatic

__all__ = ["StaticBody", "depth_in_hull", "patches", "static_body"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Facets of the hull that face the plane less than this (cosine) are the sides and the back of the body.
_FACING = 0.05
# Times that the middles of patches move to the middle of their nodes.
_ROUNDS = 4


def depth_in_hull(points: Floats, normal: Floats) -> Floats:
    """Return how deep points lie inside their convex hull, seen from a plane, shape (n,) [m].

    A plane touches a body at rest where this is zero. Where the body gives way, it comes to touch what lies a little
    deeper; the bottom of a groove is as deep as the groove.

    Arrays: points (n, dim) [m]; normal (dim,) [-].

    Examples
    --------
    A groove between two crowns, above a plane:

    >>> ridges = np.array([[-9.0, 9.0], [-5.0, 0.0], [0.0, 3.0], [5.0, 0.0], [9.0, 9.0]])
    >>> depth_in_hull(ridges, np.array([0.0, 1.0])).round(9).tolist()
    [0.0, 0.0, 3.0, 0.0, 0.0]
    """
    equations = ConvexHull(points).equations
    facing = equations[equations[:, :-1] @ normal < -_FACING]
    deep: Floats = (-(points @ facing[:, :-1].T) - facing[:, -1]).min(axis=1)
    return np.maximum(deep, 0.0)


def patches(points: Floats, area: Floats, distance: float) -> tuple[Integers, sparse.csr_matrix]:
    """Divide nodes into patches of about one size, those nearest to each of some middles.

    Arrays: points (n, dim) [m]; area (n,) [m^2]; distance [m]; returns middles (k,); means [-].

    Examples
    --------
    >>> line = np.column_stack([np.arange(4.0), np.zeros(4)])
    >>> middles, means = patches(line, np.array([1.0, 1.0, 1.0, 3.0]), 1.5)
    >>> means.toarray().round(2).tolist()
    [[0.5, 0.5, 0.0, 0.0], [0.0, 0.0, 0.25, 0.75]]
    """
    places = points[_apart(points, distance)]
    for _ in range(_ROUNDS):
        owner = cKDTree(places).query(points)[1]
        places = np.asarray(_means(owner, area) @ points)
    owner = cKDTree(places).query(points)[1]
    means = _means(owner, area)
    nearest: Integers = cKDTree(points).query(np.asarray(means @ points))[1].astype(np.int64)
    return nearest, means


def _apart(points: Floats, distance: float) -> Integers:
    """Return points in order of which each is at least a distance from all before it."""
    if distance <= 0.0:
        return np.arange(len(points))
    tree, free = cKDTree(points), np.ones(len(points), dtype=bool)
    chosen = []
    for number in range(len(points)):
        if free[number]:
            chosen.append(number)
            free[tree.query_ball_point(points[number], distance)] = False
    return np.array(chosen)


def _means(owner: NDArray[np.intp], area: Floats) -> sparse.csr_matrix:
    """Return the map (k, n) that takes the means of what belongs to each of k owners; those of nothing are left out."""
    number = np.unique(owner, return_inverse=True)[1]
    summed = sparse.csr_matrix((area, (number, np.arange(len(area)))))
    return sparse.csr_matrix(sparse.diags(1.0 / np.asarray(summed.sum(axis=1)).ravel()) @ summed)


# Right-hand sides at once: fewer take longer, more take memory.
_AT_ONCE = 32


@dataclass(frozen=True)
class StaticBody:
    """A body by its answers to forces on the patches that may touch."""

    nodes: Integers  # (n_p,), the mesh node in the middle of each patch
    positions: Floats  # (n_p, 3), where the patches are, by the mean of their nodes [m]
    area: Floats  # (n_p,), their areas [m^2]
    compliance: Floats  # (n_p * 3, n_p * 3), C, symmetric [m/N]
    at_sites: Floats  # (n_sites * 3, n_p * 3), S of the recorded sites [m/N]
    watched: Floats  # (n_w, 3), where the other nodes of the boundary are that must not touch [m]
    at_watched: Floats  # (n_w * 3, n_p * 3), S of these [m/N]


def static_body(
    model: Model, *, reach: float, hidden: float, patch: float = 0.0, solver: LinearSolver | None = None
) -> StaticBody:
    """Compute what the body of a model answers to forces on the surface that its counterface may touch.

    Units: reach [m]; hidden [m]; patch [m].
    """
    _check_kind(model)
    stiffness, reads, body = _surface(model, reach, hidden, patch)
    answers = _answers(stiffness, reads, solver or preferred_solver())
    return replace(body, compliance=answers[0], at_sites=answers[1], at_watched=answers[2])


def _surface(
    model: Model, reach: float, hidden: float, patch: float
) -> tuple[sparse.csr_matrix, list[sparse.csr_matrix], StaticBody]:
    """Return stiffness, maps from the n unknowns to patches, sites and watched nodes, and the body without its answers.

    The rest of the system of a model, as large as the stiffness, ends with this call.
    """
    system = build_system(model)
    area, positions = nodal_areas(system.space, model.contacts[0].boundary, model.depth), system.space.positions
    remaining, others = _split_boundary(model, system, reach, hidden)
    middles, means = patches(positions[remaining], area[remaining], patch)
    expansion = system.unknowns.expansion(system.space.n_dofs)
    of_nodes, at_sites, at_others = (
        sparse.csr_matrix(node_operator(nodes, system.space.dim, system.space.n_dofs) @ expansion)
        for nodes in (remaining, system.site_nodes, others)
    )
    of_patches = sparse.csr_matrix(sparse.kron(means, sparse.eye(system.space.dim)) @ of_nodes)
    total, none = np.asarray((means > 0).astype(float) @ area[remaining]), np.zeros((0, 0))
    nodes, places = remaining[middles], means @ positions[remaining]
    body = StaticBody(nodes, places, total, none, none, positions[others], none)
    return system.stiffness, [of_patches, at_sites, at_others], body


def _check_kind(model: Model) -> None:
    """Refuse what cannot be condensed once for all."""
    wrong = {
        "kinematics": (model.is_finite, "is finite", "needs small"),
        "time": (not isinstance(model.time, QuasiStatic), "has inertia", "needs scheme: quasi_static"),
        "contacts": (len(model.contacts) != 1, f"has {len(model.contacts)}", "needs one"),
        "loads": (model.is_loaded or bool(model.support_motions), "act beside the contact", "needs none"),
        "bodies": (bool(model.bodies), "has rigid bodies", "needs none"),
        "mesh": (model.mesh.dim() != 3, f"has {model.mesh.dim()} dimensions", "needs a solid"),
    }
    for where, (is_wrong, got, allowed) in wrong.items():
        if is_wrong:
            raise InputError(where, got, allowed, "simulate the model step by step")


def _split_boundary(model: Model, system: System, reach: float, hidden: float) -> tuple[Integers, Integers]:
    """Return the nodes of the boundary that may touch, and the others within reach."""
    if system.viscoelastic:
        raise InputError("materials", "relax", "needs elastic ones", "simulate the model step by step")
    plane = system.counterfaces.shapes[0]
    if not plane.is_flat:
        raise InputError("contacts.0.counterface", "is curved", "needs a plane", "simulate the model step by step")
    nodes = carrying_nodes(system.space, model.contacts[0].boundary)
    points = system.space.positions[nodes]
    near = plane.gap(points) <= reach
    may_touch = near & (depth_in_hull(points, plane.unit_normal) <= hidden)
    if not may_touch.any():
        raise InputError("reach", f"got {reach} m", "needs some node of the boundary within it")
    return nodes[may_touch], nodes[near & ~may_touch]


def _answers(
    stiffness: sparse.csr_matrix, reads: Sequence[sparse.csr_matrix], solver: LinearSolver
) -> tuple[Floats, Floats, Floats]:
    """Return C and both S by solving for forces on each patch along each axis."""
    factor = solver.factorise(stiffness)
    every, forces = sparse.csr_matrix(sparse.vstack(reads)), sparse.csc_matrix(reads[0].T)
    columns = np.empty((every.shape[0], forces.shape[1]))
    for start in range(0, forces.shape[1], _AT_ONCE):
        some = slice(start, min(start + _AT_ONCE, forces.shape[1]))
        right = np.asfortranarray(forces[:, some].toarray())
        columns[:, some] = every @ factor.backward(factor.forward(right))
    ends = np.cumsum([read.shape[0] for read in reads])
    compliance, at_sites, at_watched = np.split(columns, ends[:-1])
    return 0.5 * (compliance + compliance.T), at_sites, at_watched
