"""Where a marker is, below the pixel: a fit of its own profile, led there by a windowed centroid if need be.

The brightness around a marker is taken to be ``B + gx dx + gy dy + A p(r)``: a background with a gradient, and a
profile p of the distance r from the marker's centre, in the metric of an ellipse; both were learnt at rest. Six numbers
are found by weighted least squares (Gauss-Newton), with weights that fall smoothly to zero at the edge of the window,
so that no pixel enters at once, and with Cauchy's weights of the residual, so that glare on one side does not pull.
"""

from __future__ import annotations

import math

import numba
import numpy as np

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

#: Samples of a profile, from the centre to the edge of the window.
N_PROFILE = 48
#: What is measured: x, y [px], amplitude [grey levels], correlation with the profile, share of the weight that is left.
COLUMNS = 5
AMPLITUDE, CORRELATION, WEIGHT = 2, 3, 4

_CENTROIDS, _FITS = 4, 8
# Below this share of the amplitude a pixel does not count for the centroid.
_FLOOR = 0.25
# A residual of this share of the amplitude halves the weight of a pixel; noise of the image is far below.
_TOLERATED = 0.3
_SHAPE_FLOOR = 0.4
_LONGEST = 9.0  # an ellipse whose axes are as 2.6 to 1
# A fit of this quality from where the marker was expected needs no second one.
_CLEAR = 0.75
# The fit ends where it moves less [px]: the next step would move it by a hundredth of that.
_SMALL = 2e-2


