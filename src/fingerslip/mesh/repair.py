"""Poor cells of a mesh mended: edges collapsed, nodes moved."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.mesh.gmsh_session import Fragments
from fingerslip.mesh.quality import tetrahedron_margins, turns

_SWEEPS, _SWEEPS_SMOOTHING = 8, 20
# Scaled Jacobian [-] beyond which cells are not smoothed.
_GOOD_ENOUGH = 0.7
# A repair counts where the worst cell gets better by this factor, so that repairs come to an end.
_BETTER = 1.001
# Shares of the way to the middle of its neighbours, and to the other corners of the cell, that a node is tried at.
_MOVES = (0.1, 0.25, 0.5, 1.0)
# Share of the volume around a node that may go from one region to another, or be lost or won outside.
_MOVED = 0.1
# Nodes nearer to the plane z = 0 than this lie on it [m].
_ON_PLANE = 1e-9


@dataclass
class _Cells:
    """Tetrahedra that change."""

    points: Floats  # (n, 3) [m]
    cells: Integers  # (m, 4)
    region: Integers  # (m,)
    alive: Flags  # (m,), which cells are left
    borders: Integers  # (n,), what a node lies on, by bits

    def around(self, node: int) -> Integers:
        """Return the cells at a node."""
        return np.flatnonzero((self.cells == node).any(axis=1) & self.alive)

    def margins(self, rows: NDArray[np.generic]) -> Floats:
        """Return how far some cells are inside the limits of quality."""
        return tetrahedron_margins(self.points[self.cells[rows]])


#: A node that becomes another, or itself where it only moves, at a position [m], and the least margin after it.
_Change = tuple[int, int, Floats, float]


def repair_tetrahedra(fragments: Fragments, fixed: Floats) -> Fragments:
    """Return tetrahedra of which fewer are refused by :func:`fingerslip.mesh.quality.check_quality`, or none.

    At each refused cell the best of several changes is made, if the worst cell around it gets better and none is turned
    inside out: an edge becomes one of its ends, or a node inside a region moves towards its neighbours or a corner of
    the cell. A node on the border of regions, on the outside or on the plane z = 0 gives way only to one that lies on
    all of these, and regions keep their volumes but for a tenth of that around the node. Nodes at the points `fixed`
    (k, 3) [m] stay.
    """
    alive = np.ones(len(fragments.cells), dtype=bool)
    state = _Cells(fragments.points.copy(), fragments.cells.copy(), fragments.region, alive, _borders(fragments))
    stay = {int(np.argmin(((fragments.points - point) ** 2).sum(axis=1))) for point in fixed}
    for _ in range(_SWEEPS):
        refused = np.flatnonzero(alive)[state.margins(alive) <= 1.0]
        if not sum(_repair(state, int(cell), stay) for cell in refused):
            break
    used, numbers = np.unique(state.cells[alive], return_inverse=True)
    return Fragments(state.points[used], numbers.reshape(-1, 4), state.region[alive])


def _borders(fragments: Fragments) -> Integers:
    """Return what each node lies on as bits: its regions, the outside, the plane z = 0."""
    count = int(fragments.region.max()) + 1
    borders = np.zeros(len(fragments.points), dtype=np.int64)
    for number in range(count):
        borders[np.unique(fragments.cells[fragments.region == number])] |= 1 << number
    corners = [list(corners) for corners in itertools.combinations(range(4), 3)]
    borders[outer_nodes(np.vstack([fragments.cells[:, face] for face in corners]))] |= 1 << count
    borders[np.abs(fragments.points[:, 2]) < _ON_PLANE] |= 1 << (count + 1)
    return borders


def outer_nodes(sides: Integers) -> Integers:
    """Return the nodes of those sides of cells (m, k) that are there once."""
    unique, uses = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    return np.unique(unique[uses == 1])


def _repair(state: _Cells, cell: int, stay: set[int]) -> bool:
    """Make the best change at a cell, if there is one; tell whether."""
    if not state.alive[cell]:
        return False
    best = max(_changes(state, cell, stay), key=lambda change: change[-1], default=None)
    if best is None:
        return False
    node, onto, position, _ = best
    around = state.around(node)
    state.points[node] = position
    if onto != node:
        state.alive[around[(state.cells[around] == onto).any(axis=1)]] = False
        state.cells[around] = np.where(state.cells[around] == node, onto, state.cells[around])
    return True


def _changes(state: _Cells, cell: int, stay: set[int]) -> Iterator[_Change]:
    """Yield the changes at a cell that make the worst cell around better."""
    nodes = [int(node) for node in state.cells[cell]]
    for node in nodes:
        if node in stay:
            continue
        around, borders = state.around(node), int(state.borders[node])
        before, others = float(state.margins(around).min()), [other for other in nodes if other != node]
        targets = [
            (onto, state.points[onto].copy()) for onto in others if borders & int(state.borders[onto]) == borders
        ]
        if borders & (borders - 1) == 0:
            beside, at = np.unique(state.cells[around]), state.points[node]
            aims = [state.points[beside[beside != node]].mean(axis=0), *state.points[others]]
            targets += [(node, at + share * (aim - at)) for aim, share in itertools.product(aims, _MOVES)]
        for onto, target in targets:
            margin = _margin_after(state, node, onto, target, around)
            if margin > _BETTER * before:
                yield node, onto, target, margin


def _margin_after(state: _Cells, node: int, onto: int, position: Floats, around: Integers) -> float:
    """Return the least margin of the cells around a node after a change; 0 where the change is none to make."""
    cells, region = state.cells[around], state.region[around]
    stays = ~(cells == onto).any(axis=1) if onto != node else np.ones(len(cells), dtype=bool)
    before = state.points[cells]
    after = np.where((cells == node)[..., None], position, before)
    was, will = (np.linalg.det(corners[:, 1:] - corners[:, :1]) for corners in (before, after))
    if not stays.any() or (was * will <= 0.0)[stays].any():
        return 0.0
    moved = np.bincount(region, np.abs(was)) - np.bincount(region, np.abs(will) * stays)
    if np.abs(moved).max() > _MOVED * np.abs(was).sum():
        return 0.0
    return float(tetrahedron_margins(after[stays]).min())


def scaled_jacobians(points: Floats, cells: Integers) -> Floats:
    """Return the least scaled Jacobian (m,) [-] of the corners of 2D cells (m, k), negative where inverted."""
    ahead, back, cross = turns(points[cells].transpose(2, 1, 0))
    length = np.linalg.norm(ahead, axis=0) * np.linalg.norm(back, axis=0)
    return np.asarray((cross / np.where(length > 0, length, 1.0)).min(axis=0))


def smooth(points: Floats, cells: Integers, region: Integers) -> Floats:
    """Return node positions (n, 2) [m] of quadrilaterals (m, 4) in which no node's worst cell is worse than before.

    Each sweep moves the nodes of badly shaped cells half way to the mean of their neighbours, and takes back every move
    that makes the worst cell at a node worse. Nodes on the border of a region stay; `region` (m,) is that of each cell.
    """
    fixed = np.zeros(len(points), dtype=bool)
    for number in np.unique(region):
        nodes = cells[region == number]
        fixed[outer_nodes(np.stack([nodes, np.roll(nodes, -1, axis=1)], axis=-1).reshape(-1, 2))] = True
    # Nodes that are well placed at the start never move: cells without others at their nodes need no look.
    beside = np.zeros(len(points), dtype=bool)
    beside[cells[(~fixed & (_node_quality(points, cells) < _GOOD_ENOUGH))[cells].any(axis=1)]] = True
    cells = cells[beside[cells].any(axis=1)]
    start, end = cells.ravel(), np.roll(cells, -1, axis=1).ravel()
    first, second = np.concatenate([start, end]), np.concatenate([end, start])
    for _ in range(_SWEEPS_SMOOTHING):
        quality = _node_quality(points, cells)
        moving = ~fixed & (quality < _GOOD_ENOUGH)
        count = np.bincount(first, minlength=len(points))
        total = np.column_stack([np.bincount(first, points[second, k], minlength=len(points)) for k in (0, 1)])
        moved = np.where(moving[:, None], 0.5 * (points + total / np.maximum(count, 1)[:, None]), points)
        points = _accept_moves(points, moved, cells, quality)
    return points


def _accept_moves(before: Floats, after: Floats, cells: Integers, quality: Floats) -> Floats:
    """Take back the moves of all nodes of cells at which quality falls, until none does."""
    while True:
        worse = _node_quality(after, cells) < quality
        touched = np.zeros(len(before), dtype=bool)
        touched[cells[worse[cells].any(axis=1)]] = True
        back = touched & np.any(after != before, axis=1)
        if not back.any():
            return after
        after = np.where(back[:, None], before, after)


def _node_quality(points: Floats, cells: Integers) -> Floats:
    worst = np.ones(len(points))
    np.minimum.at(worst, cells, scaled_jacobians(points, cells)[:, None])
    return worst
