"""How markers lie: what the neighbours of each say of where it is, and their numbers by their layout.

Layouts are concentric rings, hexagonal lattices, square grids, or rows of free markers.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from fingerslip.arrays import Flags, Floats

Integers = NDArray[np.intp]

_COUNT = 8
_BINS = 6  # bins of shifts that are counted, to a distance between markers
_ROUNDS = 4
# So many neighbours that are displaced alike, within this share of what is allowed, are enough.
_SOME, _ALIKE = 2, 0.25


def nearest_neighbours(points: Floats) -> tuple[Integers, Floats]:
    """Return the nearest neighbours (n, k) of points (n, 2) [px], and the distance (n,) to the first [px]."""
    count = min(_COUNT, len(points) - 1)
    if count < 1:
        return np.empty((len(points), 0), dtype=np.intp), np.full(len(points), np.inf)
    distances, indices = cKDTree(points).query(points, k=count + 1)
    return indices[:, 1:].astype(np.intp), distances[:, 1].astype(np.float64)


def expected_displacement(displacement: Floats, usable: Flags, neighbours: Integers) -> tuple[Floats, Integers]:
    """Return the median displacement (n, 2) [px] of the neighbours (n, k) that are usable, and how many there are."""
    count = usable[neighbours].sum(axis=1)
    if not neighbours.shape[1]:
        return np.full_like(displacement, np.nan), count
    # What is not usable comes last.
    values = np.sort(np.where(usable[neighbours][..., None], displacement[neighbours], np.inf), axis=1)
    rows = np.arange(len(displacement))
    middle = 0.5 * (values[rows, np.maximum(count - 1, 0) // 2] + values[rows, np.maximum(count, 1) // 2 * (count > 1)])
    return np.where(count[:, None] > 0, middle, np.nan), count


def consistent(displacement: Floats, sure: Flags, neighbours: Integers, allowed: Floats) -> Flags:
    """Tell which markers are displaced as their neighbours are: about as the median of them, or as some of them.

    Where a contact slips in part, markers at its edge go with the few on their side. Arrays: displacement (n, 2) [px];
    sure (n,); neighbours (n, k); allowed (n,) [px].
    """
    accepted = sure.copy()
    for _ in range(_ROUNDS):
        expected, count = expected_displacement(displacement, accepted, neighbours)
        far = accepted & (count > 2) & (np.linalg.norm(displacement - expected, axis=1) > allowed)
        apart = np.linalg.norm(displacement[neighbours[far]] - displacement[far, None], axis=2)
        alike = (accepted[neighbours[far]] & (apart < _ALIKE * allowed[far, None])).sum(axis=1)
        far[far] = alike < _SOME
        if not far.any():
            break
        accepted &= ~far
    return accepted


def common_shift(points: Floats, candidates: Floats, spacing: float) -> Floats:
    """Return the shift (2,) [px] at which most points (n, 2) [px] have a candidate (m, 2) [px].

    Markers that move by more than half their distance look like others that moved the other way, so nothing local tells
    the two apart. The pattern as a whole does, because it ends somewhere.
    """
    shifts = (candidates[None] - points[:, None]).reshape(-1, 2)
    cells = np.rint(shifts * (_BINS / spacing)).astype(np.intp)
    low = cells.min(axis=0) - 1
    size = cells.max(axis=0) - low + 2
    votes = np.zeros(size, dtype=np.intp)
    np.add.at(votes, tuple((cells - low).T), 1)
    # Neighbouring cells vote together.
    near = np.sum([np.roll(votes, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=0)
    best = np.array(np.unravel_index(int(near.argmax()), near.shape)) + low
    return np.asarray(shifts[np.abs(cells - best).max(axis=1) <= 1].mean(axis=0))


def assign(expected: Floats, reach: Floats, candidates: Floats, power: float = 1.0) -> tuple[Integers, Integers]:
    """Match markers and candidates one to one so that the sum of all distances, in shares of the reach, is smallest.

    Or that of a power of them. A marker that is not matched counts as one at the end of its reach. Arrays: expected
    (n, 2), reach (n,), candidates (m, 2) [px]; returns (k,), (k,).
    """
    apart = cdist(expected, candidates) / reach[:, None]
    cost = np.minimum(apart, 1.0)
    rows, columns = linear_sum_assignment(cost if power == 1.0 else cost**power)
    near = apart[rows, columns] < 1.0
    return rows[near], columns[near]


LayoutName = Literal["auto", "rings", "hex", "grid", "free"]

# A gap between sorted radii of this share of the distance between neighbours separates two rings.
_GAP = 0.45
# How far a marker may lie from where a lattice has it, in distances between neighbours, where the layout is said and
# where it is found.
_OFF_LATTICE, _CLOSE = 0.4, 0.2
# Rings have at least so many markers, and none much nearer to the next than the others are.
_FEWEST = 4
_FEWEST_OF_A_LAYOUT = 7  # markers
_ODD = 0.05  # share of the markers that may not fit a layout
_NARROW = 0.65
# A gap between sorted heights of this share of the distance between neighbours separates two rows of free markers.
_ROW = 0.2
# Steps of lattices, by rising angle.
_STEPS: dict[LayoutName, tuple[tuple[int, int], ...]] = {
    "hex": ((1, 0), (0, 1), (-1, 1), (-1, 0), (0, -1), (1, -1)),
    "grid": ((1, 0), (0, 1), (-1, 0), (0, -1)),
}


@dataclass(frozen=True)
class Topology:
    """The order of markers."""

    layout: str  # the layout that they have
    order: Integers  # (n,), which of the detected markers has each number
    ring: Integers | None  # (n,), ring of each marker, in the new order
    angle: Floats | None  # (n,) [rad]
    complaint: str = ""  # what does not fit the layout


def topology(points: Floats, layout: LayoutName) -> Topology:
    """Return the order of markers (n, 2) [px]: ring by ring and by rising angle, or by rows in grids and where free."""
    if layout == "free" or len(points) < 2:
        by_height = np.argsort(points[:, 1])
        gap = _ROW * _spacing(points) if len(points) > 1 else 0.0
        row = np.cumsum(np.diff(points[by_height, 1], prepend=-np.inf) > gap)[np.argsort(by_height)]
        return Topology("free", np.lexsort((points[:, 0], row)), None, None)
    centre = _centre(points)
    if layout == "rings":
        ring, complaint = _circles(points, centre)
    else:
        cell, is_on = _lattice(points, centre, _STEPS[layout])
        off, words = int((~is_on).sum()), "square grid" if layout == "grid" else "hexagonal lattice"
        complaint = f"{off} of {len(points)} markers are not on the {words}" if off else ""
        if layout == "grid":
            return Topology(layout, np.lexsort((cell[:, 0], cell[:, 1], ~is_on)), None, None, complaint)
        # Those on no lattice are in a ring of their own.
        ring = np.maximum(np.abs(cell).max(axis=1), np.abs(cell.sum(axis=1)))
        ring[~is_on] = ring[is_on].max() + 1
    dx, dy = (points - centre).T
    # Rounding keeps the marker on the x axis first in its ring, wherever noise puts it.
    angle = np.arctan2(dy, dx) % (2.0 * math.pi)
    first = 0.25 * math.pi / np.maximum(np.bincount(ring, minlength=ring.max() + 1)[ring], 1)
    order = np.lexsort(((angle + first) % (2.0 * math.pi), ring))
    return Topology(layout, order, ring[order], angle[order], complaint)


def layout_of(points: Floats) -> LayoutName:
    """Return the first layout that nearly all points (n, 2) [px] fit closely."""
    lattices: tuple[LayoutName, ...] = ("hex", "grid")
    for name in lattices if len(points) >= _FEWEST_OF_A_LAYOUT else ():
        if misfits(points, name).mean() <= _ODD:
            return name
    odd = misfits(points, "rings")
    if len(points) < _FEWEST_OF_A_LAYOUT or odd.mean() > _ODD:
        return "free"
    ring, complaint = _circles(points[~odd], _centre(points))
    return "free" if complaint or ring.max() < 2 else "rings"


def misfits(points: Floats, layout: LayoutName) -> Flags:
    """Tell which points (n, 2) [px] do not fit a layout closely: reflections among markers, where they are few."""
    odd = np.zeros(len(points), dtype=bool)
    if layout == "free" or len(points) < _FEWEST:
        return odd
    centre = _centre(points)
    if layout != "rings":
        return ~_lattice(points, centre, _STEPS[layout], _CLOSE)[1]
    ring, _ = _circles(points, centre)
    for members in (np.flatnonzero(ring == number) for number in range(1, int(ring.max()) + 1)):
        if len(members) < _FEWEST:
            odd[members] = True
            continue
        dx, dy = (points[members] - centre).T
        angle, radius = np.arctan2(dy, dx), np.hypot(dx, dy)
        order = np.argsort(angle)
        gaps = np.diff(angle[order], append=angle.min() + 2.0 * math.pi)
        even = float(np.median(gaps))
        # Without a member the gaps on its sides become one, which is as wide as the others if it did not belong there.
        without = np.abs(gaps + np.roll(gaps, 1) - even) / even
        off = np.abs(radius[order] / np.median(radius) - 1.0) / even
        # Of two that are too near one stands between the others.
        first = np.flatnonzero(gaps < _NARROW * even)
        second = (first + 1) % len(order)
        odd[members[order[np.where((without - off)[first] <= (without - off)[second], first, second)]]] = True
    return odd


def _centre(points: Floats) -> Floats:
    """Return the marker in the middle, or the middle where no marker is near it."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    distance, nearest = cKDTree(points).query(middle)
    return np.asarray(points[nearest]) if distance < 0.5 * _spacing(points) else middle


