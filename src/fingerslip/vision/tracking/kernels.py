"""Where a marker is, below the pixel: a fit of its own profile.

The brightness around a marker is taken to be ``B + gx dx + gy dy + A p(r)``: a background with a gradient, and a
profile p of the distance r from the marker's centre, in the metric of an ellipse; both were learnt at rest. Six numbers
are found by weighted least squares (Gauss-Newton), with weights that fall smoothly to zero at the edge of the window,
so that no pixel enters at once, and with Cauchy's weights of the residual, so that glare on one side does not pull.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = [
    "AMPLITUDE",
    "COLUMNS",
    "CORRELATION",
    "N_PROFILE",
    "WEIGHT",
    "learn_profiles",
    "learn_shapes",
    "measure_markers",
]

Floats = NDArray[np.float64]

#: Samples of a profile, from the centre to the edge of the window.
N_PROFILE = 48
#: What is measured: x, y [px], amplitude [grey levels], correlation with the profile, share of the weight that is left.
COLUMNS = 5
AMPLITUDE, CORRELATION, WEIGHT = 2, 3, 4

_FITS = 8
# A residual of this share of the amplitude halves the weight of a pixel; noise of the image is far below.
_TOLERATED = 0.3
_LEAST_WEIGHT = 0.3  # share of the weights without residuals
_SHAPE_FLOOR = 0.4
_LONGEST = 9.0  # an ellipse whose axes are as 2.6 to 1
# The fit ends where it moves less [px]: the next step would move it by a hundredth of that.
_SMALL = 2e-2


@numba.njit(cache=True, nogil=True, error_model="numpy")
def measure_markers(image, mask, start, window, shapes, profiles, polarity, out):  # type: ignore[no-untyped-def]
    """Measure markers near given positions, in place.

    Arrays: image, mask (height, width); start (n, 2) [px]; window (n,) [px]; shapes (n, 3); profiles (n, N_PROFILE);
    out (n, COLUMNS).
    """
    side = 0.0
    for n in range(len(start)):
        side = max(side, 2.0 * window[n] * math.sqrt(max(shapes[n, 0], shapes[n, 2])) + 2.0)
    terms = np.empty((int(side) ** 2, 7))
    for n in range(len(start)):
        _fit(image, mask, start[n, 0], start[n, 1], window[n], shapes[n], profiles[n], polarity, terms, out[n])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _bounds(centre, reach, size):  # type: ignore[no-untyped-def]
    return max(math.ceil(centre - reach), 0), min(math.floor(centre + reach) + 1, size)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _counts(mask, row, column):  # type: ignore[no-untyped-def]
    return mask.shape[0] == 0 or mask[row, column]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _fit(image, mask, x, y, window, shape, profile, polarity, terms, out):  # type: ignore[no-untyped-def]
    """Fit background, gradient, amplitude and place; the marker's own profile says what it looks like."""
    out[:] = 0.0
    out[0], out[1] = np.nan, np.nan
    result = np.zeros(6)  # level, gradient along x and y, amplitude, and its products with the shift along x and y
    x0, y0, tolerance = x, y, 1e30
    amplitude, spread, weight, whole, rest = 0.0, 0.0, 0.0, 0.0, 0.0
    for turn in range(_FITS):
        if not (0.0 <= x <= image.shape[1] - 1.0 and 0.0 <= y <= image.shape[0] - 1.0):  # nor NaN
            return
        moments, whole, rest = _gather(image, mask, x, y, window, shape, profile, result, tolerance, terms)
        weight = moments[0, 0]
        if weight < _LEAST_WEIGHT * whole and turn == 1:
            # From pixels away the first amplitude is too small to say which pixels do not fit.
            tolerance = 1e30
            continue
        spread = moments[3, 3] - moments[3, 0] ** 2 / weight
        if weight < _LEAST_WEIGHT * whole or not _solve(moments, result):
            return
        amplitude = result[3] * polarity
        if amplitude <= 0.5:
            return
        dx, dy = result[4] / result[3], result[5] / result[3]
        step = math.sqrt(dx * dx + dy * dy)
        scale = min(1.0, 0.25 * window / step) if step > 0.0 else 1.0
        x, y = x + scale * dx, y + scale * dy
        tolerance = _TOLERATED * amplitude
        if step < _SMALL and turn > 0:
            break
    if (x - x0) ** 2 + (y - y0) ** 2 > window * window:
        return
    explained = amplitude * amplitude * spread
    out[0], out[1], out[2] = x, y, amplitude
    out[3] = math.sqrt(explained / (explained + rest)) if explained > 0.0 else 0.0
    out[4] = weight / whole


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _gather(image, mask, x, y, window, shape, profile, result, tolerance, terms):  # type: ignore[no-untyped-def]
    """Return the moments of the fit around a position, all weights without the residuals' part, and their squares.

    The moments (7, 7) are weighted products of 1, dx, dy, the profile, its slopes along x and y, and the grey level:
    the normal equations with their right side in the last row.
    """
    whole, rest, count = 0.0, 0.0, 0
    scale = (len(profile) - 1) / window
    a, b, c = shape
    first, last = _bounds(y, window * math.sqrt(a), image.shape[0])
    left, right = _bounds(x, window * math.sqrt(c), image.shape[1])
    for row in range(first, last):
        dy = row - y
        for column in range(left, right):
            dx = column - x
            ax, ay = a * dx + b * dy, b * dx + c * dy
            distance = math.sqrt(dx * ax + dy * ay)
            if distance >= window or not _counts(mask, row, column):
                continue
            below = min(int(distance * scale), len(profile) - 2)
            rise = profile[below + 1] - profile[below]
            value = profile[below] + (distance * scale - below) * rise
            slope = -rise * scale / distance if distance > 1e-9 else 0.0
            share = 1.0 - (distance / window) ** 2
            grey = float(image[row, column])
            residual = grey - result[0] - result[1] * dx - result[2] * dy - result[3] * value
            weight = share / (1.0 + (residual / tolerance) ** 2)
            whole += share
            rest += weight * residual * residual
            root, term = math.sqrt(weight), terms[count]
            term[0], term[1], term[2], term[3] = root, root * dx, root * dy, root * value
            term[4], term[5], term[6] = root * slope * ax, root * slope * ay, root * grey
            count += 1
    # One product of matrices is as fast as sums in 28 variables, and faster than sums in arrays.
    return terms[:count].T @ terms[:count], whole, rest


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _solve(moments, result):  # type: ignore[no-untyped-def]
    """Solve the normal equations whose right side is the last row, by Cholesky's factors; False where it fails."""
    size = len(result)
    for i in range(size + 1):
        for j in range(min(i + 1, size)):
            total = moments[i, j]
            for k in range(j):
                total -= moments[i, k] * moments[j, k]
            if i == j:
                if total <= 1e-9 * (1.0 + moments[i, i]):
                    return False
                moments[i, i] = math.sqrt(total)
            else:
                moments[i, j] = total / moments[j, j]
    for i in range(size - 1, -1, -1):
        result[i] = moments[size, i]
        for k in range(i + 1, size):
            result[i] -= moments[k, i] * result[k]
        result[i] /= moments[i, i]
    return True


