"""The markers of a video, found in the mean of its first frames."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.tracking.detection import Blobs, find_blobs
from fingerslip.vision.tracking.markers import Markers, known_markers
from fingerslip.vision.tracking.topology import LayoutName, out_of_place, topology

__all__ = ["Reference", "first_frames", "reference_of"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Frame = NDArray[np.uint8]

_ROUNDS = 6
_LEAST_QUALITY = 0.6
_LEAST_SHARE = 0.8  # of the markers; with fewer there is no tracking
_FEWEST = 10  # blobs that may be a sensor's markers where nobody says how many there are
_SPARE, _SPARE_STRENGTH = 8, 0.4
_LEAST_STEP = 1.15
# Markers of a lattice are not nearer to each other than this, in distances between neighbours.
_CLOSEST = 0.65
# Contrast over noise, both summed over the pixels of a marker: the largest of pure noise is about 5.
_LEAST_RATIO = 8.0
_DARK, _BRIGHT = 6.0, 245.0  # grey levels
# Blobs are of the markers' kind within these ratios of contrast, radius and quality; reflections have less quality.
_LEAST_CONTRAST, _SAME_SIZE, _LEAST_LIKENESS = 0.5, 1.5, 0.8


@dataclass(frozen=True)
class Reference:
    """The markers at rest, numbered."""

    markers: Markers  # what is known of them, in the order of their numbers
    ring: NDArray[np.intp] | None  # (n,), ring of each
    angle: Floats | None  # (n,), angle of each around the centre [rad]
    warnings: tuple[str, ...]  # what is not as it should be


def first_frames(frames: Iterable[Frame], count: int) -> tuple[Floats, Frame]:
    """Return the mean of the first frames, and the first.

    Arrays: frames (height, width).
    """
    total, first, number = np.zeros(0), np.zeros((0, 0), dtype=np.uint8), 0
    for number, frame in enumerate(itertools.islice(frames, count), start=1):
        if number == 1:
            total, first = frame.astype(np.float64), frame
        else:
            total += frame
    return total / max(number, 1), first


def reference_of(  # noqa: PLR0917  the options of a search
    image: Floats, mask: Flags | None, n_markers: int | None, layout: LayoutName, bright: bool | None, name: str
) -> Reference:
    """Find, measure and number the markers of the mean of the first frames.

    Arrays: image (height, width) [grey levels]; mask (height, width).
    """
    markers = _best(image, mask, n_markers, layout, bright)
    count = 0 if markers is None else len(markers.position)
    if markers is None or count < (_LEAST_SHARE * n_markers if n_markers else _FEWEST):
        raise InputError(name, _found(image, count), _needed(n_markers), _REPAIR)
    numbered = topology(markers.position, layout)
    warnings = (_of_number(image, mask, n_markers, layout, bright, markers, name), numbered.complaint)
    return Reference(
        markers.taken(numbered.order), numbered.ring, numbered.angle, tuple(text for text in warnings if text)
    )


def _of_number(  # noqa: PLR0917  the options of a search
    image: Floats,
    mask: Flags | None,
    n_markers: int | None,
    layout: LayoutName,
    bright: bool | None,
    markers: Markers,
    name: str,
) -> str:
    """Return what is to be said where there are fewer markers than were asked for, or more like them."""
    if n_markers is None:
        return ""
    alone = _best(image, mask, None, layout, bright)
    same = 0 if alone is None else _of_their_kind(markers, alone)
    if same > n_markers:
        repair = f"give n_markers {same} or none (--markers) for all, or a mask of those that are meant"
        return f"{name}: asked for {n_markers} markers, found {same} of the same kind in the first frames; {repair}"
    count = len(markers.position)
    return f"found {count} of {n_markers} markers in the first frames" if count < n_markers else ""


def _of_their_kind(markers: Markers, others: Markers) -> int:
    """Return how many of other markers look like some."""
    if others.polarity != markers.polarity:
        return 0
    alike = others.amplitude > _LEAST_CONTRAST * np.median(markers.amplitude)
    alike &= np.abs(np.log(others.radius / np.median(markers.radius))) < math.log(_SAME_SIZE)
    return int((alike & (others.quality > _LEAST_LIKENESS * np.median(others.quality))).sum())


_REPAIR = "give the number of markers, whether they are bright, or a mask of where they are"


def _found(image: Floats, count: int) -> str:
    level = float(image.mean())
    light = "dark " if level < _DARK else "overexposed " if level > _BRIGHT else ""
    what = f"{count} markers" if count else "no markers"
    return f"found {what} in the {light}first frames, of mean grey level {level:.0f} of 255"


def _needed(n_markers: int | None) -> str:
    blobs = f"needs at least {_FEWEST} blobs that are alike and stand out of what is around them"
    return f"needs {n_markers}" if n_markers else blobs


def _best(
    image: Floats, mask: Flags | None, n_markers: int | None, layout: LayoutName, bright: bool | None
) -> Markers | None:
    """Return as many markers as can be found, up to their number."""
    best = None
    # Where fewer are there than there should be, those that stand out by themselves may be more.
    for wanted in dict.fromkeys((n_markers, None)):
        blobs = find_blobs(image, mask, wanted, bright)
        found = None if blobs is None else _chosen(image, mask, blobs, wanted, layout)
        if found is not None and _stands_out(image, found) and len(found.position) <= (n_markers or np.inf):
            best = found if best is None or len(found.position) > len(best.position) else best
        if best is not None and len(best.position) == n_markers:
            break
    return best


def _stands_out(image: Floats, markers: Markers) -> bool:
    """Tell whether markers are more than the noise of the image, from pixel to pixel, makes."""
    noise = float(np.median(np.abs(np.diff(image, axis=1)))) / (0.6745 * math.sqrt(2.0))
    pixels = math.sqrt(math.pi) * float(np.median(markers.radius))
    return float(np.median(markers.amplitude)) * pixels > _LEAST_RATIO * noise


def _chosen(
    image: Floats, mask: Flags | None, blobs: Blobs, n_markers: int | None, layout: LayoutName
) -> Markers | None:
    """Return the strongest blobs that look like each other; those that do not make room for the next."""
    if n_markers is None and blobs.step < _LEAST_STEP:
        return None
    count = min(n_markers or blobs.count, len(blobs.position))
    # A regular layout says which of some more are markers.
    spare = blobs.strength[count : count + _SPARE] > _SPARE_STRENGTH * blobs.strength[count - 1]
    behind = count + (int(spare.sum()) if layout == "rings" else 0)
    chosen = np.arange(behind)
    for _ in range(_ROUNDS):
        markers = known_markers(image, mask, blobs.position[chosen], blobs.radius, blobs.bright)
        alike = _alike(markers, blobs.position[chosen], blobs.radius, layout)
        wanted = 0 if n_markers is None else count - int(alike.sum())
        more = np.arange(behind, min(behind + wanted, len(blobs.position)))
        if alike.all() or not alike.any():
            break
        chosen, behind = np.concatenate([chosen[alike], more]), behind + len(more)
        if not len(more):
            break
    markers = known_markers(image, mask, blobs.position[chosen], blobs.radius, blobs.bright)
    alike = _alike(markers, blobs.position[chosen], blobs.radius, layout)
    kept = np.flatnonzero(alike)[: n_markers or None]
    return markers.taken(kept) if kept.size else None


def _alike(markers: Markers, points: Floats, radius: float, layout: LayoutName) -> Flags:
    """Tell which markers look like the typical one, where they were said to be, and are not the same twice."""
    near = np.linalg.norm(markers.position - points, axis=1) < radius
    apart = np.linalg.norm(markers.position[:, None] - markers.position[None], axis=2)
    twice = np.triu(apart < 0.8 * radius, 1).any(axis=0)
    alike: Flags = (markers.quality >= _LEAST_QUALITY) & near & ~twice
    if layout == "rings" and alike.any():
        alike[alike] = ~out_of_place(markers.position[alike])
    if layout == "hex" and alike.sum() > 1:
        alike[alike] = ~_crowded(apart[np.ix_(alike, alike)], markers.quality[alike])
    return alike


def _crowded(apart: Floats, quality: Floats) -> Flags:
    """Tell which blobs lie between markers of a lattice: too near to one that is more like a marker."""
    distance = np.where(np.eye(len(apart), dtype=bool), np.inf, apart)
    near = distance < _CLOSEST * np.median(distance.min(axis=0))
    crowded: Flags = (near & (quality[None] > quality[:, None])).any(axis=1)
    return crowded
