"""The markers of a video, found in the mean of its first frames."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.tracking.markers import LayoutName, Markers, known_markers, out_of_place, topology
from fingerslip.vision.video import opencv

__all__ = [
    "Blobs",
    "Reference",
    "find_blobs",
    "first_frames",
    "reference_of",
]


Floats = NDArray[np.float64]

# Standard deviations of the Laplacian of a Gaussian that are tried [px]; a disk of radius r answers most at r / √2.
_SCALES = tuple(1.2 * 2.0 ** (step / 3.0) for step in range(14))
_SMALLEST_SIDE = 24  # px of a reduced image
# Hessians of edges and lines have one large eigenvalue; 1 is a round blob.
_ROUNDNESS = 0.35
# Answers below this share of the brightness are none.
_FAINTEST = 2e-3
_FEWEST_DETECTION = 4
_MOST = 4000
# Weber's law: contrast is taken relative to the brightness around, which lifts markers in dark corners.
_DARKEST = 8.0  # grey levels


@dataclass(frozen=True)
class Blobs:
    """Blobs that look like markers, the clearest first."""

    position: Floats  # (n, 2), centres, x and y [px]
    strength: Floats  # (n,)
    radius: float  # radius that fits most of them [px]
    bright: bool  # whether they are brighter than what is around them
    count: int  # how many of them are markers: those behind stand apart by their strength
    step: float  # strength of the last marker over that of the first blob that is none


def find_blobs(
    image: Floats, mask: NDArray[np.bool_] | None, n_markers: int | None, bright: bool | None
) -> Blobs | None:
    """Find the markers of an image by the blob size and polarity at which they stand out most.

    For each size of blob (Lindeberg 1998) the answers of the image to the Laplacian of a Gaussian are sorted by
    strength. Where the number of markers is known, the size is taken whose `n_markers` strongest answers are strongest,
    measured by the last of them and by its ratio to the one after. Where it is not, the number is the one at which the
    sorted strengths fall most steeply: a threshold can move there without changing the count.

    Arrays: image (height, width); mask (height, width).
    """
    relative = _relative(image)
    candidates = [_settle_scale(*answer, n_markers) for answer in _answers(relative, mask, bright)]
    usable = [(merit, blobs) for merit, blobs in candidates if blobs is not None]
    return max(usable, key=lambda pair: pair[0])[1] if usable else None


def _relative(image: Floats) -> NDArray[np.float32]:
    """Return the contrast of each pixel to the brightness around it, in shares of that brightness."""
    cv2 = opencv()
    height, width = image.shape
    reach = max(height, width) / 24.0
    small = cv2.resize(
        image.astype(np.float32), (max(width // 8, 1), max(height // 8, 1)), interpolation=cv2.INTER_AREA
    )
    around = cv2.resize(cv2.GaussianBlur(small, (0, 0), reach / 8.0), (width, height), interpolation=cv2.INTER_LINEAR)
    contrast: NDArray[np.float32] = (image.astype(np.float32) - around) / (around + _DARKEST)
    return contrast


def _answers(
    image: NDArray[np.float32], mask: NDArray[np.bool_] | None, bright: bool | None
) -> Iterator[tuple[float, bool, Floats, Floats]]:
    """Yield scale, polarity, positions and strengths of the blobs of each size."""
    cv2 = opencv()
    height, width = image.shape
    for scale in _SCALES:
        shrink = max(1.0, scale / 3.0)
        size = (round(width / shrink), round(height / shrink))
        if min(size) < _SMALLEST_SIDE:
            return
        reduced = cv2.resize(image, size, interpolation=cv2.INTER_AREA) if shrink > 1.0 else image
        sigma = scale / shrink
        smooth = cv2.GaussianBlur(reduced, (0, 0), sigma)
        for polarity in (True, False) if bright is None else (bright,):
            points, strengths = _peaks(smooth, sigma, 1.0 if polarity else -1.0)
            points = (points + 0.5) * (width / size[0], height / size[1]) - 0.5
            allowed = _allowed_pairs(points, mask, image.shape)
            yield scale, polarity, points[allowed], strengths[allowed]


def _peaks(smooth: NDArray[np.float32], sigma: float, polarity: float) -> tuple[Floats, Floats]:
    """Return maxima of the scale-normalised Laplacian that are round, the strongest first."""
    cv2 = opencv()
    along = cv2.Sobel(smooth, cv2.CV_32F, 2, 0, ksize=3, scale=0.25)
    across = cv2.Sobel(smooth, cv2.CV_32F, 0, 2, ksize=3, scale=0.25)
    mixed = cv2.Sobel(smooth, cv2.CV_32F, 1, 1, ksize=3, scale=0.25)
    answer = -polarity * sigma**2 * (along + across)
    side = 2 * math.ceil(1.5 * sigma) + 1
    highest = cv2.dilate(answer, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
    round_ = 4.0 * (along * across - mixed**2) > _ROUNDNESS * (along + across) ** 2
    rows, columns = np.nonzero((answer >= highest) & (answer > _FAINTEST) & round_)
    strengths = answer[rows, columns].astype(np.float64)
    order = np.argsort(-strengths, kind="stable")[:_MOST]
    return np.column_stack([columns, rows])[order].astype(np.float64), strengths[order]


def _allowed_pairs(points: Floats, mask: NDArray[np.bool_] | None, shape: Sequence[int]) -> NDArray[np.bool_]:
    if mask is None:
        return np.ones(len(points), dtype=bool)
    columns = np.clip(np.rint(points[:, 0]).astype(int), 0, shape[1] - 1)
    rows = np.clip(np.rint(points[:, 1]).astype(int), 0, shape[0] - 1)
    allowed: NDArray[np.bool_] = mask[rows, columns]
    return allowed


def _settle_scale(
    scale: float, bright: bool, points: Floats, strengths: Floats, n_markers: int | None
) -> tuple[float, Blobs | None]:
    """Return how clearly the markers stand out at one scale, and the blobs with the count that was settled on."""
    if len(points) < (n_markers or _FEWEST_DETECTION):
        return 0.0, None
    count = n_markers or _steepest(strengths)
    last = strengths[count - 1]
    after = strengths[count] if count < len(strengths) else 0.05 * last
    step = float(last / max(after, 0.05 * last))
    merit = float(last) * (1.0 - 1.0 / step)
    blobs = Blobs(points, strengths, math.sqrt(2.0) * scale, bright, count, step)
    return (merit * math.sqrt(count) if n_markers is None else merit), blobs


def _steepest(strengths: Floats) -> int:
    """Return the number of blobs after which the strength falls most."""
    rising = np.log(strengths)
    falls = rising[_FEWEST_DETECTION - 1 : -1] - rising[_FEWEST_DETECTION:]
    if not falls.size:
        return len(strengths)
    # A few strong spots are no field of markers.
    sizes = np.arange(_FEWEST_DETECTION, _FEWEST_DETECTION + len(falls))
    return int(sizes[np.argmax(falls * np.sqrt(np.minimum(sizes, 30.0) / 30.0))])


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
        raise InputError(name, _words_found(image, count), _needs_words(n_markers), _REPAIR)
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


def _words_found(image: Floats, count: int) -> str:
    level = float(image.mean())
    light = "dark " if level < _DARK else "overexposed " if level > _BRIGHT else ""
    what = f"{count} markers" if count else "no markers"
    return f"found {what} in the {light}first frames, of mean grey level {level:.0f} of 255"


def _needs_words(n_markers: int | None) -> str:
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
        choice = None if blobs is None else _chosen(image, mask, blobs, wanted, layout)
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
    rows = np.flatnonzero(alike)[: n_markers or None]
    return markers.taken(rows) if rows.size else None


def _alike(markers: Markers, points: Floats, radius: float, layout: LayoutName) -> Flags:
    """Tell which markers look like the typical one, where they were said to be, and are not the same twice."""
    near = np.linalg.norm(markers.position - points, axis=1) < radius
    apart = np.linalg.norm(markers.position[:, None] - markers.position[None], axis=2)
    twice = np.triu(apart < 0.8 * radius, 1).any(axis=0)
    alike: Flags = (markers.quality >= _LEAST_QUALITY) & near & ~twice
    if layout == "rings" and alike.any():
        alike[alike] = ~out_of_place(markers.position[alike])
    if layout == "hex" and alike.sum() > 1:
        alike[alike] = ~_find_crowding(apart[np.ix_(alike, alike)], markers.quality[alike])
    return alike


def _find_crowding(apart: Floats, quality: Floats) -> Flags:
    """Tell which blobs lie between markers of a lattice: too near to one that is more like a marker."""
    distance = np.where(np.eye(len(apart), dtype=bool), np.inf, apart)
    near = distance < _CLOSEST * np.median(distance.min(axis=0))
    crowded: Flags = (near & (quality[None] > quality[:, None])).any(axis=1)
    return crowded
