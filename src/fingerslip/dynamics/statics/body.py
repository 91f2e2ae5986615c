"""What an elastic body without inertia answers to contact forces: computed once, for any number of motions.

The surface that may touch is divided into patches, in each of which the traction is constant: a patch moves by the
mean of its nodes, weighted by their areas. With the stiffness K of the body and B, which takes these means and reads
sites, all that contact forces f do follows from few rows of K^-1::

    displacement of patches, sites and watched nodes   u = u_0 + A (f - f_0),   A = B K^-1 B_p^T

so that a quasi-static step costs its contact problem, and no substitution. At small strain the body is linear about
its rest. At large strain K is the tangent of a state with the forces f_0, and the nearest of some states along a slide
stands for what is near it (:mod:`fingerslip.dynamics.statics.motion`). Where each patch is one node, and at small
strain, the motion is that of any other simulation; larger patches are an approximation of the contact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import ConvexHull, cKDTree

from fingerslip.arrays import Floats, Integers
from fingerslip.contact.candidates import node_operator
from fingerslip.dynamics.system.system import System, build_system
from fingerslip.errors import InputError
from fingerslip.fe.space import carrying_nodes, nodal_areas
from fingerslip.linear.solver import preferred_solver
from fingerslip.model.model import Model
from fingerslip.model.timing import QuasiStatic

#: What to do with a model that cannot be condensed.
REPAIR = "simulate the model step by step"

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


def patches(points: Floats, area: Floats, distance: float | Floats) -> tuple[Integers, sparse.csr_matrix]:
    """Divide nodes into patches of about the size that each asks for, those nearest to each of some middles.

    Arrays: points (n, dim) [m]; area (n,) [m^2]; distance (n,) or one for all [m]; returns middles (k,); means [-].

    Examples
    --------
    >>> line = np.column_stack([np.arange(4.0), np.zeros(4)])
    >>> middles, means = patches(line, np.array([1.0, 1.0, 1.0, 3.0]), 1.5)
    >>> means.toarray().round(2).tolist()
    [[0.5, 0.5, 0.0, 0.0], [0.0, 0.0, 0.25, 0.75]]
    """
    owner, sizes = np.zeros(len(points), dtype=np.int64), np.broadcast_to(distance, len(points))
    for size in np.unique(sizes):
        rows = np.flatnonzero(sizes == size)
        joined, places = points[rows], points[rows][_apart(points[rows], size)]
        for _ in range(_ROUNDS):
            places = np.asarray(_means(cKDTree(places).query(joined)[1], area[rows]) @ joined)
        owner[rows] = owner.max() + 1 + cKDTree(places).query(joined)[1]
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


def _means(owner: NDArray[np.integer], area: Floats) -> sparse.csr_matrix:
    """Return the map (k, n) that takes the means of what belongs to each of k owners; those of nothing are left out."""
    number = np.unique(owner, return_inverse=True)[1]
    summed = sparse.csr_matrix((area, (number, np.arange(len(area)))))
    return sparse.csr_matrix(sparse.diags(1.0 / np.asarray(summed.sum(axis=1)).ravel()) @ summed)


# Right-hand sides at once: fewer take longer, more take memory.
_AT_ONCE = 32


@dataclass(frozen=True)
class StaticBody:
    """A body by its answers to forces on the patches that may touch, in one or several states k."""

    nodes: Integers  # (n_p,), the mesh node in the middle of each patch
    positions: Floats  # (n_p, dim), where the patches are at rest, by the mean of their nodes [m]
    area: Floats  # (n_p,), their areas [m^2]
    watched: Floats  # (n_w, dim), where the other nodes of the boundary are at rest that must not touch [m]
    answers: Floats  # (k, n, n_p * dim), A, symmetric in its first rows: of patches, sites, watched nodes [m/N]
    moved: Floats  # (k, n), u_0, the displacement of these [m]
    forces: Floats  # (k, n_p, dim), f_0, contact forces on the body [N]
    skin: Floats  # (n_s, dim), the points at rest on the lowest of which a counterface is placed [m]
    shift: Floats  # (dim,), displacement of the counterface in the first state [m]

    @property
    def compliance(self) -> Floats:
        """What forces move patches by, shape (k, n_p * dim, n_p * dim) [m/N]."""
        return np.asarray(self.answers[:, : self.positions.size])

    @cached_property
    def unloaded_displacement(self) -> Floats:
        """Displacement without forces by the answers of each state, u_0 - A f_0, shape (k, n) [m]."""
        forces = self.forces.reshape(len(self.forces), -1)
        return np.asarray(self.moved - np.einsum("kij,kj->ki", self.answers, forces))

    @property
    def site_rows(self) -> slice:
        """Rows of the sites."""
        return slice(self.positions.size, self.answers.shape[1] - self.watched.size)

    @property
    def watched_rows(self) -> slice:
        """Rows of the watched nodes."""
        return slice(self.answers.shape[1] - self.watched.size, None)

    @property
    def is_pressed(self) -> bool:
        """Whether forces act in its first state, so that motions begin at the end of a press."""
        return bool(self.forces[0].any())


def shear_distances(moved: Floats, states: Floats, forces: Floats) -> Floats:
    """Return how far patches (n_p, dim) [m] are from states (k, n_p, dim) [m], in the mean by forces [N], (k,) [m]."""
    weights = np.linalg.norm(forces, axis=1)
    return np.asarray(np.sqrt(np.square(states - moved).sum(axis=2) @ (weights / weights.sum())))


def static_body(model: Model, *, reach: float, hidden: float, patch: float = 0.0) -> StaticBody:
    """Compute what the body of a model at small strain answers to forces on the surface that may touch; sizes in m."""
    check_kind(model, is_finite=False)
    stiffness, reads, body = _surface(model, reach, hidden, patch)
    factor = preferred_solver().factorise(stiffness)
    answers = answers_of(lambda right: factor.backward(factor.forward(right)), reads)[None]
    return replace(
        body, answers=answers, moved=np.zeros(answers.shape[:2]), forces=np.zeros((1, *body.positions.shape))
    )


def _surface(
    model: Model, reach: float, hidden: float, patch: float
) -> tuple[sparse.csr_matrix, list[sparse.csr_matrix], StaticBody]:
    """Return stiffness, maps from the n unknowns to patches, sites and watched nodes, and the body without its answers.

    The rest of the system of a model, as large as the stiffness, ends with this call.
    """
    system = build_system(model)
    if system.viscoelastic:
        raise InputError("materials", "relax", "needs elastic ones", REPAIR)
    area = nodal_areas(system.space, model.contacts[0].boundary, model.depth)
    plane, nodes = system.counterfaces.shapes[0], carrying_nodes(system.space, model.contacts[0].boundary)
    points = system.space.positions[nodes]
    near = plane.gap(points) <= reach
    may_touch = near & (depth_in_hull(points, plane.unit_normal) <= hidden)
    if not may_touch.any():
        raise InputError("reach", f"got {reach} m", "needs some node of the boundary within it")
    touching = nodes[may_touch]
    division = patches(system.space.positions[touching], area[touching], patch)
    reads, _, body = surface(system, touching, area[touching], nodes[near & ~may_touch], division)
    return system.stiffness, reads, body


def surface(
    system: System, nodes: Integers, area: Floats, others: Integers, division: tuple[Integers, sparse.csr_matrix]
) -> tuple[list[sparse.csr_matrix], sparse.csr_matrix, StaticBody]:
    """Return what reads patches of nodes (n_c,), sites and others (n_w,), sums over patches, and the body they make."""
    positions, dim = system.space.positions, system.space.dim
    middles, means = division
    sums, expansion = (means > 0).astype(float), system.unknowns.expansion
    of_nodes, at_sites, at_others = (
        sparse.csr_matrix(node_operator(rows, dim, system.space.n_dofs) @ expansion)
        for rows in (nodes, system.site_nodes, others)
    )
    reads = [sparse.csr_matrix(sparse.kron(means, sparse.eye(dim)) @ of_nodes), at_sites, at_others]
    places, watched, none = means @ positions[nodes], positions[others], np.zeros((1, 0, 0))
    skin, shift = np.vstack([places, watched]), np.zeros(dim)
    return reads, sums, StaticBody(nodes[middles], places, sums @ area, watched, none, none[0], none, skin, shift)


def check_kind(model: Model, *, is_finite: bool) -> None:
    """Refuse what cannot be condensed once for all, and another kinematics than is asked for."""
    kinematics = ("is small", "needs finite") if is_finite else ("is finite", "needs small")
    wrong = {
        "kinematics": (model.is_finite != is_finite, *kinematics),
        "time": (not isinstance(model.time, QuasiStatic), "has inertia", "needs scheme: quasi_static"),
        "contacts": (len(model.contacts) != 1, f"has {len(model.contacts)}", "needs one"),
        "loads": (model.is_loaded or bool(model.support_motions), "act beside the contact", "needs none"),
        "bodies": (bool(model.bodies), "has rigid bodies", "needs none"),
    }
    for where, (is_wrong, got, allowed) in wrong.items():
        if is_wrong:
            raise InputError(where, got, allowed, REPAIR)
    if not model.contacts[0].counterface.is_flat:
        raise InputError("contacts.0.counterface", "is curved", "needs a plane", REPAIR)


def answers_of(solve: Callable[[Floats], Floats], reads: Sequence[sparse.csr_matrix]) -> Floats:
    """Return A, shape (n, n_p * dim) [m/N], by solving for forces on each patch along each axis, some at once."""
    every, forces = sparse.csr_matrix(sparse.vstack(reads)), sparse.csc_matrix(reads[0].T)
    answers: Floats = np.empty((every.shape[0], forces.shape[1]))
    for start in range(0, forces.shape[1], _AT_ONCE):
        some = slice(start, min(start + _AT_ONCE, forces.shape[1]))
        right = np.asfortranarray(forces[:, some].toarray())
        answers[:, some] = every @ solve(right)
    compliance = answers[: forces.shape[1]]
    answers[: forces.shape[1]] = 0.5 * (compliance + compliance.T)
    return answers
