"""What the neighbours of a marker say of it: where it should be, and whether it can be where it was found.

How far all markers together moved from one frame to the next, however far that is.

Markers that move by more than half their distance look like others that moved the other way, so nothing local tells
the two apart. The pattern as a whole does, because it ends somewhere: of all shifts the one is right at which most
places of the last frame have a marker.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from fingerslip.vision.video import opencv

__all__ = [
    "assign",
    "common_shift",
    "consistent",
    "expected_displacement",
    "lost_suddenly",
    "nearest_neighbours",
]


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
    before_answer, answer = (polarity * _answer(picture, radius, coarse) for picture in (before, image))
    columns, rows = _cells(points, coarse, answer.shape)
    # A reflection counts no more than a marker.
    answer = np.clip(answer, 0.0, float(np.median(before_answer[rows, columns])))
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
    cells = np.floor((points + 0.5) / coarse).astype(np.intp)
    return cells[:, 0].clip(0, shape[1] - 1), cells[:, 1].clip(0, shape[0] - 1)


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


_COUNT = 8
# Gradients count as if they were known to be zero to this many squared neighbour distances: rims extrapolate less.
_STIFFNESS = 0.5


def nearest_neighbours(points: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Return the nearest neighbours of each point and the distance to the first.

    Arrays: points (n, 2) [px]; returns (n, k) [px].
    """
    count = min(_COUNT, len(points) - 1)
    if count < 1:
        return np.empty((len(points), 0), dtype=np.intp), np.full(len(points), np.inf)
    distances, indices = cKDTree(points).query(points, k=count + 1)
    return indices[:, 1:].astype(np.intp), distances[:, 1].astype(np.float64)


def consistent(
    reference: Floats, displacement: Floats, sure: Flags, neighbours: NDArray[np.intp], allowed: Floats
) -> Flags:
    """Tell which markers are displaced as their neighbours are.

    The one that differs most from the others is left out, and the rest judged again, until all agree.

    Arrays: reference (n, 2) [px]; displacement (n, 2) [px]; sure (n,); neighbours (n, k); allowed (n,) [px].
    """
    accepted = sure.copy()
    _drop_strangers(reference, displacement, accepted, neighbours, allowed)
    return accepted


def expected_displacement(
    reference: Floats, displacement: Floats, usable: Flags, neighbours: NDArray[np.intp]
) -> tuple[Floats, NDArray[np.intp]]:
    """Return what the neighbours' displacements, fitted by an affine map, say of each marker.

    Arrays: reference, displacement (n, 2) [px]; usable (n,); neighbours (n, k); returns (n, 2) [px].
    """
    out = np.empty_like(displacement)
    counts = np.empty(len(reference), dtype=np.intp)
    _expect(reference, displacement, usable, neighbours, out, counts)
    return out, counts


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _expect(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    reference, displacement, usable, neighbours, out, counts
):
    for n in range(len(reference)):
        counts[n] = _expect_one(reference, displacement, usable, neighbours, n, out)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _expect_one(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    reference, displacement, usable, neighbours, n, out
):
    """Fit the neighbours' displacements around marker n; return how many there are."""
    count, mx, my, mu, mv = 0, 0.0, 0.0, 0.0, 0.0
    for k in neighbours[n]:
        if usable[k]:
            count += 1
            mx += reference[k, 0] - reference[n, 0]
            my += reference[k, 1] - reference[n, 1]
            mu += displacement[k, 0]
            mv += displacement[k, 1]
    if count == 0:
        out[n, 0], out[n, 1] = math.nan, math.nan
        return count
    mx, my, mu, mv = mx / count, my / count, mu / count, mv / count
    xx, xy, yy, xu, yu, xv, yv, nearest = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.inf
    for k in neighbours[n]:
        if usable[k]:
            dx, dy = reference[k, 0] - reference[n, 0], reference[k, 1] - reference[n, 1]
            nearest = min(nearest, dx * dx + dy * dy)
            dx, dy = dx - mx, dy - my
            du, dv = displacement[k, 0] - mu, displacement[k, 1] - mv
            xx += dx * dx
            xy += dx * dy
            yy += dy * dy
            xu += dx * du
            yu += dy * du
            xv += dx * dv
            yv += dy * dv
    xx += _STIFFNESS * nearest
    yy += _STIFFNESS * nearest
    determinant = xx * yy - xy * xy
    out[n, 0] = mu - ((yy * xu - xy * yu) * mx + (xx * yu - xy * xu) * my) / determinant
    out[n, 1] = mv - ((yy * xv - xy * yv) * mx + (xx * yv - xy * xv) * my) / determinant
    return count


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _drop_strangers(reference, displacement, accepted, neighbours, largest):  # type: ignore[no-untyped-def]
    expected = np.zeros((len(reference), 2))
    for _ in range(len(reference)):
        worst, which = 1.0, -1
        for n in range(len(reference)):
            if accepted[n] and _expect_one(reference, displacement, accepted, neighbours, n, expected) > 2:
                apart = math.hypot(displacement[n, 0] - expected[n, 0], displacement[n, 1] - expected[n, 1])
                if apart / largest[n] > worst:
                    worst, which = apart / largest[n], n
        if which < 0:
            return
        accepted[which] = False


_FAR = 1e6


def assign(
    expected: Floats, reach: Floats, candidates: Floats, quality: Floats
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Match markers and candidates so that the sum of all distances, in shares of the reach, is smallest.

    Arrays: expected (n, 2) [px]; reach (n,) [px]; candidates (m, 2) [px]; quality (m,); returns (k,).

    Examples
    --------
    Two markers want the same candidate: the sum decides.

    >>> import numpy as np
    >>> expected, found = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[6.0, 0.0], [15.0, 0.0]])
    >>> rows, columns = assign(expected, np.full(2, 8.0), found, np.ones(2))
    >>> rows.tolist(), columns.tolist()
    ([0, 1], [0, 1])
    """
    groups = _distinct(candidates, quality, 0.25 * float(reach.min()))
    apart = np.linalg.norm(expected[:, None] - candidates[groups][None], axis=2) / reach[:, None]
    cost = np.where(apart <= 1.0, apart - 0.1 * quality[groups][None], _FAR)
    rows, columns = linear_sum_assignment(cost)
    near = cost[rows, columns] < _FAR
    return rows[near], groups[columns[near]]


def _distinct(candidates: Floats, quality: Floats, apart: float) -> NDArray[np.intp]:
    """Return the best candidate of each group that lies together."""
    distinct: list[int] = []
    for index in np.argsort(-quality, kind="stable"):
        if all(np.hypot(*(candidates[index] - candidates[other])) > apart for other in distinct):
            distinct.append(int(index))
    return np.array(distinct, dtype=np.intp)
