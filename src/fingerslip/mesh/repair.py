"""Repair of the few bad tetrahedra that a mesher leaves where solids are cut along each other.

Each bad cell is tried in its own neighbourhood: a node inside of a region is moved, or an edge is made one node. What
makes the worst cell there better is kept. Surfaces of regions change only where nothing else helps, along their edges.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.mesh.fragments import Fragments
from fingerslip.mesh.quality import tetrahedron_scores

__all__ = ["repaired"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_ROUNDS = 20
_EDGES = np.array(list(itertools.combinations(range(4), 2)))
_FACES = np.array(list(itertools.combinations(range(4), 3)))
# Directions and lengths, over the mean edge, in which a node is tried.
_DIRECTIONS = np.array([one for one in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(one)])
_STEPS = (0.05, 0.15, 0.3)
# Among the numbers of regions.
_OUTSIDE, _PLANE = -1, -2


def repaired(found: Fragments, plane: float | None = None, sites: Floats | None = None) -> Fragments:
    """Return cells of which those outside the limits of quality are repaired as far as that goes.

    Parameters
    ----------
    found : Fragments
        Tetrahedra.
    plane : float, optional
        Distance from z = 0 within which nodes lie on the plane of symmetry [m]; without it there is none.
    sites : (k, 3) array, optional
        Points [m]; the node next to each of them stays where it is.

    Returns
    -------
    Fragments
        The cells; what could not be repaired is left, so that quality has to be checked.
    """
    patch = _Patchwork(found, plane, np.empty((0, 3)) if sites is None else sites)
    for _ in range(_ROUNDS):
        # Every bad cell is tried, not only those before the first that gets better.
        better = sum(patch.improve(cell) for cell in patch.bad())
        if not better:
            break
    return patch.fragments()


class _Patchwork:
    """Tetrahedra whose neighbourhoods change one by one."""

    def __init__(self, found: Fragments, plane: float | None, sites: Floats) -> None:
        self.points, self.cells, self.region = found.points.copy(), found.cells.copy(), found.region
        self.alive = np.ones(len(self.cells), dtype=bool)
        self.of_node: list[set[int]] = [set() for _ in range(len(self.points))]
        for cell, nodes in enumerate(self.cells.tolist()):
            for node in nodes:
                self.of_node[node].add(cell)
        self.on_plane = np.zeros(len(self.points), dtype=bool) if plane is None else abs(self.points[:, 2]) < plane
        self.fixed = set(cKDTree(self.points).query(sites)[1].tolist())
        self.scores = tetrahedron_scores(self.points[self.cells])

    def fragments(self) -> Fragments:
        """Return the cells that are left, with the nodes that they have."""
        used, cells = np.unique(self.cells[self.alive], return_inverse=True)
        return Fragments(self.points[used], cells.reshape(-1, 4), self.region[self.alive])

    def bad(self) -> list[int]:
        """Return the cells outside the limits, the worst first."""
        order = np.argsort(self.scores)
        return [int(cell) for cell in order[: np.count_nonzero(self.scores <= 1.0)] if self.alive[cell]]

    def improve(self, cell: int) -> bool:
        """Repair a cell if that can be done; tell whether its neighbourhood has become better."""
        if not self.alive[cell] or self.scores[cell] > 1.0:
            return False
        inside, surface = self._options(cell)
        for options in (inside, surface):
            tried = [(self._score_of(option), number) for number, option in enumerate(options)]
            gain, best = max(tried, default=(0.0, 0))
            if gain > 0.0:
                self._apply(options[best])
                return True
        return False

    def _options(self, cell: int) -> tuple[list[_Option], list[_Option]]:
        """Return what may be tried inside of regions, and on their surfaces."""
        inside: list[_Option] = []
        surface: list[_Option] = []
        nodes = self.cells[cell].tolist()
        movable = [node for node in nodes if node not in self.fixed]
        for node in movable:
            if not self._features(self.of_node[node], (node,)):
                inside.extend((node, None, place) for place in self._places(node))
        for one, other in ((one, other) for one in movable for other in nodes if other != one):
            own = self._features(self.of_node[one], (one,))
            shared = self._features(self.of_node[one] & self.of_node[other], (one, other))
            if not own:
                inside.append((one, other, self.points[other]))
            elif own <= shared and self._is_short(one, other):
                surface.append((one, other, self.points[other]))
        return inside, surface

    def _features(self, cells: set[int], nodes: tuple[int, ...]) -> set[int]:
        """Return the regions that meet at nodes of some cells, the outside and the plane of symmetry; none inside."""
        regions = {int(self.region[cell]) for cell in cells}
        found = regions if len(regions) > 1 else set()
        if self._is_outside(cells, nodes):
            found = regions | {_OUTSIDE}
        if self.on_plane[list(nodes)].all():
            found = found | {_PLANE}
        return found

    def _is_outside(self, cells: set[int], nodes: tuple[int, ...]) -> bool:
        """Tell whether nodes belong to a face that only one of the cells has."""
        faces = np.sort(self.cells[list(cells)][:, _FACES].reshape(-1, 3), axis=1)
        faces = faces[np.isin(faces, nodes).sum(axis=1) == len(nodes)]
        _, count = np.unique(faces, axis=0, return_counts=True)
        return bool((count == 1).any())

    def _is_short(self, one: int, other: int) -> bool:
        length = np.linalg.norm(self.points[one] - self.points[other])
        return bool(length < 0.5 * self._mean_edge(one))

    def _mean_edge(self, node: int) -> float:
        others = np.unique(self.cells[list(self.of_node[node])])
        return float(np.linalg.norm(self.points[others[others != node]] - self.points[node], axis=1).mean())

    def _places(self, node: int) -> Iterator[Floats]:
        here, length = self.points[node], self._mean_edge(node)
        others = np.unique(self.cells[list(self.of_node[node])])
        yield self.points[others[others != node]].mean(axis=0)
        for step in _STEPS:
            yield from here + step * length * _DIRECTIONS / np.linalg.norm(_DIRECTIONS, axis=1)[:, None]

    def _score_of(self, option: _Option) -> float:
        """Return by how much the worst cell of a neighbourhood gets better; -inf where a cell turns over."""
        node, target, place = option
        own = np.array(sorted(self.of_node[node]))
        kept = own if target is None else np.array(sorted(self.of_node[node] - self.of_node[target]), dtype=np.int64)
        if not kept.size:
            return -np.inf
        corners = self.points[self.cells[kept]]
        moved = np.where((self.cells[kept] == node)[..., None], place, corners)
        turned = np.sign(_volumes(moved)) != np.sign(_volumes(corners))
        if turned.any():
            return -np.inf
        return float(tetrahedron_scores(moved).min() - self.scores[own].min())

    def _apply(self, option: _Option) -> None:
        node, target, place = option
        if target is None:
            self.points[node] = place
        else:
            for cell in self.of_node[node] & self.of_node[target]:
                self.alive[cell], self.scores[cell] = False, np.inf
                for other in self.cells[cell].tolist():
                    self.of_node[other].discard(cell)
            for cell in list(self.of_node[node]):
                self.cells[cell][self.cells[cell] == node] = target
                self.of_node[target].add(cell)
            self.of_node[node].clear()
        around = sorted(self.of_node[node if target is None else target])
        self.scores[around] = tetrahedron_scores(self.points[self.cells[around]])


_Option = tuple[int, int | None, Floats]


def _volumes(corners: Floats) -> Floats:
    found: Floats = np.linalg.det(corners[:, 1:] - corners[:, :1])
    return found
