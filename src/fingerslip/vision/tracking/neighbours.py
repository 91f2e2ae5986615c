"""What the neighbours of a marker, and all markers together, say of where it is.

Markers that move by more than half their distance look like others that moved the other way, so nothing local tells
the two apart. The pattern as a whole does, because it ends somewhere: of all shifts the one is right at which most
places of the last frame have a marker.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from fingerslip.vision.video import opencv

__all__ = ["assign", "common_shift", "consistent", "expected_displacement", "lost_suddenly", "nearest_neighbours"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.intp]
Frame = NDArray[np.uint8]

# Share of the markers of the last frame that are lost at once where all may have leapt, and the fewest that count.
_SHARE, _FEWEST = 0.1, 2
# Blurs whose difference answers to markers, in their radii, and the radius from which half the pixels are enough.
_NARROW, _WIDE, _HALVED = 0.7, 2.5, 4.0
_COUNT = 8
# Gradients count as if they were known to be zero to this many squared neighbour distances: rims extrapolate less.
_STIFFNESS = 0.5
_FAR = 1e6


def lost_suddenly(here: Flags, sure: Flags) -> bool:
    """Tell whether so many of the markers (n,) that were seen are not found now that all may have leapt."""
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
    cv2 = opencv()
    # Of large markers every second pixel is enough.
    coarse, answers = 2 if radius >= _HALVED else 1, []
    for frame in (before, image):
        share = 1.0 / coarse
        small = cv2.resize(frame.astype(np.float32), None, fx=share, fy=share, interpolation=cv2.INTER_AREA)
        narrow, wide = (cv2.GaussianBlur(small, (0, 0), width * radius / coarse) for width in (_NARROW, _WIDE))
        answers.append(polarity * (narrow - wide))
    height, width = answers[0].shape
    columns, rows = np.floor((points + 0.5) / coarse).astype(np.intp).clip(0, (width - 1, height - 1)).T
    places = np.zeros((height, width), dtype=np.float32)
    places[rows, columns] = 1.0
    # A reflection counts no more than a marker.
    answer = np.clip(answers[1], 0.0, float(np.median(answers[0][rows, columns])))
    size = [fft.next_fast_len(2 * length, real=True) for length in (height, width)]
    sums = fft.irfft2(np.conj(fft.rfft2(places, s=size)) * fft.rfft2(answer, s=size), s=size)
    row, column = np.unravel_index(int(sums.argmax()), sums.shape)
    # Shifts to the left and upwards stand at the end.
    shift = (column - size[1] * (column >= width), row - size[0] * (row >= height))
    return coarse * np.array(shift, dtype=np.float64)


def nearest_neighbours(points: Floats) -> tuple[Integers, Floats]:
    """Return the nearest neighbours (n, k) of points (n, 2) [px], and the distance (n,) to the first [px]."""
    count = min(_COUNT, len(points) - 1)
    if count < 1:
        return np.empty((len(points), 0), dtype=np.intp), np.full(len(points), np.inf)
    distances, indices = cKDTree(points).query(points, k=count + 1)
    return indices[:, 1:].astype(np.intp), distances[:, 1].astype(np.float64)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def consistent(reference: Floats, displacement: Floats, sure: Flags, neighbours: Integers, allowed: Floats) -> Flags:
    """Tell which markers are displaced as their neighbours are.

    The one that differs most from the others is left out, and the rest judged again, until all agree.

    Arrays: reference, displacement (n, 2) [px]; sure (n,); neighbours (n, k); allowed (n,) [px].
    """
    accepted, expected = sure.copy(), np.zeros((len(reference), 2))
    for _ in range(len(reference)):
        worst, which = 1.0, -1
        for n in range(len(reference)):
            if accepted[n] and _expect(reference, displacement, accepted, neighbours, n, expected) > 2:
                apart = math.hypot(displacement[n, 0] - expected[n, 0], displacement[n, 1] - expected[n, 1])
                if apart / allowed[n] > worst:
                    worst, which = apart / allowed[n], n
        if which < 0:
            break
        accepted[which] = False
    return accepted


@numba.njit(cache=True, nogil=True, error_model="numpy")
def expected_displacement(
    reference: Floats, displacement: Floats, usable: Flags, neighbours: Integers
) -> tuple[Floats, Integers]:
    """Return what the neighbours' displacements, fitted by an affine map, say of each marker, and how many there are.

    Arrays: reference, displacement (n, 2) [px]; usable (n,); neighbours (n, k); returns (n, 2) [px], (n,).
    """
    expected, counts = np.empty_like(displacement), np.empty(len(reference), dtype=np.intp)
    for n in range(len(reference)):
        counts[n] = _expect(reference, displacement, usable, neighbours, n, expected)
    return expected, counts


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _expect(  # noqa: PLR0917  numba takes them in order
    reference: Floats, displacement: Floats, usable: Flags, neighbours: Integers, n: int, expected: Floats
) -> int:
    """Fit the neighbours' displacements around marker n, in place; return how many there are."""
    count, mx, my, mu, mv = 0, 0.0, 0.0, 0.0, 0.0
    for k in neighbours[n]:
        if usable[k]:
            count += 1
            mx += reference[k, 0] - reference[n, 0]
            my += reference[k, 1] - reference[n, 1]
            mu += displacement[k, 0]
            mv += displacement[k, 1]
    if count == 0:
        expected[n] = math.nan
        return count
    mx, my, mu, mv = mx / count, my / count, mu / count, mv / count
    xx, xy, yy, xu, yu, xv, yv, nearest = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.inf
    for k in neighbours[n]:
        if usable[k]:
            dx, dy = reference[k, 0] - reference[n, 0], reference[k, 1] - reference[n, 1]
            nearest = min(nearest, dx * dx + dy * dy)
            dx, dy = dx - mx, dy - my
            du, dv = displacement[k, 0] - mu, displacement[k, 1] - mv
            xx, xy, yy = xx + dx * dx, xy + dx * dy, yy + dy * dy
            xu, yu, xv, yv = xu + dx * du, yu + dy * du, xv + dx * dv, yv + dy * dv
    xx += _STIFFNESS * nearest
    yy += _STIFFNESS * nearest
    determinant = xx * yy - xy * xy
    expected[n, 0] = mu - ((yy * xu - xy * yu) * mx + (xx * yu - xy * xu) * my) / determinant
    expected[n, 1] = mv - ((yy * xv - xy * yv) * mx + (xx * yv - xy * xv) * my) / determinant
    return count


