"""Identities of markers: their order, and in rings or on a hexagonal lattice the ring of each."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.errors import InputError

__all__ = ["LayoutName", "Topology", "check_layout", "out_of_place", "topology"]

Floats = NDArray[np.float64]
Integers = NDArray[np.intp]
LayoutName = Literal["rings", "hex", "free"]

# A gap between sorted radii of this share of the distance between neighbours separates two rings.
_GAP = 0.45
# How far a marker may lie from where the lattice has it, in distances between neighbours.
_OFF_LATTICE = 0.4
# Rings have at least so many markers, and none much nearer to the next than the others are.
_FEWEST = 4
_NARROW = 0.65
# A gap between sorted heights of this share of the distance between neighbours separates two rows of free markers.
_ROW = 0.2
_HEX_STEPS = ((1, 0), (0, 1), (-1, 1), (-1, 0), (0, -1), (1, -1))


@dataclass(frozen=True)
class Topology:
    """The order of markers."""

    order: Integers  # (n,), which of the detected markers has each number
    ring: Integers | None  # (n,), ring of each marker, in the new order
    angle: Floats | None  # (n,) [rad]
    complaint: str = ""  # what does not fit the layout


def check_layout(layout: str) -> None:
    """Raise InputError where a layout has another name than ``rings``, ``hex`` or ``free``."""
    if layout not in get_args(LayoutName):
        raise InputError("layout", f"got {layout!r}", f"needs one of {', '.join(get_args(LayoutName))}")


def topology(points: Floats, layout: LayoutName) -> Topology:
    """Return the order of markers: ring by ring and by rising angle, or by rows of the image where they are free.

    Arrays: points (n, 2) [px].
    """
    check_layout(layout)
    if layout == "free" or len(points) < 2:
        return Topology(np.lexsort((points[:, 0], _rows(points))), None, None)
    centre = _centre(points)
    ring, complaint = _circles(points, centre) if layout == "rings" else _hexagons(points, centre)
    dx, dy = (points - centre).T
    # Rounding keeps the marker on the x axis first in its ring, wherever noise puts it.
    angle = np.arctan2(dy, dx) % (2.0 * math.pi)
    first = 0.25 * math.pi / np.maximum(np.bincount(ring, minlength=ring.max() + 1)[ring], 1)
    sorting = (angle + first) % (2.0 * math.pi)
    order = np.lexsort((sorting, ring))
    return Topology(order, ring[order], angle[order], complaint)


def _rows(points: Floats) -> Integers:
    """Return the row of each point: sorted by y, a new one begins where there is a gap."""
    order = np.argsort(points[:, 1])
    gap = _ROW * _spacing(points) if len(points) > 1 else 0.0
    rows = np.empty(len(points), dtype=np.intp)
    rows[order] = np.concatenate([[0], np.cumsum(np.diff(points[order, 1]) > gap)])
    return rows


def out_of_place(points: Floats) -> NDArray[np.bool_]:
    """Tell which points are no part of evenly spaced rings: of two that are too near, the one the ring is even without.

    Arrays: points (n, 2) [px].
    """
    odd = np.zeros(len(points), dtype=bool)
    if len(points) < _FEWEST:
        return odd
    centre = _centre(points)
    ring, _ = _circles(points, centre)
    for members in (np.flatnonzero(ring == number) for number in range(1, int(ring.max()) + 1)):
        if len(members) < _FEWEST:
            odd[members] = True
        else:
            odd[_uneven(points, centre, members)] = True
    return odd


def _uneven(points: Floats, centre: Floats, members: Integers) -> Integers:
    """Return those members of a ring that stand between its others."""
    dx, dy = (points[members] - centre).T
    angle, radius = np.arctan2(dy, dx), np.hypot(dx, dy)
    order = np.argsort(angle)
    gaps = np.diff(angle[order], append=angle.min() + 2.0 * math.pi)
    even = float(np.median(gaps))
    # Without a member the gaps on its sides become one, which is as wide as the others if it did not belong there.
    without = np.abs(gaps + np.roll(gaps, 1) - even) / even
    off = np.abs(radius[order] / np.median(radius) - 1.0) / even
    found = []
    for place in np.flatnonzero(gaps < _NARROW * even):
        pair = np.array([place, (place + 1) % len(order)])
        found.append(members[order[pair[np.argmin((without - off)[pair])]]])
    return np.array(found, dtype=np.intp)


def _centre(points: Floats) -> Floats:
    """Return the marker in the middle, or the middle where no marker is near it."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    distance, nearest = cKDTree(points).query(middle)
    centre: Floats = points[nearest] if distance < 0.5 * _spacing(points) else middle
    return centre


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
    gaps = np.diff(radius[order])
    ring = np.empty(len(points), dtype=np.intp)
    ring[order] = np.concatenate([[0], np.cumsum(gaps > _GAP * _spacing(points))])
    if radius[order[0]] > 0.5 * _spacing(points):
        ring += 1  # no marker in the centre
    counts = np.bincount(ring)
    outer = counts[counts > 1]
    uneven = len(outer) > 1 and bool((np.diff(outer) <= 0).any())
    return ring, f"rings have {', '.join(map(str, counts))} markers, not more outwards" if uneven else ""


def _hexagons(points: Floats, centre: Floats) -> tuple[Integers, str]:
    """Return the hexagonal ring of each marker, walking over the lattice from the centre with local steps."""
    tree = cKDTree(points)
    start = int(tree.query(centre)[1])
    around = tree.query(points[start], k=min(7, len(points)))[1][1:]
    first = points[around[0]] - points[start]
    places: dict[int, tuple[int, int]] = {start: (0, 0)}
    steps = {start: np.array([_turned(first, k) for k in range(6)])}
    queue = deque([start])
    while queue:
        here = queue.popleft()
        for k, (q, r) in enumerate(_HEX_STEPS):
            distance, there = tree.query(points[here] + steps[here][k])
            if there not in places and distance < _OFF_LATTICE * float(np.linalg.norm(steps[here][k])):
                places[int(there)] = (places[here][0] + q, places[here][1] + r)
                steps[int(there)] = _adapted(steps[here], k, points[there] - points[here])
                queue.append(int(there))
    ring = np.full(len(points), -1, dtype=np.intp)
    for index, (q, r) in places.items():
        ring[index] = max(abs(q), abs(r), abs(q + r))
    off = int((ring < 0).sum())
    ring[ring < 0] = ring.max() + 1
    return ring, f"{off} of {len(points)} markers are not on the hexagonal lattice" if off else ""


def _turned(vector: Floats, sixths: int) -> Floats:
    angle = sixths * math.pi / 3.0
    turned: Floats = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]) @ vector
    return turned


def _adapted(steps: Floats, k: int, seen: Floats) -> Floats:
    """Return steps of which one was seen, and its opposite with it."""
    made = steps.copy()
    made[k] = 0.5 * (made[k] + seen)
    made[(k + 3) % 6] = -made[k]
    return made
