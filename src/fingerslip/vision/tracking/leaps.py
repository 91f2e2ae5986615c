"""Markers that slip alone: they leap farther than their neighbours tell, and may end beside or on another marker.

A marker that was seen in the last frame, and is neither matched nor where it was, has gone to a blob that is new, or
to one that has grown: two markers that touch are one blob, of which each takes half.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from fingerslip.arrays import Flags, Floats
from fingerslip.vision.tracking.blobs import Blobs
from fingerslip.vision.tracking.layouts import Integers, assign, expected_displacement
from fingerslip.vision.tracking.markers import Markers
from fingerslip.vision.video import Frame, opencv

# How far a marker may leap in a frame, in distances of neighbours.
_LEAP = 1.3
# A blob is new where there was none so near, in distances of neighbours.
_NEW = 0.25
# Area of a blob that two markers share, in those of a marker. Where a larger share of the blobs is so, it says nothing.
_FEWEST_DISKS, _MOST_DISKS, _RARE = 1.1, 2.3, 0.34
# Where many leap at once, by about the same, long ways count more than short ones.
_EVEN = 3.0
# Markers that touched and both go farther than this, in distances of neighbours, are told apart anew.
_ON = 0.15


@dataclass(frozen=True)
class State:
    """What the tracker remembers between frames."""

    position: Floats  # (n, 2), where each marker is, as its neighbours have it where it is not seen [px]
    seen: Flags  # (n,), whether it was seen in the last frame
    light: float  # strength of the markers in shares of that at rest, following slow changes
    image: Frame | None  # (height, width), the last frame in which markers were seen
    blobs: Floats  # (m, 2), all blobs of the last frame [px]
    visible: int = 0  # markers that were seen, and blobs like them among or beside them that no marker has


@dataclass(frozen=True)
class Match:
    """Markers and blobs of a frame."""

    guess: Floats  # (n, 2), where each marker was expected [px]
    position: Floats  # (n, 2) [px]
    sure: Flags  # (n,), whether it has a blob
    used: Integers  # (n,), which
    shares: Flags  # (n,), whether it has half of it
    explained: float  # how many markers are how near to where they were expected


def rematch(markers: Markers, state: State, image: Frame, blobs: Blobs, match: Match) -> Match:
    """Return a match in which markers that were lost now have new blobs, or half of a blob, if more have one.

    The image is (height, width).
    """
    leaping = state.seen & ~match.sure
    if not leaping.any():
        return match
    hosts, halves = _shared(markers, state, image, blobs, match)
    is_new = cKDTree(state.blobs).query(blobs.position)[0] > _NEW * float(np.median(markers.spacing))
    taken = match.used[match.sure]
    free = np.setdiff1d(np.flatnonzero(is_new), taken)
    if not hosts.size and not free.size:
        return match
    # One half has the number of its blob, the other one comes after all blobs.
    first, second = match.used[hosts], len(blobs.strength) + np.arange(len(hosts))
    places = np.concatenate([blobs.position, halves[:, 1]])
    places[first] = halves[:, 0]
    everyone = leaping | match.sure
    leaping[hosts] = True
    # What leaps may push others on, and the last one onto another marker.
    matches = [match]
    for rows, numbers, power in ((leaping, first, 1.0), (everyone, taken, _EVEN)):
        columns = np.concatenate([free, numbers, second])
        reached, chosen = assign(match.guess[rows], _LEAP * markers.spacing[rows], places[columns], power)
        reached, columns = np.flatnonzero(rows)[reached], columns[chosen]
        position, sure, used = match.position.copy(), match.sure & ~rows, match.used.copy()
        position[reached], sure[reached], used[reached] = places[columns], True, columns
        matches.append(dataclasses.replace(match, position=position, sure=sure, used=used))
    best = max(matches, key=lambda each: int(each.sure.sum()))
    position, used, shares = best.position.copy(), best.used.copy(), best.shares.copy()
    for number, half in zip(first, second, strict=True):
        ends = best.sure & np.isin(best.used, (number, half))
        used[ends] = number
        if ends.sum() > 1:
            shares |= ends
        else:
            position[ends] = blobs.position[number]
    return dataclasses.replace(best, position=position, used=used, shares=shares)


def untangle(markers: Markers, before: Floats, match: Match) -> Match:
    """Return a match in which markers that touched before (n, 2) [px], and go on, are where neighbours expect them."""
    position, used = match.position.copy(), match.used.copy()
    goes_on = match.sure & (np.linalg.norm(position - before, axis=1) > _ON * markers.spacing)
    for pair in cKDTree(before).query_pairs(2.0 * float(np.median(markers.radius)), output_type="ndarray"):
        if goes_on[pair].all():
            expected, _ = expected_displacement(position - markers.position, match.sure, markers.neighbours)
            places = (markers.position + expected)[pair]
            straight, crossed = (np.linalg.norm(position[p] - places, axis=1).sum() for p in (pair, pair[::-1]))
            if crossed < straight:
                position[pair], used[pair] = position[pair[::-1]], used[pair[::-1]]
    return dataclasses.replace(match, position=position, used=used)


def _shared(markers: Markers, state: State, image: Frame, blobs: Blobs, match: Match) -> tuple[Integers, Floats]:
    """Return whose blobs, in reach of markers that are lost, are two now, (k,), and their halves (k, 2, 2) [px]."""
    apart = cdist(match.guess[state.seen & ~match.sure], match.position)
    candidates = np.flatnonzero(match.sure & (apart < 2.0 * _LEAP * markers.spacing).any(axis=0)).tolist()
    places = blobs.position[match.used]
    halves = {host: _halves(markers, host, image, blobs.position, places[host]) for host in candidates}
    double = [host for host, half in halves.items() if half is not None]
    if len(double) > _RARE * len(candidates):
        double = []
    # Glue on a marker was there in the last frame, too.
    last, touches = image if state.image is None else state.image, (apart < 2.0 * markers.radius).any(axis=0)
    hosts = [h for h in double if touches[h] or _halves(markers, h, last, state.blobs, state.position[h]) is None]
    return np.array(hosts, dtype=np.intp), np.array([halves[host] for host in hosts]).reshape(-1, 2, 2)


def _halves(markers: Markers, marker: int, image: Frame, places: Floats, place: Floats) -> Floats | None:
    """Return the centres (2, 2) [px] of the two disks that a blob may be, None where it is one disk or many blobs.

    Arrays: image (height, width), places of all blobs (m, 2), that of the marker's blob (2,) [px].
    """
    radius = float(markers.radius[marker])
    x, y = np.rint(place).astype(int)
    if not (0 <= y < image.shape[0] and 0 <= x < image.shape[1]):
        return None
    side = math.ceil(2.5 * radius)
    top, left = max(y - side, 0), max(x - side, 0)
    patch = markers.polarity * image[top : y + side + 1, left : x + side + 1].astype(np.float32)
    labels = opencv().connectedComponents((patch > 0.5 * (patch[y - top, x - left] + patch.min())).astype(np.uint8))[1]
    is_blob = labels == labels[y - top, x - left]
    columns, rows = np.rint(places).astype(int).T - np.array([[left], [top]])
    inside = (columns >= 0) & (columns < patch.shape[1]) & (rows >= 0) & (rows < patch.shape[0])
    disks = is_blob.sum() / (math.pi * radius**2)
    if is_blob[rows[inside], columns[inside]].sum() > 1 or not _FEWEST_DISKS < disks < _MOST_DISKS:
        return None
    points = np.argwhere(is_blob)[:, ::-1] + np.array([left, top], dtype=np.float64)
    # Two disks are longer than wide by the square of half their distance.
    variances, axes = np.linalg.eigh(np.cov(points.T))
    half = math.sqrt(variances[1] - variances[0]) * axes[:, 1]
    return np.asarray(points.mean(axis=0) + np.stack([half, -half]))
