"""What the tracker knows of each marker: where it was at rest, what it looks like, and who its neighbours are."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from fingerslip.vision.tracking.blobs import Blobs
from fingerslip.vision.tracking.kernels import (
    AMPLITUDE,
    COLUMNS,
    CORRELATION,
    WEIGHT,
    learn_profiles,
    learn_shapes,
    measure_markers,
)
from fingerslip.vision.tracking.neighbours import nearest_neighbours

__all__ = ["Markers", "Measured", "known_markers", "measure"]


Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ALL = slice(None)
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
    shape: Floats  # (n, 3), ellipse of each, as the metric of :mod:`fingerslip.vision.tracking.kernels`
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


def measure(
    markers: Markers,
    image: NDArray[np.uint8],
    mask: Flags | None,
    start: Floats,
    which: NDArray[np.intp] | slice = _ALL,
) -> Measured:
    """Measure markers in an image, each from its own start; the marker of each is said where they are not all of them.

    Arrays: image, mask (height, width); start (n, 2) [px], NaN where nothing is to be measured; which (n,).
    """
    out = np.empty((len(start), COLUMNS))
    counted = np.empty((0, 0), dtype=bool) if mask is None else mask
    looks = markers.window[which], markers.shape[which], markers.profiles[which]
    measure_markers(image, counted, start, *looks, markers.polarity, out)
    return Measured(out[:, :2].copy(), out[:, AMPLITUDE].copy(), out[:, CORRELATION] * out[:, WEIGHT])


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
    windows: Floats = np.maximum(np.minimum(_WINDOW * radii + _MARGIN, room), _SMALLEST_WINDOW)
    return windows


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
    mixed: Floats = np.where(height > 1.0, 0.5 * scaled + 0.5 * common, common)
    return mixed


def _half_height(profiles: Floats, window: Floats) -> Floats:
    """Return where each profile falls to half of its height [px]."""
    rows, count = np.arange(len(profiles)), profiles.shape[1]
    first = np.argmax(profiles < 0.5, axis=1)
    below = np.where(first == 0, count // 2, first)
    inner, outer = profiles[rows, below - 1], profiles[rows, below]
    share = np.clip((inner - 0.5) / np.maximum(inner - outer, 1e-9), 0.0, 1.0)
    radii = (below - 1 + share) * window / (count - 1)
    return np.asarray(np.clip(radii, 0.5 * np.median(radii), 2.0 * np.median(radii)))
