"""Rigid motions that supports leave free."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from fingerslip.fe.space import Space

__all__ = ["FreePiece", "free_pieces"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_ZERO = 1e-9
_AXES = "xyz"
# The axes in the plane of each rotation, and the name of what it turns about.
_ROTATIONS = {2: (((0, 1), "z"),), 3: (((1, 2), "x"), ((2, 0), "y"), ((0, 1), "z"))}


@dataclass(frozen=True)
class FreePiece:
    """A connected piece of a mesh that can move as a rigid body."""

    nodes: Indices  # (k,), its nodes
    motions: tuple[str, ...]  # the free motions, such as ``translation along x`` or ``rotation about z``


def free_pieces(space: Space, free: Indices) -> tuple[FreePiece, ...]:
    """Return the pieces of a mesh that supports do not hold, with the motions that they leave free.

    Arrays: free (n_free,).
    """
    held = np.ones(space.n_dofs, dtype=bool)
    held[free] = False
    by_node = held.reshape(-1, space.dim)
    pieces = (FreePiece(nodes, _free_motions(space.positions[nodes], by_node[nodes])) for nodes in _pieces(space))
    return tuple(piece for piece in pieces if piece.motions)


def _pieces(space: Space) -> Iterator[Indices]:
    """Yield the nodes of each connected piece of the mesh."""
    cells = np.asarray(space.full.element_dofs)
    count = len(space.positions)
    first = np.broadcast_to(cells[0], cells[1:].shape).ravel()
    graph = sparse.coo_matrix((np.ones(first.size), (first, cells[1:].ravel())), shape=(count, count))
    number = connected_components(graph, directed=False)[1]
    # A node without a cell is a piece of its own, which nothing moves.
    used = np.unique(number[cells[0]])
    for piece in used:
        yield np.flatnonzero(number == piece)


def _free_motions(positions: Array, held: NDArray[np.bool_]) -> tuple[str, ...]:
    """Return the names of the rigid motions of nodes at positions (k, dim) that components held (k, dim) leave free."""
    dim = positions.shape[1]
    motions = _rigid_motions(positions)
    _, sizes, directions = np.linalg.svd(np.linalg.qr(motions[held.ravel()], mode="r"))
    kept = np.zeros(motions.shape[1])
    kept[: sizes.size] = sizes
    # Scaled by the number of nodes, since the columns are of the order of one.
    null = directions[kept <= _ZERO * np.sqrt(max(len(positions), 1))]
    # A rotation is free if it is part of any free motion; its centre is where the supports want it.
    turns = zip(_ROTATIONS[dim], null.T[dim:], strict=True)
    turning = [axis for (_, axis), part in turns if np.abs(part).max(initial=0.0) > _ZERO]
    shifts = np.eye(dim, motions.shape[1])
    along = [axis for axis, shift in zip(_AXES, shifts, strict=False) if np.linalg.norm(null @ shift) > 1.0 - _ZERO]
    return (*(f"translation along {axis}" for axis in along), *(f"rotation about {axis}" for axis in turning))


def _rigid_motions(positions: Array) -> Array:
    """Return translations and rotations about the centre as columns, (k * dim, 3 or 6), all of the order of one."""
    dim = positions.shape[1]
    centred = positions - positions.mean(axis=0)
    centred = centred / (np.abs(centred).max(initial=0.0) or 1.0)
    turns = np.zeros((len(positions), dim, len(_ROTATIONS[dim])))
    for number, ((one, other), _) in enumerate(_ROTATIONS[dim]):
        turns[:, one, number] = -centred[:, other]
        turns[:, other, number] = centred[:, one]
    shifts = np.broadcast_to(np.eye(dim), (len(positions), dim, dim))
    return np.concatenate([shifts, turns], axis=2).reshape(len(positions) * dim, -1)