def learn_profiles(image: Floats, points: Floats, window: Floats, shapes: Floats, polarity: float) -> Floats:
    """Return the profile of each marker (n, N_PROFILE), NaN where it has no sample.

    Arrays: image (height, width) [grey levels]; points (n, 2) [px]; window (n,) [px]; shapes (n, 3).
    """
    a, b, c = shapes.T[..., None, None]
    dx, dy, grey, inside = _around(image, points, float((window * np.sqrt(shapes[:, [0, 2]].max(axis=1))).max()))
    samples_out = np.sqrt(a * dx * dx + 2.0 * b * dx * dy + c * dy * dy) * ((N_PROFILE - 1) / window)[:, None, None]
    inside &= samples_out < N_PROFILE - 1
    below = samples_out[inside].astype(np.intp)
    share, start = samples_out[inside] - below, below + N_PROFILE * np.nonzero(inside)[0]
    samples, weights = np.concatenate([start, start + 1]), np.concatenate([1.0 - share, share])
    levels = weights * np.tile(polarity * grey[inside], 2)
    total, count = (np.bincount(samples, values, N_PROFILE * len(points)) for values in (levels, weights))
    return np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0.0).reshape(-1, N_PROFILE)


def learn_shapes(image: Floats, points: Floats, radius: Floats, window: Floats, polarity: float) -> Floats:
    """Return the ellipse of each marker (n, 3) by the second moments of what stands out of the level around it.

    Arrays: image (height, width) [grey levels]; points (n, 2) [px]; radius, window (n,) [px].
    """
    dx, dy, grey, inside = _around(image, points, float(window.max()))
    square, value, axes = dx * dx + dy * dy, polarity * grey, (1, 2)
    inside &= square < (window**2)[:, None, None]
    outer = inside & (square > 1.69 * (radius**2)[:, None, None])
    peak = value.max(axis=axes, initial=-1e30, where=inside)
    level = np.where(outer.any(axis=axes), (value * outer).sum(axis=axes) / np.maximum(outer.sum(axis=axes), 1), peak)
    floor = (level + _SHAPE_FLOOR * (peak - level))[:, None, None]
    height = np.clip(value - floor, 0.0, 0.5 * (peak[:, None, None] - floor)) * inside
    xx, xy, yy = ((height * product).sum(axis=axes) for product in (dx * dx, dx * dy, dy * dy))
    determinant = xx * yy - xy * xy
    # The ratio of the axes, squared, is at most about (trace² / determinant).
    clear = (determinant > 0.0) & ((xx + yy) ** 2 < _LONGEST * determinant)
    root = np.sqrt(np.where(clear, determinant, 1.0))
    return np.where(clear[:, None], np.stack([yy, -xy, xx], axis=1) / root[:, None], (1.0, 0.0, 1.0))


def _around(image: Floats, points: Floats, reach: float) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Return dx, dy [px] and grey levels of the pixels within reach of each point, and which are in the image.

    Arrays: image (height, width); points (n, 2) [px]; returns (n, k, k).
    """
    height, width = image.shape
    half = math.ceil(reach) + 1
    pixels = np.rint(points).astype(np.intp)[:, :, None] + np.arange(-half, half + 1)
    columns, rows = pixels[:, 0, None, :], pixels[:, 1, :, None]
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    grey = image[rows.clip(0, height - 1), columns.clip(0, width - 1)]
    return columns - points[:, 0, None, None], rows - points[:, 1, None, None], grey, inside