def _spacing(points: Floats) -> float:
    return float(np.median(cKDTree(points).query(points, k=2)[0][:, 1]))


def _circles(points: Floats, centre: Floats) -> tuple[Integers, str]:
    """Return the ring of each marker, by gaps between their distances from the centre; ellipses are made circles."""
    offset = points - centre
    spread = offset.T @ offset / len(points)
    scale = np.sqrt(np.trace(spread) / 2.0)
    values, vectors = np.linalg.eigh(spread)
    radius = np.linalg.norm(offset @ vectors / np.sqrt(np.maximum(values, 1e-12)), axis=1) * scale
    order = np.argsort(radius)
    ring = np.empty(len(points), dtype=np.intp)
    ring[order] = np.cumsum(np.diff(radius[order], prepend=radius.min()) > _GAP * _spacing(points))
    if radius.min() > 0.5 * _spacing(points):
        ring += 1  # no marker in the centre
    counts = np.bincount(ring)
    outer = counts[counts > 1]
    uneven = len(outer) > 1 and bool((np.diff(outer) <= 0).any())
    return ring, f"rings have {', '.join(map(str, counts))} markers, not more outwards" if uneven else ""


def _lattice(
    points: Floats, centre: Floats, directions: tuple[tuple[int, int], ...], off: float = _OFF_LATTICE
) -> tuple[Integers, Flags]:
    """Return the cell of each marker on a lattice (n, 2), and which have one (n,), by local steps from the centre."""
    tree, count = cKDTree(points), len(directions)
    start = int(tree.query(centre)[1])
    dx, dy = points[tree.query(points[start], k=min(count + 1, len(points)))[1][1]] - points[start]
    # The first direction is the one nearest to x.
    angles = (np.arange(count) - round(math.atan2(dy, dx) * count / (2.0 * math.pi))) * (2.0 * math.pi / count)
    turned = np.column_stack([np.cos(angles) * dx - np.sin(angles) * dy, np.sin(angles) * dx + np.cos(angles) * dy])
    cells, steps, queue = {start: (0, 0)}, {start: turned}, deque([start])
    while queue:
        here = queue.popleft()
        for k, (q, r) in enumerate(directions):
            distance, index = tree.query(points[here] + steps[here][k])
            neighbour = int(index)
            if neighbour not in cells and distance < off * float(np.linalg.norm(steps[here][k])):
                cells[neighbour] = (cells[here][0] + q, cells[here][1] + r)
                # The step that was seen, and its opposite, are those from there on.
                steps[neighbour] = steps[here].copy()
                steps[neighbour][k] = 0.5 * (steps[here][k] + points[neighbour] - points[here])
                steps[neighbour][(k + count // 2) % count] = -steps[neighbour][k]
                queue.append(neighbour)
    cell, is_on = np.zeros((len(points), 2), dtype=np.intp), np.zeros(len(points), dtype=bool)
    cell[list(cells)], is_on[list(cells)] = list(cells.values()), True
    return cell, is_on
