"""What the tracker knows of each marker: where it was at rest, what it looks like, and who its neighbours are."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from fingerslip.errors import InputError
from fingerslip.vision.tracking.kernels import (
    AMPLITUDE,
    COLUMNS,
    CORRELATION,
    N_PROFILE,
    WEIGHT,
    learn_profiles,
    learn_shapes,
    measure_markers,
)
from fingerslip.vision.tracking.neighbours import nearest_neighbours

__all__ = [
    "LayoutName",
    "Markers",
    "Measured",
    "Topology",
    "check_layout",
    "known_markers",
    "measure",
    "out_of_place",
    "topology",
]


Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ALL = slice(None)
_WINDOW = 1.9  # radii of the marker
_MARGIN = 1.5  # px, for blur
_SMALLEST_WINDOW = 3.0  # px
_ROUNDS = 3
_OUTSIDE = 6  # samples of a profile that are the background
# A profile has no edge sharper than this [px]: pixels are no points, and a fit needs its slope.
_SOFT = 0.4
_CIRCLE = (1.0, 0.0, 1.0)
# Quality so far below the median is odd, in itself and in median deviations.
_BADLY, _OUTLYING = 0.03, 6.0
_CENTRE = 4  # samples of a profile that are the top


@dataclass(frozen=True)
class Markers:
    """Markers as they look in the rest frames."""

    position: Floats  # (n, 2), positions at rest [px]
    radius: Floats  # (n,), radius at half the contrast, and radius of the window in which a marker is measured [px]
    window: Floats  # (n,), radius at half the contrast, and radius of the window in which a marker is measured [px]
    shape: Floats  # (n, 3), ellipse of each, as the metric of :mod:`fingerslip.vision.tracking.kernels`
    profiles: Floats  # (n, N_PROFILE)
    polarity: float  # 1 for markers brighter than what is around them, -1 for darker ones
    spacing: Floats  # (n,), distance to the nearest neighbour [px]
    neighbours: NDArray[np.intp]  # (n, k), neighbours, the nearest first
    amplitude: Floats  # (n,), contrast of each [grey levels]
    quality: Floats  # (n,), quality of each in the mean of the rest frames that it was learnt from

    def taken(self, order: NDArray[np.intp]) -> Markers:
        """Return some of the markers, in another order."""
        position = self.position[order]
        neighbours, spacing = nearest_neighbours(position)
        return Markers(
            position,
            self.radius[order],
            self.window[order],
            self.shape[order],
            self.profiles[order],
            self.polarity,
            spacing,
            neighbours,
            self.amplitude[order],
            self.quality[order],
        )


@dataclass(frozen=True)
class Measured:
    """Markers as they were measured in a frame."""

    position: Floats  # (n, 2), positions [px], NaN where nothing was found
    amplitude: Floats  # (n,), contrast [grey levels]
    quality: Floats  # (n,)


def measure(
    markers: Markers,
    image: NDArray[np.uint8],
    mask: Flags | None,
    start: Floats,
    which: NDArray[np.intp] | slice = _ALL,
) -> Measured:
    """Measure markers in an image, each from its own start.

    Parameters
    ----------
    markers : Markers
        What is known of them.
    image : (height, width) array of uint8
        The image.
    mask : (height, width) array of bool or None
        Pixels that count.
    start : (n, 2) array
        Where to begin [px]; NaN where nothing is to be measured.
    which : (n,) array of int, optional
        The marker of each start; all of them, once each, without it.
    """
    out = np.empty((len(start), COLUMNS))
    counted = np.empty((0, 0), dtype=bool) if mask is None else mask
    radius, window, shape = markers.radius[which], markers.window[which], markers.shape[which]
    measure_markers(image, counted, start, radius, window, shape, markers.profiles[which], markers.polarity, out)
    return Measured(out[:, :2].copy(), out[:, AMPLITUDE].copy(), out[:, CORRELATION] * out[:, WEIGHT])


def known_markers(image: Floats, mask: Flags | None, points: Floats, radius: float, bright: bool) -> Markers:
    """Learn what markers look like from where they roughly are.

    Arrays: image (height, width) [grey levels]; mask (height, width); points (n, 2) [px]; radius [px].
    """
    grey = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    polarity = 1.0 if bright else -1.0
    neighbours, spacing = nearest_neighbours(points)
    radii, places = np.full(len(points), radius), points.copy()
    shape = np.tile(_CIRCLE, (len(points), 1))
    ones = np.ones(len(points))
    for turn in range(_ROUNDS):
        window = _windows(radii, spacing)
        profiles = np.empty((len(points), N_PROFILE))
        learn_profiles(image, places, window, shape, polarity, profiles)
        profiles = _normalise(profiles, window)
        markers = Markers(places, radii, window, shape, profiles, polarity, spacing, neighbours, ones, ones)
        markers, places = _measured_again(markers, grey, mask)
        radii = _half_height(profiles, window)
        if turn < _ROUNDS - 1:
            learn_shapes(image, places, radii, window, polarity, shape)
    markers = dataclasses.replace(markers, radius=radii)
    return _measured_again(_with_typical_looks(markers), grey, mask)[0]


def _measured_again(markers: Markers, grey: NDArray[np.uint8], mask: Flags | None) -> tuple[Markers, Floats]:
    """Return markers where they are measured in an image, and their positions; those not found stay where they were."""
    measured = measure(markers, grey, mask, markers.position)
    is_measured = np.isfinite(measured.position[:, :1])
    places = np.where(is_measured, measured.position, markers.position)
    again = dataclasses.replace(
        markers,
        position=places,
        amplitude=measured.amplitude,
        quality=np.where(is_measured[:, 0], measured.quality, 0.0),
    )
    return again, places


def _with_typical_looks(markers: Markers) -> Markers:
    """Return markers of which those that fit badly look like the others: a reflection beside them was learnt too."""
    apart = np.median(markers.quality) - markers.quality
    odd = apart > max(_BADLY, _OUTLYING * float(np.median(np.abs(apart))))
    if not odd.any() or odd.all():
        return markers
    radius = np.where(odd, np.median(markers.radius[~odd]), markers.radius)
    return dataclasses.replace(
        markers,
        radius=radius,
        window=_windows(radius, markers.spacing),
        shape=np.where(odd[:, None], _CIRCLE, markers.shape),
        profiles=np.where(odd[:, None], np.median(markers.profiles[~odd], axis=0), markers.profiles),
    )


def _windows(radii: Floats, spacing: Floats) -> Floats:
    # The neighbours stay outside.
    room = np.maximum(spacing - 1.1 * radii, 0.5 * spacing)
    windows: Floats = np.maximum(np.minimum(_WINDOW * radii + _MARGIN, room), _SMALLEST_WINDOW)
    return windows


def _normalise(profiles: Floats, window: Floats) -> Floats:
    """Return profiles from 1 in the centre to 0 at the edge, half of each what all have in common."""
    samples = _SOFT * (profiles.shape[1] - 1) / window
    filled = np.array(
        [
            gaussian_filter1d(_fill(profile), width, mode="nearest")
            for profile, width in zip(profiles, samples, strict=True)
        ]
    )
    outside = filled[:, -_OUTSIDE:].mean(axis=1, keepdims=True)
    height = filled[:, :_CENTRE].mean(axis=1, keepdims=True) - outside
    profile_scaled = np.clip((filled - outside) / np.where(height > 1.0, height, 1.0), -0.5, 1.5)
    common = np.median(profile_scaled, axis=0)
    mixed: Floats = np.where(height > 1.0, 0.5 * profile_scaled + 0.5 * common, common)
    return mixed


def _fill(profile: Floats) -> Floats:
    finite = np.flatnonzero(np.isfinite(profile))
    return np.interp(np.arange(len(profile)), finite, profile[finite]) if finite.size else np.zeros(len(profile))


def _half_height(profiles: Floats, window: Floats) -> Floats:
    """Return where each profile falls to half of its height [px]."""
    radii = np.empty(len(profiles))
    for n, profile in enumerate(profiles):
        below = int(np.argmax(profile < 0.5)) or len(profile) // 2
        share = (profile[below - 1] - 0.5) / max(profile[below - 1] - profile[below], 1e-9)
        radii[n] = (below - 1 + min(max(share, 0.0), 1.0)) * window[n] / (len(profile) - 1)
    return np.asarray(np.clip(radii, 0.5 * np.median(radii), 2.0 * np.median(radii)))


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
    uneven = []
    for number in np.flatnonzero(gaps < _NARROW * even):
        pair = np.array([number, (number + 1) % len(order)])
        uneven.append(members[order[pair[np.argmin((without - off)[pair])]]])
    return np.array(uneven, dtype=np.intp)


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
    steps = {start: np.array([_turn(first, k) for k in range(6)])}
    queue = deque([start])
    while queue:
        here = queue.popleft()
        for k, (q, r) in enumerate(_HEX_STEPS):
            distance, neighbour = tree.query(points[here] + steps[here][k])
            if neighbour not in places and distance < _OFF_LATTICE * float(np.linalg.norm(steps[here][k])):
                places[int(neighbour)] = (places[here][0] + q, places[here][1] + r)
                steps[int(neighbour)] = _adapt(steps[here], k, points[neighbour] - points[here])
                queue.append(int(neighbour))
    ring = np.full(len(points), -1, dtype=np.intp)
    for index, (q, r) in places.items():
        ring[index] = max(abs(q), abs(r), abs(q + r))
    off = int((ring < 0).sum())
    ring[ring < 0] = ring.max() + 1
    return ring, f"{off} of {len(points)} markers are not on the hexagonal lattice" if off else ""


def _turn(vector: Floats, sixths: int) -> Floats:
    angle = sixths * math.pi / 3.0
    turned: Floats = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]) @ vector
    return turned


def _adapt(steps: Floats, k: int, seen: Floats) -> Floats:
    """Return steps of which one was seen, and its opposite with it."""
    adapted = steps.copy()
    adapted[k] = 0.5 * (adapted[k] + seen)
    adapted[(k + 3) % 6] = -adapted[k]
    return adapted
