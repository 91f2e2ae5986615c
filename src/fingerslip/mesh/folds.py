"""Cells that fold over their neighbours: they lie on the same side of a facet that they share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import MeshError
from fingerslip.units import coordinates

if TYPE_CHECKING:
    import skfem

__all__ = ["check_folds", "turned_cells"]

Booleans = NDArray[np.bool_]
Integers = NDArray[np.integer]

# Pairs of cells that an error names.
_SHOWN = 3


def turned_cells(mesh: skfem.Mesh) -> Booleans:
    """Return which cells are mirror images of their reference cell, by the edges of their first corner.

    Arrays: returns (n_cells,).
    """
    reference = mesh.elem.refdom.p
    beside = np.flatnonzero(np.isclose(np.linalg.norm(reference - reference[:, :1], axis=0), 1.0))
    edges = (mesh.p[:, mesh.t[beside]] - mesh.p[:, mesh.t[:1]]).transpose(2, 0, 1)
    sign = np.linalg.det(reference[:, beside] - reference[:, :1])
    turned: Booleans = np.linalg.det(edges) * sign < 0.0
    return turned


def check_folds(mesh: skfem.Mesh, turned: Booleans, where: str = "mesh") -> None:
    """Refuse a mesh with two cells on the same side of a facet that they share, and with three cells at a facet.

    Facets of one cell alone, such as those of the outside and of a crack, have nothing to fold over.

    Arrays: turned (n_cells,).
    """
    sides = 2 * mesh.t2f + _is_in_front(mesh, turned)
    shared = np.flatnonzero(np.bincount(sides.ravel()) > 1)
    if shared.size:
        raise MeshError(where, _folded(mesh, sides, shared), *_remedy(mesh))


def _is_in_front(mesh: skfem.Mesh, turned: Booleans) -> Booleans:
    """Return on which side of its facets each cell lies, shape (n_cell_facets, n_cells).

    Seen from inside a cell, the corners of a facet run round it in a direction that its reference cell and `turned`
    tell. Cells on either side of a facet see the same corners run in opposite directions.
    """
    reference = mesh.elem.refdom
    centre = reference.p.mean(axis=1, keepdims=True)
    sides = np.empty(mesh.t2f.shape, dtype=bool)
    for side, corners in zip(sides, reference.facets, strict=True):
        runs_round = np.linalg.det(reference.p[:, corners[: mesh.dim()]] - centre) > 0.0
        side[:] = _runs_up(mesh.t[corners]) ^ turned ^ runs_round
    return sides


def _runs_up(nodes: Integers) -> Booleans:
    """Return whether nodes (k, n) that run round a facet do so from the least one towards its lesser neighbour."""
    count = len(nodes)
    if count == 2:
        return np.asarray(nodes[0] < nodes[1])
    least, facets = nodes.argmin(axis=0), np.arange(nodes.shape[1])
    return np.asarray(nodes[(least + 1) % count, facets] < nodes[least - 1, facets])


def _folded(mesh: skfem.Mesh, sides: Integers, shared: Integers) -> str:
    """Say which cells share sides of facets, and where; `shared` are the numbers of these sides."""
    places = mesh.p[:, mesh.facets[:, shared[:_SHOWN] // 2]].mean(axis=1).T
    pairs = [np.flatnonzero((sides == side).any(axis=0))[:2] for side in shared[:_SHOWN]]
    named = [
        f"{first} and {second} at {coordinates(place)}" for (first, second), place in zip(pairs, places, strict=True)
    ]
    count = f" ({shared.size} pairs in all)" if shared.size > _SHOWN else ""
    return f"has cells that fold over each other: {', '.join(named)}{count}"


def _remedy(mesh: skfem.Mesh) -> tuple[str, str]:
    """Return what is allowed, and how to repair the mesh."""
    allowed = f"needs at most one cell on either side of {'an edge' if mesh.dim() == 2 else 'a face'}"
    return allowed, "move their nodes back, take out a cell that is there twice, or mesh the body again"
