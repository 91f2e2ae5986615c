"""Poor cells of a mesh mended: edges collapsed, nodes moved."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.mesh.gmsh_session import Fragments
from fingerslip.mesh.quality import tetrahedron_margins

__all__ = [
    "repair_tetrahedra",
    "scaled_jacobians",
    "smooth",
]


Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_SWEEPS = 8
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
    """Cells that change: `alive` tells which are left, `places` what a node lies on, by bits."""

    points: Floats
    cells: Integers
    region: Integers
    alive: NDArray[np.bool_]
    places: Integers

    def around(self, node: int) -> Integers:
        """Return the cells at a node."""
        return np.flatnonzero((self.cells == node).any(axis=1) & self.alive)


@dataclass(frozen=True)
class _Change:
    """What replaces cells: the new corners of those that stay, and where a node goes."""

    node: int
    onto: int
    place: Floats
    margin: float


def repair_tetrahedra(fragments: Fragments, fixed: Floats) -> Fragments:
    """Return tetrahedra of which fewer are refused by :func:`fingerslip.mesh.quality.check_quality`, or none.

    At each refused cell the best of several changes is made, if the worst cell around it gets better and none is turned
    inside out: an edge becomes one of its ends, or a node inside a region moves towards its neighbours or a corner of
    the cell. A node on the border of regions, on the outside or on the plane z = 0 gives way only to one that lies on
    all of these, and regions keep their volumes but for a tenth of that around the node.

    Arrays: kept (k, 3) [m].
    """
    state = _Cells(
        fragments.points.copy(),
        fragments.cells.copy(),
        fragments.region,
        np.ones(len(fragments.cells), dtype=bool),
        _places(fragments),
    )
    stay = {int(np.argmin(((fragments.points - point) ** 2).sum(axis=1))) for point in fixed}
    for _ in range(_SWEEPS):
        refused = np.flatnonzero(state.alive)[tetrahedron_margins(_corners(state, state.alive)) <= 1.0]
        if not sum(_repair(state, int(cell), stay) for cell in refused):
            break
    return _left(state)


def _places(fragments: Fragments) -> Integers:
    """Return what each node lies on as bits: its regions, the outside, the plane z = 0."""
    count = int(fragments.region.max()) + 1
    places = np.zeros(len(fragments.points), dtype=np.int64)
    for number in range(count):
        places[np.unique(fragments.cells[fragments.region == number])] |= 1 << number
    faces = np.sort(
        np.vstack([fragments.cells[:, combination] for combination in itertools.combinations(range(4), 3)]), axis=1
    )
    unique, uses = np.unique(faces, axis=0, return_counts=True)
    places[np.unique(unique[uses == 1])] |= 1 << count
    places[np.abs(fragments.points[:, 2]) < _ON_PLANE] |= 1 << (count + 1)
    return places


def _corners(state: _Cells, rows: NDArray[np.generic]) -> Floats:
    corners: Floats = state.points[state.cells[rows]]
    return corners


def _repair(state: _Cells, cell: int, stay: set[int]) -> bool:
    """Make the best change at a cell, if there is one; tell whether."""
    if not state.alive[cell]:
        return False
    best = max(_changes(state, cell, stay), key=lambda change: change.margin, default=None)
    if best is None or best.margin <= 0.0:
        return False
    around = state.around(best.node)
    state.points[best.node] = best.place
    if best.onto != best.node:
        state.alive[around[(state.cells[around] == best.onto).any(axis=1)]] = False
        state.cells[around] = np.where(state.cells[around] == best.node, best.onto, state.cells[around])
    return True


def _changes(state: _Cells, cell: int, stay: set[int]) -> Iterator[_Change]:
    """Yield the changes at a cell that make the worst cell around better."""
    nodes = [int(node) for node in state.cells[cell]]
    for node in nodes:
        if node in stay:
            continue
        around = state.around(node)
        before = float(tetrahedron_margins(_corners(state, around)).min())
        for onto, target in _targets(state, node, nodes, around):
            margin = _margin_after(state, node, onto, target, around)
            if margin > _BETTER * before:
                yield _Change(node, onto, target, margin)


def _targets(state: _Cells, node: int, nodes: list[int], around: Integers) -> Iterator[tuple[int, Floats]]:
    """Yield what a node may become, itself where it only moves, and where."""
    position = int(state.places[node])
    for onto in nodes:
        if onto != node and position & int(state.places[onto]) == position:
            yield onto, state.points[onto].copy()
    if position & (position - 1) == 0:
        beside = np.unique(state.cells[around])
        middle = state.points[beside[beside != node]].mean(axis=0)
        aims = [middle, *state.points[[other for other in nodes if other != node]]]
        for aim, share in itertools.product(aims, _MOVES):
            yield node, state.points[node] + share * (aim - state.points[node])


def _margin_after(state: _Cells, node: int, onto: int, position: Floats, around: Integers) -> float:
    """Return the least margin of the cells around a node after a change; 0 where the change is none to make."""
    cells, region = state.cells[around], state.region[around]
    stays = ~(cells == onto).any(axis=1) if onto != node else np.ones(len(cells), dtype=bool)
    before = state.points[cells]
    after = np.where((cells == node)[..., None], position, before)
    was, will = _volumes(before), _volumes(after)
    if not stays.any() or (was * will <= 0.0)[stays].any():
        return 0.0
    moved = np.bincount(region, np.abs(was)) - np.bincount(region, np.abs(will) * stays)
    if np.abs(moved).max() > _MOVED * np.abs(was).sum():
        return 0.0
    return float(tetrahedron_margins(after[stays]).min())


def _volumes(corners: Floats) -> Floats:
    volumes: Floats = np.linalg.det(corners[:, 1:] - corners[:, :1])
    return volumes


def _left(state: _Cells) -> Fragments:
    """Return the cells that are left, and the points that they use."""
    cells, region = state.cells[state.alive], state.region[state.alive]
    used, numbers = np.unique(cells, return_inverse=True)
    return Fragments(state.points[used], numbers.reshape(cells.shape), region)


Flags = NDArray[np.bool_]

_SWEEPS_SMOOTHING = 20
_GOOD_ENOUGH = 0.7


def scaled_jacobians(points: Floats, cells: Integers) -> Floats:
    """Return the least scaled Jacobian [-] of the corners of each cell, negative where inverted.

    Arrays: points (n, 2); cells (m, 3); returns (m,).
    """
    corners = points[cells]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    length = np.linalg.norm(ahead, axis=2) * np.linalg.norm(back, axis=2)
    least: Floats = (cross / np.where(length > 0, length, 1.0)).min(axis=1)
    return least


def smooth(points: Floats, cells: Integers, fixed: Flags) -> Floats:
    """Return node positions in which no node's worst cell is worse than before.

    Each sweep moves the free nodes of badly shaped cells half way to the mean of their neighbours, and takes back
    every move that makes the worst cell at a node worse.

    Arrays: points (n, 2) [m]; cells (m, 4); fixed (n,); returns (n, 2) [m].
    """
    before = points
    for _ in range(_SWEEPS_SMOOTHING):
        quality = _node_quality(before, cells)
        moving = ~fixed & (quality < _GOOD_ENOUGH)
        before = _accept_moves(before, _move(before, cells, moving), cells, quality)
    return before


def _move(points: Floats, cells: Integers, moving: Flags) -> Floats:
    start, end = cells.ravel(), np.roll(cells, -1, axis=1).ravel()
    first, second = np.concatenate([start, end]), np.concatenate([end, start])
    count = np.bincount(first, minlength=len(points))
    total = np.column_stack([np.bincount(first, points[second, k], minlength=len(points)) for k in (0, 1)])
    mean = total / np.maximum(count, 1)[:, None]
    moved: Floats = np.where(moving[:, None], 0.5 * (points + mean), points)
    return moved


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
