"""The displacement space on a mesh: its nodes, degrees of freedom and quadrature, its free edges and motions.

Node i has the degrees of freedom dim*i ... dim*i + dim - 1, so a field of shape (n_dofs,) reshaped to
(n_nodes, dim) is the nodal field. The first nodes are the mesh's vertices; quadratic elements add their
mid-side nodes.

A boundary has a free edge where it meets another part of the surface that no support holds: a body that is cut off
there may lack what would touch next. An edge at a plane of symmetry, or at a clamped face, is no free edge.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy import spatial
from skfem.quadrature import get_quadrature

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.errors import MeshError, did_you_mean
from fingerslip.mesh.facets import are_degenerate, connected_pieces
from fingerslip.mesh.quality import check_folds, positive_tetrahedra
from fingerslip.units import coordinates


class _Technology(NamedTuple):
    """Scalar element and quadrature orders of one kind of cell."""

    name: str
    element: skfem.Element
    stiffness_order: int
    mass_order: int


_TECHNOLOGIES: dict[type, _Technology] = {
    skfem.MeshQuad1: _Technology("Q4", skfem.ElementQuad1(), 2, 2),
    skfem.MeshTri1: _Technology("T3", skfem.ElementTriP1(), 2, 2),
    skfem.MeshTri2: _Technology("T6", skfem.ElementTriP2(), 2, 4),
    skfem.MeshHex1: _Technology("H8", skfem.ElementHex1(), 2, 2),
    skfem.MeshTet1: _Technology("T4", skfem.ElementTetP1(), 0, 2),
    skfem.MeshTet2: _Technology("T10", skfem.ElementTetP2(), 2, 4),
}


# Roundings of coordinates that a point in a cell may be off by.
_ROUNDINGS = 16
VTK_HEXAHEDRON = [0, 3, 6, 2, 1, 5, 7, 4]


@dataclass(frozen=True)
class Space:
    """Displacement space."""

    mesh: Any  # the mesh
    element: str  # Q4, T3 or T6 in 2D, H8, T4 or T10 in 3D
    full: skfem.CellBasis
    centre: skfem.CellBasis
    mass: skfem.CellBasis
    positions: Floats  # (n_nodes, dim), reference positions of the nodes [m]
    nodes_by_boundary: dict[str, Integers] = field(default_factory=dict, init=False, repr=False, compare=False)
    areas_by_boundary: dict[str, Floats] = field(default_factory=dict, init=False, repr=False, compare=False)
    nodes_by_sites: dict[Any, Integers] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.positions.shape[1])

    @property
    def n_dofs(self) -> int:
        """Number of degrees of freedom, fixed ones included."""
        return self.dim * int(self.full.N)

    @functools.cached_property
    def slopes_at_centre(self) -> Floats:
        """Gradients (n_cells, n_local, dim) [1/m] of the shape functions at the centres of cells."""
        mesh = self.mesh
        centre = get_quadrature(mesh.elem.refdom, 1)[0][:, :1]
        nodes = mesh.dofs.element_dofs
        slopes = np.stack([mesh.elem().lbasis(centre, i)[1].ravel() for i in range(len(nodes))])
        return np.asarray(slopes @ np.linalg.inv(np.einsum("icn,nj->cij", mesh.doflocs[:, nodes.T], slopes)))

    @property
    def scalar_element(self) -> skfem.Element:
        """The element of one displacement component."""
        return _TECHNOLOGIES[type(self.mesh)].element


def build_space(mesh: Any) -> Space:
    """Make the displacement space of a mesh."""
    if type(mesh) not in _TECHNOLOGIES:
        names = ", ".join(kind.__name__ for kind in _TECHNOLOGIES)
        raise MeshError("mesh", f"got a {type(mesh).__name__}", f"needs one of {names}")
    nowhere = np.flatnonzero(~np.isfinite(mesh.p).all(axis=0))
    if nowhere.size:
        fault = f"node {nowhere[0]} is at {coordinates(mesh.p[:, nowhere[0]])}"
        raise MeshError("mesh", fault, "needs finite coordinates", "put it in its place or leave it out")
    technology = _TECHNOLOGIES[type(mesh)]
    check_folds(mesh, _orientation(mesh, technology.stiffness_order))
    # The one-point quadrature at the centre: scikit-fem's own rules have no fewer points than order two.
    corners, volume = mesh.elem.refdom.p, 1.0 / math.factorial(mesh.dim()) if _is_simplicial(mesh) else 1.0
    centre = corners.mean(axis=1, keepdims=True), np.array([volume])
    full = skfem.Basis(mesh, technology.element, intorder=technology.stiffness_order)
    return Space(
        mesh=mesh,
        element=technology.name,
        full=full,
        centre=skfem.Basis(mesh, technology.element, quadrature=centre),
        mass=skfem.Basis(mesh, technology.element, intorder=technology.mass_order),
        positions=np.ascontiguousarray(full.doflocs.T),
    )


def vector_dofs(nodes: NDArray[np.integer[Any]], dim: int) -> Integers:
    """Return the degrees of freedom of `nodes` (n,), shape (n, dim)."""
    return np.asarray(nodes, dtype=np.int64)[:, None] * dim + np.arange(dim)


def carrying_nodes(space: Space, boundary: str) -> Integers:
    """Return the nodes (k,) of a boundary that have an area: corners of quadratic tetrahedra have none."""
    nodes, areas = boundary_nodes(space, boundary), nodal_areas(space, boundary, 1.0)
    return np.asarray(nodes[areas[nodes] > 1e-9 * areas[nodes].max()])


def cell_nodes(space: Space) -> NDArray[np.int32]:
    """Return the nodes of every cell, shape (n_cells, n), in the order of VTK and with positive volumes.

    Corners first, then the middles of edges; VTK counts them alike but for the hexahedron.
    """
    nodes = np.array(space.full.element_dofs.T, dtype=np.int32)
    if space.element == "H8":
        nodes = nodes[:, VTK_HEXAHEDRON]
    if space.element in {"T4", "T10"}:
        nodes = positive_tetrahedra(space.positions, nodes)
    return np.ascontiguousarray(nodes)


def boundary_nodes(space: Space, name: str, where: str = "mesh") -> Integers:
    """Return the sorted nodes of a boundary, shape (k,), that a model names at some place."""
    if name not in space.nodes_by_boundary:
        facets = group_facets(space.mesh.boundaries, name, "boundary", where)
        space.nodes_by_boundary[name] = np.unique(space.full.get_dofs(facets=np.asarray(facets)).all()).astype(np.int64)
    return space.nodes_by_boundary[name].copy()


def region_nodes(space: Space, name: str) -> Integers:
    """Return the sorted nodes of a named region, shape (k,)."""
    cells = group_facets(space.mesh.subdomains, name, "region")
    return np.unique(space.full.element_dofs[:, cells]).astype(np.int64)


@skfem.LinearForm
def _shape_function(v: Any, _: Any) -> Any:
    return v


class _Mapping(skfem.MappingIsoparametric):  # type: ignore[misc]
    """The map of curved and four-sided cells, which finds points in them as sharply as their coordinates are known."""

    def invF(self, x: Any, tind: Any = None, newton_max_iters: int = 50, newton_tol: float = 1e-12) -> Any:  # noqa: N802
        """Return the local coordinates of points (dim, n_cells, k) [m] in cells `tind` (n_cells,), same shape [-]."""
        middle = np.full(x.shape, 0.5)
        rounding = np.finfo(float).eps * np.abs(x).max() * np.abs(self.invDF(middle, tind)).sum(axis=(0, 1)).max()
        return super().invF(x, tind, newton_max_iters, max(newton_tol, _ROUNDINGS * rounding))


def nodal_areas(space: Space, name: str, depth: float, where: str = "mesh") -> Floats:
    """Return the tributary area [m^2] of every node on a boundary, shape (n_nodes,): integrals of shape functions."""
    if name not in space.areas_by_boundary:
        facets, mesh = group_facets(space.mesh.boundaries, name, "boundary", where), space.mesh
        facets = facets[~are_degenerate(mesh)[facets]]
        mapping = mesh.mapping() if mesh.affine else _Mapping(mesh, mesh.elem(), mesh.bndelem)
        basis = skfem.FacetBasis(mesh, space.scalar_element, mapping, facets=facets)
        space.areas_by_boundary[name] = _shape_function.assemble(basis)
    return depth * space.areas_by_boundary[name]


def group_facets(table: dict[str, Any] | None, name: str, kind: str, where: str = "mesh") -> Integers:
    """Return the facets or cells of a named group, shape (k,)."""
    sets = table or {}
    if name not in sets:
        names = sorted(sets)
        allowed = f"it has: {', '.join(names) or 'none'}"
        raise MeshError(where, f"{kind} '{name}' not in mesh", allowed, did_you_mean(name, names))
    if not len(sets[name]):
        raise MeshError(where, f"{kind} '{name}' is empty", "needs at least one facet or cell")
    return np.asarray(sets[name])


def _is_simplicial(mesh: Any) -> bool:
    return isinstance(mesh, skfem.MeshTri1 | skfem.MeshTet1)


def _orientation(mesh: Any, order: int) -> Flags:
    """Return which cells (n_cells,) are mirror images of their reference cell; refuse inverted and flat ones.

    scikit-fem sorts the vertices of triangles and tetrahedra, so their sign by itself says nothing; it must only not
    change within a cell. Other cells keep their order, so all of them must turn the same way.
    """
    inside, _ = get_quadrature(mesh.elem.refdom, order)
    jacobian = _jacobian(mesh, mesh.doflocs, np.hstack([inside, mesh.elem.refdom.p]))
    # Where corners of a cell are one node (:mod:`fingerslip.mesh.mixed`), its mapping ends; inside it counts.
    alike = (mesh.t[:, None] == mesh.t).sum(axis=1).T > 1
    jacobian[:, inside.shape[1] :][alike] = jacobian[np.nonzero(alike)[0], 0]
    turn = np.sign(jacobian[:, :1]) if _is_simplicial(mesh) else np.sign(np.median(jacobian))
    bad = np.flatnonzero((jacobian * turn <= 0.0).any(axis=1))
    if bad.size:
        centre = coordinates(mesh.p[:, mesh.t[:, bad[0]]].mean(axis=1))
        others = f" ({bad.size} cells in all)" if bad.size > 1 else ""
        fault = f"cell {bad[0]} at {centre} is inverted or flat{others}"
        raise MeshError("mesh", fault, "needs cells that all turn the same way", "repair or rebuild the mesh")
    return np.asarray(jacobian[:, 0] < 0.0)


def _jacobian(mesh: Any, points: Floats, at: Floats) -> Floats:
    """Return the determinant (n_cells, n_points) of the cells' mapping at places (dim, n_points) of the reference cell.

    Nodes are at `points` (dim, n_nodes) [m]. scikit-fem's own determinant raises at zero.
    """
    nodes = mesh.dofs.element_dofs
    slopes = np.stack([np.broadcast_to(mesh.elem().lbasis(at, i)[1], at.shape) for i in range(len(nodes))])
    return np.asarray(np.linalg.det(np.einsum("inc,njq->cqij", points[:, nodes], slopes)))


def deformation_gradients(space: Space, displacement: Floats) -> Floats:
    """Return the deformation gradients (n_cells, dim, dim) at the centres of cells, of a displacement (n_dofs,) [m]."""
    moved = displacement.reshape(-1, space.dim)[space.mesh.dofs.element_dofs.T]
    return np.asarray(np.eye(space.dim) + moved.swapaxes(1, 2) @ space.slopes_at_centre)


def free_edge_nodes(space: Space, boundary: str, held: Flags) -> Integers:
    """Return the nodes (n,) of a boundary that also lie on an outer facet that is free of supports (n_nodes, dim)."""
    facets = [*space.mesh.boundaries[boundary], *np.flatnonzero(are_degenerate(space.mesh))]
    others = np.setdiff1d(space.mesh.boundary_facets(), facets)
    if not others.size:
        return np.zeros(0, dtype=np.int64)
    others = others[~held[space.mesh.facets[:, others]].all(axis=0).any(axis=1)]
    free = space.full.get_dofs(facets=others).all() if others.size else np.zeros(0, dtype=np.int64)
    return np.intersect1d(boundary_nodes(space, boundary), free).astype(np.int64)


def free_edge_distances(space: Space, boundary: str, held: Flags, nodes: Integers) -> Floats:
    """Return how far nodes (n,) are from the nearest free edge of a boundary, shape (n,) [m]."""
    edge = free_edge_nodes(space, boundary, held)
    if not edge.size:
        return np.full(nodes.shape, np.inf)
    distances, _ = spatial.cKDTree(space.positions[edge]).query(space.positions[nodes])
    return np.asarray(distances, dtype=float)


_ZERO = 1e-9
_AXES = "xyz"
# The two axes that each rotation turns, and the name of what it turns about.
_ROTATIONS = {2: (((0, 1), "z"),), 3: (((1, 2), "x"), ((2, 0), "y"), ((0, 1), "z"))}


@dataclass(frozen=True)
class FreePiece:
    """A connected piece of a mesh that can move as a rigid body."""

    nodes: Integers  # (k,), its nodes
    motions: tuple[str, ...]  # the free motions, such as ``translation along x`` or ``rotation about z``


def free_pieces(space: Space, free: Integers) -> tuple[FreePiece, ...]:
    """Return the pieces of a mesh that supports do not hold, with the motions of the `free` unknowns (n_free,)."""
    held = np.ones(space.n_dofs, dtype=bool)
    held[free] = False
    by_node, cells = held.reshape(-1, space.dim), np.asarray(space.full.element_dofs)
    first = np.broadcast_to(cells[0], cells[1:].shape).ravel()
    number = connected_pieces(len(space.positions), np.stack([first, cells[1:].ravel()]))
    # A node without a cell is a piece of its own, which nothing moves.
    pieces = [np.flatnonzero(number == piece) for piece in np.unique(number[cells[0]])]
    free_pieces = (FreePiece(nodes, _free_motions(space.positions[nodes], by_node[nodes])) for nodes in pieces)
    return tuple(piece for piece in free_pieces if piece.motions)


def _free_motions(positions: Floats, held: Flags) -> tuple[str, ...]:
    """Return the names of the rigid motions of nodes at positions (k, dim) that components held (k, dim) leave free."""
    dim = positions.shape[1]
    # Translations and rotations about the centre as columns, all of the order of one.
    centred = positions - positions.mean(axis=0)
    centred = centred / (np.abs(centred).max(initial=0.0) or 1.0)
    turns = np.zeros((len(positions), dim, len(_ROTATIONS[dim])))
    for number, ((first, other), _) in enumerate(_ROTATIONS[dim]):
        turns[:, first, number] = -centred[:, other]
        turns[:, other, number] = centred[:, first]
    shifts = np.broadcast_to(np.eye(dim), (len(positions), dim, dim))
    motions = np.concatenate([shifts, turns], axis=2).reshape(len(positions) * dim, -1)
    _, sizes, directions = np.linalg.svd(np.linalg.qr(motions[held.ravel()], mode="r"))
    is_free = np.zeros(motions.shape[1])
    is_free[: sizes.size] = sizes
    # Scaled by the number of nodes, since the columns are of the order of one.
    null = directions[is_free <= _ZERO * np.sqrt(max(len(positions), 1))]
    # A rotation is free if it is part of any free motion; its centre is where the supports want it.
    pairs = zip(_ROTATIONS[dim], null.T[dim:], strict=True)
    turning = [axis for (_, axis), part in pairs if np.abs(part).max(initial=0.0) > _ZERO]
    units = np.eye(dim, motions.shape[1])
    along = [axis for axis, unit in zip(_AXES, units, strict=False) if np.linalg.norm(null @ unit) > 1.0 - _ZERO]
    return (*(f"translation along {axis}" for axis in along), *(f"rotation about {axis}" for axis in turning))
