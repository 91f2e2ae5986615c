"""What the tracker knows of each marker: where it was at rest, what it looks like, and who its neighbours are."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from fingerslip.arrays import Flags, Floats
from fingerslip.vision.tracking.blobs import Blobs
from fingerslip.vision.tracking.layouts import nearest_neighbours

#: Samples of a profile, from the centre to the edge of the window.
N_PROFILE = 48

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
    out (n, 4): x, y [px], amplitude [grey levels], and quality: correlation with the profile times the share of the
    weight that is left.
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
    correlation = math.sqrt(explained / (explained + rest)) if explained > 0.0 else 0.0
    out[0], out[1], out[2], out[3] = x, y, amplitude, correlation * (weight / whole)


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
            if distance >= window or (mask.shape[0] and not mask[row, column]):
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
    """Return the profile (n, N_PROFILE) of each marker at points (n, 2) [px], NaN where it has no sample."""
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
    """Return the ellipse (n, 3) of each marker by the second moments of what stands out of the level around it."""
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


def _around(image: Floats, points: Floats, reach: float) -> tuple[Floats, Floats, Floats, Flags]:
    """Return dx, dy [px] and grey levels (n, k, k) of the pixels near each point, and which are in the image."""
    height, width = image.shape
    half = math.ceil(reach) + 1
    pixels = np.rint(points).astype(np.intp)[:, :, None] + np.arange(-half, half + 1)
    columns, rows = pixels[:, 0, None, :], pixels[:, 1, :, None]
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    grey = image[rows.clip(0, height - 1), columns.clip(0, width - 1)]
    return columns - points[:, 0, None, None], rows - points[:, 1, None, None], grey, inside


_WINDOW = 1.9  # radii of the marker
_MARGIN = 1.5  # px, for blur
_SMALLEST_WINDOW = 3.0  # px
_ROUNDS = 3
_OUTSIDE = 6  # samples of a profile that are the background
# A profile has no edge sharper than this [px]: pixels are no points, and a fit needs its slope.
_SOFT = 0.4
_CIRCLE = (1.0, 0.0, 1.0)
# Quality so far below the median is odd, in itself and in median deviations.
_BADLY, _OUTLYING = 0.03, 6.0
_CENTRE = 4  # samples of a profile that are the top


@dataclass(frozen=True)
class Markers:
    """Markers as they look in the rest frames."""

    position: Floats  # (n, 2), positions at rest [px]
    radius: Floats  # (n,), radius at half the contrast [px]
    window: Floats  # (n,), radius of the window in which a marker is measured [px]
    shape: Floats  # (n, 3), ellipse of each, as the metric of :mod:`fingerslip.vision.tracking.markers`
    profiles: Floats  # (n, N_PROFILE)
    strength: Floats  # (n,), answer of the blob that each is, see :mod:`fingerslip.vision.tracking.blobs`
    size: float  # radius of the blobs [px]
    polarity: float  # 1 for markers brighter than what is around them, -1 for darker ones
    spacing: Floats  # (n,), distance to the nearest neighbour [px]
    neighbours: NDArray[np.intp]  # (n, k), neighbours, the nearest first
    amplitude: Floats  # (n,), contrast of each [grey levels]
    quality: Floats  # (n,), quality of each in the mean of the rest frames that it was learnt from

    def select(self, order: NDArray[np.intp]) -> Markers:
        """Return some of the markers, in another order."""
        names = ("position", "radius", "window", "shape", "profiles", "strength", "amplitude", "quality")
        rows = {name: getattr(self, name)[order] for name in names}
        neighbours, spacing = nearest_neighbours(rows["position"])
        return dataclasses.replace(self, spacing=spacing, neighbours=neighbours, **rows)


@dataclass(frozen=True)
class Measured:
    """Markers as they were measured in a frame."""

    position: Floats  # (n, 2), positions [px], NaN where nothing was found
    amplitude: Floats  # (n,), contrast [grey levels]
    quality: Floats  # (n,)


def measure(markers: Markers, image: NDArray[np.uint8], mask: Flags | None, start: Floats) -> Measured:
    """Measure markers in an image, each from its own start (n, 2) [px], NaN where nothing is to be measured."""
    out = np.empty((len(start), 4))
    counted = np.empty((0, 0), dtype=bool) if mask is None else mask
    measure_markers(image, counted, start, markers.window, markers.shape, markers.profiles, markers.polarity, out)
    return Measured(out[:, :2].copy(), out[:, 2].copy(), out[:, 3].copy())


def known_markers(image: Floats, mask: Flags | None, blobs: Blobs, polarity: float) -> Markers:
    """Learn what markers look like from the blobs that they are; image (height, width) [grey levels], mask alike."""
    grey, points = np.clip(np.rint(image), 0, 255).astype(np.uint8), blobs.position
    neighbours, spacing = nearest_neighbours(points)
    size, places = float(np.median(blobs.radius)), points.copy()
    radii = np.full(len(points), size)
    shape, ones = np.tile(_CIRCLE, (len(points), 1)), np.ones(len(points))
    for turn in range(_ROUNDS):
        window = _windows(radii, spacing)
        profiles = _normalise(learn_profiles(image, places, window, shape, polarity), window, radii)
        looks = places, radii, window, shape, profiles, blobs.strength, size, polarity
        markers = _measure_again(Markers(*looks, spacing, neighbours, ones, ones), grey, mask)
        places, radii = markers.position, _half_height(profiles, window)
        if turn < _ROUNDS - 1:
            shape = learn_shapes(image, places, radii, window, polarity)
    return _measure_again(_with_typical_looks(dataclasses.replace(markers, radius=radii)), grey, mask)


def _measure_again(markers: Markers, grey: NDArray[np.uint8], mask: Flags | None) -> Markers:
    """Return markers as they are measured in an image; those not found stay where they were, of quality 0."""
    measured = measure(markers, grey, mask, markers.position)
    is_found = np.isfinite(measured.position[:, 0])
    position = np.where(is_found[:, None], measured.position, markers.position)
    quality = np.where(is_found, measured.quality, 0.0)
    return dataclasses.replace(markers, position=position, amplitude=measured.amplitude, quality=quality)


def _with_typical_looks(markers: Markers) -> Markers:
    """Return markers of which those that fit badly look like the others: a reflection beside them was learnt too."""
    apart = np.median(markers.quality) - markers.quality
    odd = apart > max(_BADLY, _OUTLYING * float(np.median(np.abs(apart))))
    if not odd.any() or odd.all():
        return markers
    radius = np.where(odd, np.median(markers.radius[~odd]), markers.radius)
    window = _windows(radius, markers.spacing)
    typical = _typical(markers.profiles[~odd], (markers.window / markers.radius)[~odd], window / radius)
    return dataclasses.replace(
        markers,
        radius=radius,
        window=window,
        shape=np.where(odd[:, None], _CIRCLE, markers.shape),
        profiles=np.where(odd[:, None], typical, markers.profiles),
    )


def _windows(radii: Floats, spacing: Floats) -> Floats:
    # The neighbours stay outside.
    room = np.maximum(spacing - 1.1 * radii, 0.5 * spacing)
    return np.asarray(np.maximum(np.minimum(_WINDOW * radii + _MARGIN, room), _SMALLEST_WINDOW))


def _typical(profiles: Floats, reach: Floats, wanted: Floats) -> Floats:
    """Return the median of profiles (n, N_PROFILE) at equal distances, in the windows that are wanted (m, N_PROFILE).

    Windows of markers near to each other are cut, so that samples of equal number are not equally far out. Arrays:
    reach (n,), wanted (m,), windows in radii of their markers.
    """
    share = np.linspace(0.0, 1.0, profiles.shape[1])
    distances = share * reach.max()
    values = [np.interp(distances, share * far, profile) for far, profile in zip(reach, profiles, strict=True)]
    inside = distances <= reach[:, None]
    median: Floats = np.nanmedian(np.where(inside, values, np.nan), axis=0)
    return np.array([np.interp(share * far, distances, median, right=0.0) for far in wanted])


def _normalise(profiles: Floats, window: Floats, radii: Floats) -> Floats:
    """Return profiles from 1 in the centre to 0 at the edge, half of each what all have in common."""
    blurs, samples = _SOFT * (profiles.shape[1] - 1) / window, np.arange(profiles.shape[1])
    smooth = np.zeros_like(profiles)
    for row, (profile, blur) in enumerate(zip(profiles, blurs, strict=True)):
        finite = np.isfinite(profile)
        if finite.any():
            whole = np.interp(samples, samples[finite], profile[finite])
            smooth[row] = gaussian_filter1d(whole, blur, mode="nearest")
    outside = smooth[:, -_OUTSIDE:].mean(axis=1, keepdims=True)
    height = smooth[:, :_CENTRE].mean(axis=1, keepdims=True) - outside
    scaled = np.clip((smooth - outside) / np.where(height > 1.0, height, 1.0), -0.5, 1.5)
    common = _typical(scaled, window / radii, window / radii)
    return np.where(height > 1.0, 0.5 * scaled + 0.5 * common, common)


def _half_height(profiles: Floats, window: Floats) -> Floats:
    """Return where each profile falls to half of its height [px]."""
    rows, count = np.arange(len(profiles)), profiles.shape[1]
    first = np.argmax(profiles < 0.5, axis=1)
    below = np.where(first == 0, count // 2, first)
    inner, outer = profiles[rows, below - 1], profiles[rows, below]
    share = np.clip((inner - 0.5) / np.maximum(inner - outer, 1e-9), 0.0, 1.0)
    radii = (below - 1 + share) * window / (count - 1)
    return np.asarray(np.clip(radii, 0.5 * np.median(radii), 2.0 * np.median(radii)))
