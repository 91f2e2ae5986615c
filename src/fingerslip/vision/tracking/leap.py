"""How far all markers together moved from one frame to the next, however far that is.

Markers that move by more than half their distance look like others that moved the other way, so nothing local tells
the two apart. The pattern as a whole does, because it ends somewhere: of all shifts the one is right at which most
places of the last frame have a marker.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.vision.opencv import opencv

__all__ = ["common_shift", "lost_suddenly"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Frame = NDArray[np.uint8]
Picture = NDArray[np.float32]

# Share of the markers of the last frame that are lost at once where all may have leapt, and the fewest that count.
_SHARE, _FEWEST = 0.1, 2
# Blurs whose difference answers to markers, in their radii, and the radius from which half the pixels are enough.
_NARROW, _WIDE, _HALVED = 0.7, 2.5, 4.0


def lost_suddenly(here: Flags, sure: Flags) -> bool:
    """Tell whether so many of the markers that were seen are not found now that all may have leapt.

    Arrays: here, sure (n,).
    """
    lost = int((here & ~sure).sum())
    return lost >= max(_FEWEST, _SHARE * int(here.sum()))


def common_shift(before: Frame, image: Frame, points: Floats, radius: float, polarity: float) -> Floats:
    """Return how far the pattern of markers moved between two frames.

    Arrays: before, image (height, width); points (n, 2) [px]; radius [px]; returns (2,) [px].

    Examples
    --------
    >>> frame = np.zeros((64, 96), dtype=np.uint8)
    >>> frame[20:26, 30:36] = frame[40:46, 50:56] = 200
    >>> points = np.array([[32.5, 22.5], [52.5, 42.5]])
    >>> shift = common_shift(frame, np.roll(frame, (3, 17), axis=(0, 1)), points, 3.0, 1)
    >>> bool(np.abs(shift - (17.0, 3.0)).max() <= 2.0)
    True
    """
    coarse = 2 if radius >= _HALVED else 1
    known, answer = (polarity * _answer(one, radius, coarse) for one in (before, image))
    columns, rows = _cells(points, coarse, answer.shape)
    # A reflection counts no more than a marker.
    answer = np.clip(answer, 0.0, float(np.median(known[rows, columns])))
    places = np.zeros_like(answer)
    places[rows, columns] = 1.0
    return coarse * _best_shift(places, answer)


def _answer(frame: Frame, radius: float, coarse: int) -> Picture:
    """Return how much each pixel is the middle of a spot of some radius; of every second pixel where it is large."""
    cv2 = opencv()
    grey = frame.astype(np.float32)
    small = cv2.resize(grey, None, fx=1.0 / coarse, fy=1.0 / coarse, interpolation=cv2.INTER_AREA)
    narrow, wide = (cv2.GaussianBlur(small, (0, 0), width * radius / coarse) for width in (_NARROW, _WIDE))
    answer: Picture = narrow - wide
    return answer


def _cells(points: Floats, coarse: int, shape: tuple[int, ...]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return columns and rows of the coarse pixels that hold points."""
    found = np.floor((points + 0.5) / coarse).astype(np.intp)
    return found[:, 0].clip(0, shape[1] - 1), found[:, 1].clip(0, shape[0] - 1)


def _best_shift(places: Picture, answer: Picture) -> Floats:
    """Return the shift (x, y) of places at which the sum of the answers there is largest."""
    size = (2 * answer.shape[0], 2 * answer.shape[1])
    products = np.conj(np.fft.rfft2(places, s=size)) * np.fft.rfft2(answer, s=size)
    sums = np.fft.irfft2(products, s=size)
    row, column = np.unravel_index(int(sums.argmax()), size)
    # Shifts to the left and upwards stand at the end.
    half = np.array(answer.shape)[::-1]
    shift: Floats = (np.array([column, row]) + half) % (2 * half) - half.astype(np.float64)
    return shift