def assign(expected: Floats, reach: Floats, candidates: Floats, quality: Floats) -> tuple[Integers, Integers]:
    """Match markers and candidates so that the sum of all distances, in shares of the reach, is smallest.

    Arrays: expected (n, 2) [px]; reach (n,) [px]; candidates (m, 2) [px]; quality (m,); returns (k,).

    Examples
    --------
    Two markers want the same candidate: the sum decides.

    >>> import numpy as np
    >>> expected, candidates = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[6.0, 0.0], [15.0, 0.0]])
    >>> rows, columns = assign(expected, np.full(2, 8.0), candidates, np.ones(2))
    >>> rows.tolist(), columns.tolist()
    ([0, 1], [0, 1])
    """
    # Of candidates that lie together, the best one counts.
    groups: list[int] = []
    for index in np.argsort(-quality, kind="stable"):
        if (np.linalg.norm(candidates[index] - candidates[groups], axis=1) > 0.25 * reach.min()).all():
            groups.append(int(index))
    apart = np.linalg.norm(expected[:, None] - candidates[groups][None], axis=2) / reach[:, None]
    cost = np.where(apart <= 1.0, apart - 0.1 * quality[groups][None], _FAR)
    rows, columns = linear_sum_assignment(cost)
    near = cost[rows, columns] < _FAR
    return rows[near], np.array(groups, dtype=np.intp)[columns[near]]
