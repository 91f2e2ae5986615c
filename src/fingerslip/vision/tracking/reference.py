"""The markers of a video, found in the mean of its first frames."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.tracking.layouts import LayoutName, out_of_place, topology
from fingerslip.vision.tracking.markers import Markers, known_markers
from fingerslip.vision.video import opencv

__all__ = ["Blobs", "Reference", "Spots", "find_blobs", "first_frames", "reference_of", "spots_of"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Frame = NDArray[np.uint8]

# Standard deviations of the Laplacian of a Gaussian that are tried [px]; a disk of radius r answers most at r / √2.
_SCALES = tuple(1.2 * 2.0 ** (step / 3.0) for step in range(14))
_SMALLEST_SIDE = 24  # px of a reduced image
# Hessians of edges and lines have one large eigenvalue; 1 is a round blob.
_ROUNDNESS = 0.35
# Answers below this share of the brightness are none.
_FAINTEST = 2e-3
_FEWEST_SPOTS, _MOST_SPOTS = 4, 4000
# Weber's law: contrast is taken relative to the brightness around, which lifts markers in dark corners.
_DARKEST = 8.0  # grey levels

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
_REPAIR = "give the number of markers, whether they are bright, or a mask of where they are"


@dataclass(frozen=True)
class Spots:
    """Round spots of one size that are brighter or darker than what is around them, the strongest first."""

    position: Floats  # (n, 2), centres, x and y [px]
    strength: Floats  # (n,)
    radius: float  # [px]
    bright: bool


@dataclass(frozen=True)
class Blobs(Spots):
    """Spots that look like markers."""

    count: int  # how many of them are markers: those behind stand apart by their strength
    step: float  # strength of the last marker over that of the first blob that is none


def spots_of(image: Floats, mask: Flags | None, bright: bool | None) -> list[Spots]:
    """Return the spots of each size and polarity: how they answer to the Laplacian of a Gaussian (Lindeberg 1998).

    Arrays: image (height, width); mask (height, width).
    """
    cv2 = opencv()
    height, width = image.shape
    grey, reach = image.astype(np.float32), max(height, width) / 24.0
    small = cv2.resize(grey, (max(width // 8, 1), max(height // 8, 1)), interpolation=cv2.INTER_AREA)
    around = cv2.resize(cv2.GaussianBlur(small, (0, 0), reach / 8.0), (width, height), interpolation=cv2.INTER_LINEAR)
    contrast = (grey - around) / (around + _DARKEST)
    spots: list[Spots] = []
    for scale in _SCALES:
        shrink = max(1.0, scale / 3.0)
        size = (round(width / shrink), round(height / shrink))
        if min(size) < _SMALLEST_SIDE:
            break
        reduced = cv2.resize(contrast, size, interpolation=cv2.INTER_AREA) if shrink > 1.0 else contrast
        smooth = cv2.GaussianBlur(reduced, (0, 0), scale / shrink)
        for is_bright, points, strengths in _peaks(smooth, scale / shrink, bright):
            places = (points + 0.5) * (width / size[0], height / size[1]) - 0.5
            columns, rows = np.clip(np.rint(places).astype(int), 0, (width - 1, height - 1)).T
            allowed = slice(None) if mask is None else mask[rows, columns]
            spots.append(Spots(places[allowed], strengths[allowed], math.sqrt(2.0) * scale, is_bright))
    return spots


def _peaks(smooth: NDArray[np.float32], sigma: float, bright: bool | None) -> Iterator[tuple[bool, Floats, Floats]]:
    """Yield for each polarity the maxima of the scale-normalised Laplacian that are round, the strongest first."""
    cv2 = opencv()
    along, across, mixed = (
        cv2.Sobel(smooth, cv2.CV_32F, x, y, ksize=3, scale=0.25) for x, y in ((2, 0), (0, 2), (1, 1))
    )
    laplacian = along + across
    is_round = 4.0 * (along * across - mixed**2) > _ROUNDNESS * laplacian**2
    side = 2 * math.ceil(1.5 * sigma) + 1
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    for polarity in (True, False) if bright is None else (bright,):
        answer = (-1.0 if polarity else 1.0) * sigma**2 * laplacian
        rows, columns = np.nonzero((answer >= cv2.dilate(answer, disk)) & (answer > _FAINTEST) & is_round)
        strengths = answer[rows, columns].astype(np.float64)
        order = np.argsort(-strengths, kind="stable")[:_MOST_SPOTS]
        yield polarity, np.column_stack([columns, rows])[order].astype(np.float64), strengths[order]


def find_blobs(spots: Iterable[Spots], n_markers: int | None) -> Blobs | None:
    """Find the markers by the size and polarity at which they stand out most.

    Where the number of markers is known, the size is taken whose `n_markers` strongest spots are strongest, measured by
    the last of them and by its ratio to the one after. Where it is not, the number is the one at which the sorted
    strengths fall most steeply: a threshold can move there without changing the count.
    """
    best, most = None, -math.inf
    for spot in spots:
        strength = spot.strength
        if len(strength) < (n_markers or _FEWEST_SPOTS):
            continue
        count = n_markers or _steepest(strength)
        last = strength[count - 1]
        after = strength[count] if count < len(strength) else 0.05 * last
        step = float(last / max(after, 0.05 * last))
        merit = float(last) * (1.0 - 1.0 / step) * (math.sqrt(count) if n_markers is None else 1.0)
        if merit > most:
            best, most = Blobs(spot.position, strength, spot.radius, spot.bright, count, step), merit
    return best


def _steepest(strengths: Floats) -> int:
    """Return the number of blobs after which the strength falls most."""
    rising = np.log(strengths)
    falls = rising[_FEWEST_SPOTS - 1 : -1] - rising[_FEWEST_SPOTS:]
    if not falls.size:
        return len(strengths)
    # A few strong spots are no field of markers.
    sizes = np.arange(_FEWEST_SPOTS, _FEWEST_SPOTS + len(falls))
    return int(sizes[np.argmax(falls * np.sqrt(np.minimum(sizes, 30.0) / 30.0))])


@dataclass(frozen=True)
class Reference:
    """The markers at rest, numbered."""

    markers: Markers  # what is known of them, in the order of their numbers
    ring: NDArray[np.intp] | None  # (n,), ring of each
    angle: Floats | None  # (n,), angle of each around the centre [rad]
    warnings: tuple[str, ...]  # what is not as it should be


def first_frames(frames: Iterable[Frame], count: int) -> tuple[Floats, Frame]:
    """Return the mean of the first frames, and the first, both (height, width)."""
    chosen = itertools.islice(frames, count)
    first = next(chosen, np.zeros((0, 0), dtype=np.uint8))
    total, number = first.astype(np.float64), 1
    for frame in chosen:
        total += frame
        number += 1
    return total / number, first


def reference_of(  # noqa: PLR0917  the options of a search
    image: Floats, mask: Flags | None, n_markers: int | None, layout: LayoutName, bright: bool | None, name: str
) -> Reference:
    """Find, measure and number the markers of the mean of the first frames.

    Arrays: image (height, width) [grey levels]; mask (height, width).
    """
    spots = spots_of(image, mask, bright)
    markers = _best(image, mask, spots, n_markers, layout)
    count = 0 if markers is None else len(markers.position)
    if markers is None or count < (_LEAST_SHARE * n_markers if n_markers else _FEWEST):
        level = float(image.mean())
        light = "dark " if level < _DARK else "overexposed " if level > _BRIGHT else ""
        fault = f"found {count or 'no'} markers in the {light}first frames, of mean grey level {level:.0f} of 255"
        blobs = f"at least {_FEWEST} blobs that are alike and stand out of what is around them"
        raise InputError(name, fault, f"needs {n_markers or blobs}", _REPAIR)
    warnings = []
    if n_markers is not None:
        same = _count_alike(markers, _best(image, mask, spots, None, layout))
        if same > n_markers:
            repair = f"give n_markers {same} or none (--markers) for all, or a mask of those that are meant"
            fault = f"asked for {n_markers} markers, found {same} of the same kind in the first frames"
            warnings.append(f"{name}: {fault}; {repair}")
        elif count < n_markers:
            warnings.append(f"found {count} of {n_markers} markers in the first frames")
    numbered = topology(markers.position, layout)
    warnings += [numbered.complaint] if numbered.complaint else []
    return Reference(markers.select(numbered.order), numbered.ring, numbered.angle, tuple(warnings))


def _count_alike(markers: Markers, others: Markers | None) -> int:
    """Return how many of other markers look like some."""
    if others is None or others.polarity != markers.polarity:
        return 0
    alike = others.amplitude > _LEAST_CONTRAST * np.median(markers.amplitude)
    alike &= np.abs(np.log(others.radius / np.median(markers.radius))) < math.log(_SAME_SIZE)
    return int((alike & (others.quality > _LEAST_LIKENESS * np.median(others.quality))).sum())


def _best(
    image: Floats, mask: Flags | None, spots: list[Spots], n_markers: int | None, layout: LayoutName
) -> Markers | None:
    """Return as many markers as can be found, up to their number."""
    best = None
    # Where fewer are there than there should be, those that stand out by themselves may be more.
    for wanted in dict.fromkeys((n_markers, None)):
        blobs = find_blobs(spots, wanted)
        choice = None if blobs is None else _choose(image, mask, blobs, wanted, layout)
        if choice is not None and _stands_out(image, choice) and len(choice.position) <= (n_markers or np.inf):
            best = choice if best is None or len(choice.position) > len(best.position) else best
        if best is not None and len(best.position) == n_markers:
            break
    return best


def _stands_out(image: Floats, markers: Markers) -> bool:
    """Tell whether markers are more than the noise of the image, from pixel to pixel, makes."""
    noise = float(np.median(np.abs(np.diff(image, axis=1)))) / (0.6745 * math.sqrt(2.0))
    pixels = math.sqrt(math.pi) * float(np.median(markers.radius))
    return float(np.median(markers.amplitude)) * pixels > _LEAST_RATIO * noise


def _choose(
    image: Floats, mask: Flags | None, blobs: Blobs, n_markers: int | None, layout: LayoutName
) -> Markers | None:
    """Return the strongest blobs that look like each other; those that do not make room for the next."""
    if n_markers is None and blobs.step < _LEAST_STEP:
        return None
    count = min(n_markers or blobs.count, len(blobs.position))
    # A regular layout says which of some more are markers.
    spare = blobs.strength[count : count + _SPARE] > _SPARE_STRENGTH * blobs.strength[count - 1]
    behind = count + (int(spare.sum()) if layout == "rings" else 0)
    chosen, is_last = np.arange(behind), False
    for turn in itertools.count(1):
        points = blobs.position[chosen]
        markers = known_markers(image, mask, points, blobs.radius, blobs.bright)
        alike = _alike(markers, points, blobs.radius, layout)
        if is_last or alike.all() or not alike.any():
            break
        wanted = 0 if n_markers is None else count - int(alike.sum())
        more = np.arange(behind, min(behind + wanted, len(blobs.position)))
        chosen, behind = np.concatenate([chosen[alike], more]), behind + len(more)
        is_last = not len(more) or turn == _ROUNDS
    rows = np.flatnonzero(alike)[: n_markers or None]
    return markers.select(rows) if rows.size else None


def _alike(markers: Markers, points: Floats, radius: float, layout: LayoutName) -> Flags:
    """Tell which markers look like the typical one, where they were said to be, and are not the same twice."""
    near = np.linalg.norm(markers.position - points, axis=1) < radius
    apart = np.linalg.norm(markers.position[:, None] - markers.position[None], axis=2)
    twice = np.triu(apart < 0.8 * radius, 1).any(axis=0)
    alike: Flags = (markers.quality >= _LEAST_QUALITY) & near & ~twice
    if layout == "rings" and alike.any():
        alike[alike] = ~out_of_place(markers.position[alike])
    if layout == "hex" and alike.sum() > 1:
        # Blobs between the markers of a lattice are too near to one that is more like a marker.
        quality, distance = markers.quality[alike], apart[np.ix_(alike, alike)]
        np.fill_diagonal(distance, np.inf)
        near = distance < _CLOSEST * np.median(distance.min(axis=0))
        alike[alike] = ~(near & (quality[None] > quality[:, None])).any(axis=1)
    return alike
