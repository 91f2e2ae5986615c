"""Markers in one image: blobs of any size, bright or dark, found with settings that the image itself decides."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.vision.opencv import opencv

__all__ = ["Blobs", "find_blobs"]

Floats = NDArray[np.float64]

# Standard deviations of the Laplacian of a Gaussian that are tried [px]; a disk of radius r answers most at r / √2.
_SCALES = tuple(1.2 * 2.0 ** (step / 3.0) for step in range(14))
_SMALLEST_SIDE = 24  # px of a reduced image
# Hessians of edges and lines have one large eigenvalue; 1 is a round blob.
_ROUNDNESS = 0.35
# Answers below this share of the brightness are none.
_FAINTEST = 2e-3
_FEWEST = 4
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
    found = [_settled(*one, n_markers) for one in _answers(relative, mask, bright)]
    usable = [(merit, blobs) for merit, blobs in found if blobs is not None]
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
            kept = _allowed(points, mask, image.shape)
            yield scale, polarity, points[kept], strengths[kept]


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


def _allowed(points: Floats, mask: NDArray[np.bool_] | None, shape: Sequence[int]) -> NDArray[np.bool_]:
    if mask is None:
        return np.ones(len(points), dtype=bool)
    columns = np.clip(np.rint(points[:, 0]).astype(int), 0, shape[1] - 1)
    rows = np.clip(np.rint(points[:, 1]).astype(int), 0, shape[0] - 1)
    allowed: NDArray[np.bool_] = mask[rows, columns]
    return allowed


def _settled(
    scale: float, bright: bool, points: Floats, strengths: Floats, n_markers: int | None
) -> tuple[float, Blobs | None]:
    """Return how clearly the markers stand out at one scale, and the blobs with the count that was settled on."""
    if len(points) < (n_markers or _FEWEST):
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
    falls = rising[_FEWEST - 1 : -1] - rising[_FEWEST:]
    if not falls.size:
        return len(strengths)
    # A few strong spots are no field of markers.
    sizes = np.arange(_FEWEST, _FEWEST + len(falls))
    return int(sizes[np.argmax(falls * np.sqrt(np.minimum(sizes, 30.0) / 30.0))])