@numba.njit(cache=True, nogil=True, error_model="numpy")
def measure_markers(image, mask, start, radius, window, shapes, profiles, polarity, out):  # type: ignore[no-untyped-def]
    """Measure markers near given positions, in place.

    Arrays: image (height, width); mask (height, width); start (n, 2) [px]; radius, window (n,) [px]; shapes (n, 3);
    profiles (n, N_PROFILE); out (n, COLUMNS).
    """
    again = np.empty(COLUMNS)
    for n in range(len(start)):
        _fit(image, mask, start[n, 0], start[n, 1], window[n], shapes[n], profiles[n], polarity, out[n])
        if out[n, CORRELATION] * out[n, WEIGHT] >= _CLEAR:
            continue
        # Too far off for the fit, perhaps: the centroid of what is in the window brings it nearer.
        x, y = _centroid(image, mask, start[n, 0], start[n, 1], radius[n], window[n], polarity)
        _fit(image, mask, x, y, window[n], shapes[n], profiles[n], polarity, again)
        if again[CORRELATION] * again[WEIGHT] > out[n, CORRELATION] * out[n, WEIGHT]:
            out[n] = again


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _bounds(centre, reach, size):  # type: ignore[no-untyped-def]
    return max(math.ceil(centre - reach), 0), min(math.floor(centre + reach) + 1, size)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _counts(mask, row, column):  # type: ignore[no-untyped-def]
    return mask.shape[0] == 0 or mask[row, column]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _centroid(image, mask, x, y, radius, window, polarity):  # type: ignore[no-untyped-def]
    """Return the centroid of what stands out of its surroundings, found by moving the window onto it."""
    for _ in range(_CENTROIDS):
        if not (math.isfinite(x) and math.isfinite(y)):
            break
        level, peak = _levels(image, mask, x, y, radius, window, polarity)
        total, along, across = 0.0, 0.0, 0.0
        floor = level + _FLOOR * (peak - level)
        first, last = _bounds(y, window, image.shape[0])
        left, right = _bounds(x, window, image.shape[1])
        for row in range(first, last):
            for column in range(left, right):
                dx, dy = column - x, row - y
                share = 1.0 - (dx * dx + dy * dy) / (window * window)
                value = polarity * image[row, column] - floor
                if share > 0.0 and value > 0.0 and _counts(mask, row, column):
                    weight = value * share
                    total += weight
                    along += weight * dx
                    across += weight * dy
        if total <= 0.0:
            break
        # The falling weight holds the centroid back; half as much again makes up for it.
        dx, dy = 1.5 * along / total, 1.5 * across / total
        x, y = x + dx, y + dy
        if dx * dx + dy * dy < 0.25:
            break
    return x, y


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _levels(image, mask, x, y, radius, window, polarity):  # type: ignore[no-untyped-def]
    """Return the mean level around a marker, and the highest in the window."""
    total, count, peak = 0.0, 0, -1e30
    first, last = _bounds(y, window, image.shape[0])
    left, right = _bounds(x, window, image.shape[1])
    for row in range(first, last):
        for column in range(left, right):
            square = (column - x) ** 2 + (row - y) ** 2
            if square < window * window and _counts(mask, row, column):
                value = polarity * image[row, column]
                peak = max(peak, value)
                if square > 1.69 * radius * radius:
                    total += value
                    count += 1
    return (total / count if count else peak), peak


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _fit(image, mask, x, y, window, shape, profile, polarity, out):  # type: ignore[no-untyped-def]
    """Fit background, gradient, amplitude and place; the marker's own profile says what it looks like."""
    out[:] = 0.0
    out[0], out[1] = np.nan, np.nan
    result = np.zeros(6)  # level, gradient along x and y, amplitude, and its products with the shift along x and y
    tolerance = 1e30
    x0, y0 = x, y
    normal, right_side = np.zeros((6, 6)), np.zeros(6)
    sums = np.zeros(4)
    for turn in range(_FITS):
        if not _inside(x, y, image.shape):
            return
        _gather(image, mask, x, y, window, shape, profile, result, tolerance, normal, right_side, sums)
        if sums[1] < 0.3 * sums[0] or not _solve(normal, right_side):
            return
        result[:] = right_side
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
    out[0], out[1], out[2] = x, y, amplitude
    explained, rest = amplitude * amplitude * sums[2], sums[3]
    out[3] = math.sqrt(explained / (explained + rest)) if explained > 0.0 else 0.0
    out[4] = sums[1] / sums[0]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _inside(x, y, shape):  # type: ignore[no-untyped-def]
    return math.isfinite(x) and math.isfinite(y) and 0.0 <= x <= shape[1] - 1.0 and 0.0 <= y <= shape[0] - 1.0


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _gather(  # type: ignore[no-untyped-def]  # noqa: PLR0915
    image, mask, x, y, window, shape, profile, out, tolerance, normal, right_side, sums
):
    """Sum the normal equations of the fit around a position.

    `sums` gets the weight without and with the residuals' part, the weighted variance of the profile, and the weighted
    square of the residuals of `found`.
    """
    # The lower triangle n and the right side r of the equations stand in variables of their own: half the time.
    n00 = r0 = 0.0
    n10 = n11 = r1 = 0.0
    n20 = n21 = n22 = r2 = 0.0
    n30 = n31 = n32 = n33 = r3 = 0.0
    n40 = n41 = n42 = n43 = n44 = r4 = 0.0
    n50 = n51 = n52 = n53 = n54 = n55 = r5 = 0.0
    whole = rest = 0.0
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
            bin_place = distance * scale
            below = min(int(bin_place), len(profile) - 2)
            rise = profile[below + 1] - profile[below]
            value = profile[below] + (bin_place - below) * rise
            slope = -rise * scale / distance if distance > 1e-9 else 0.0
            share = 1.0 - (distance / window) ** 2
            grey = float(image[row, column])
            residual = grey - out[0] - out[1] * dx - out[2] * dy - out[3] * value
            part = 1.0 / (1.0 + (residual / tolerance) ** 2)
            weight = share * part
            whole += share
            rest += weight * residual * residual
            sx, sy = slope * ax, slope * ay
            wx, wy, wv, wsx, wsy = weight * dx, weight * dy, weight * value, weight * sx, weight * sy
            n00 += weight
            r0 += weight * grey
            n10 += wx
            n11 += wx * dx
            r1 += wx * grey
            n20 += wy
            n21 += wy * dx
            n22 += wy * dy
            r2 += wy * grey
            n30 += wv
            n31 += wv * dx
            n32 += wv * dy
            n33 += wv * value
            r3 += wv * grey
            n40 += wsx
            n41 += wsx * dx
            n42 += wsx * dy
            n43 += wsx * value
            n44 += wsx * sx
            r4 += wsx * grey
            n50 += wsy
            n51 += wsy * dx
            n52 += wsy * dy
            n53 += wsy * value
            n54 += wsy * sx
            n55 += wsy * sy
            r5 += wsy * grey
    normal[0, 0] = n00
    normal[1, 0], normal[1, 1] = n10, n11
    normal[2, 0], normal[2, 1], normal[2, 2] = n20, n21, n22
    normal[3, 0], normal[3, 1], normal[3, 2], normal[3, 3] = n30, n31, n32, n33
    normal[4, 0], normal[4, 1], normal[4, 2], normal[4, 3], normal[4, 4] = n40, n41, n42, n43, n44
    normal[5, 0], normal[5, 1], normal[5, 2], normal[5, 3], normal[5, 4], normal[5, 5] = n50, n51, n52, n53, n54, n55
    right_side[0], right_side[1], right_side[2], right_side[3], right_side[4], right_side[5] = r0, r1, r2, r3, r4, r5
    sums[0], sums[1], sums[3] = whole, n00, rest
    if n00 > 0.0:
        sums[2] = n33 - n30 * n30 / n00


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _solve(matrix, vector):  # type: ignore[no-untyped-def]
    """Solve symmetric equations in place by Cholesky's factors; False where they have none."""
    size = len(vector)
    for i in range(size):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            if i == j:
                if total <= 1e-9 * (1.0 + matrix[i, i]):
                    return False
                matrix[i, i] = math.sqrt(total)
            else:
                matrix[i, j] = total / matrix[j, j]
    for i in range(size):
        for k in range(i):
            vector[i] -= matrix[i, k] * vector[k]
        vector[i] /= matrix[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            vector[i] -= matrix[k, i] * vector[k]
        vector[i] /= matrix[i, i]
    return True


@numba.njit(cache=True, nogil=True, error_model="numpy")
def learn_profiles(image, points, window, shapes, polarity, out):  # type: ignore[no-untyped-def]
    """Learn the profile of each marker from an image, in place.

    Arrays: image (height, width) [grey levels]; points (n, 2) [px]; window (n,) [px]; shapes (n, 3); out (n,
    N_PROFILE).
    """
    for n in range(len(points)):
        (x, y), (a, b, c) = points[n], shapes[n]
        total, count = np.zeros(N_PROFILE), np.zeros(N_PROFILE)
        scale = (N_PROFILE - 1) / window[n]
        first, last = _bounds(y, window[n] * math.sqrt(a), image.shape[0])
        left, right = _bounds(x, window[n] * math.sqrt(c), image.shape[1])
        for row in range(first, last):
            for column in range(left, right):
                dx, dy = column - x, row - y
                radius = math.sqrt(a * dx * dx + 2.0 * b * dx * dy + c * dy * dy) * scale
                below = int(radius)
                if below >= N_PROFILE - 1:
                    continue
                share = radius - below
                for sample, weight in ((below, 1.0 - share), (below + 1, share)):
                    total[sample] += weight * polarity * image[row, column]
                    count[sample] += weight
        for k in range(N_PROFILE):
            out[n, k] = total[k] / count[k] if count[k] > 0.0 else np.nan


@numba.njit(cache=True, nogil=True, error_model="numpy")
def learn_shapes(image, points, radius, window, polarity, out):  # type: ignore[no-untyped-def]
    """Learn the ellipse of each marker from the second moments of what stands out, in place.

    Arrays: image (height, width) [grey levels]; points (n, 2) [px]; radius, window (n,) [px]; out (n, 3).
    """
    everywhere = np.empty((0, 0), dtype=np.bool_)
    for n in range(len(points)):
        x, y = points[n]
        level, peak = _levels(image, everywhere, x, y, radius[n], window[n], polarity)
        floor = level + _SHAPE_FLOOR * (peak - level)
        xx, xy, yy = 0.0, 0.0, 0.0
        first, last = _bounds(y, window[n], image.shape[0])
        left, right = _bounds(x, window[n], image.shape[1])
        for row in range(first, last):
            for column in range(left, right):
                dx, dy = column - x, row - y
                value = min(polarity * image[row, column] - floor, 0.5 * (peak - floor))
                if value > 0.0 and dx * dx + dy * dy < window[n] * window[n]:
                    xx += value * dx * dx
                    xy += value * dx * dy
                    yy += value * dy * dy
        determinant = xx * yy - xy * xy
        out[n, 0], out[n, 1], out[n, 2] = 1.0, 0.0, 1.0
        # The ratio of the axes, squared, is at most about (trace² / determinant).
        if determinant > 0.0 and (xx + yy) ** 2 < _LONGEST * determinant:
            root = math.sqrt(determinant)
            out[n, 0], out[n, 1], out[n, 2] = yy / root, -xy / root, xx / root
