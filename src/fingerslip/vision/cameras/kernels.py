"""Compiled: soft spots drawn on a picture, only around them, and the noise of the sensor."""

from __future__ import annotations

import functools
import math

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["draw_spots", "expose", "normal_table"]

Picture = NDArray[np.float32]
Floats = NDArray[np.float64]

_REACH = 4.0  # standard deviations of the edge, beyond which a spot covers 3e-5 of a pixel
_SAMPLES_PER_PIXEL, _MOST_SAMPLES = 2.0, 512
_BITS = 16
# The constants of SplitMix64 (Steele, Lea & Flood 2014).
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_30, _27, _31, _16 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(_BITS)
_MASK = np.uint64(2**_BITS - 1)


@functools.cache
def normal_table() -> Picture:
    """Return 65,536 equally likely values of a normal distribution of mean 0 and variance 1, rising."""
    from scipy.special import ndtri

    values = ndtri((np.arange(2**_BITS) + 0.5) / 2**_BITS)
    table: Picture = (values / values.std()).astype(np.float32)
    return table


@numba.njit(cache=True, nogil=True)
def draw_spots(  # noqa: PLR0917  numba takes them in order
    picture: Picture, top: Picture, middles: Floats, halves: Floats, radii: Floats, softness: float
) -> None:
    """Lay spots over a picture, in place.

    Arrays: picture, top (height, width) [grey levels]; middles, halves (n, 2) [px]; radii (n,) [px]; softness [px].
    """
    for spot in range(len(middles)):
        x, y, dx, dy = middles[spot, 0], middles[spot, 1], halves[spot, 0], halves[spot, 1]
        reach = radii[spot] + _REACH * softness
        if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(dx) and math.isfinite(dy)):
            continue
        length = 2.0 * math.hypot(dx, dy)
        count = min(1 + math.ceil(_SAMPLES_PER_PIXEL * length), _MOST_SAMPLES)
        left, right = _limits(x, abs(dx) + reach, picture.shape[1])
        upper, lower = _limits(y, abs(dy) + reach, picture.shape[0])
        for row in range(upper, lower):
            for column in range(left, right):
                covered = 0.0
                for sample in range(count):
                    share = (2.0 * sample + 1.0) / count - 1.0
                    off = math.hypot(column - x - share * dx, row - y - share * dy)
                    covered += _covered(off - radii[spot], softness)
                covered /= count
                picture[row, column] += np.float32(covered) * (top[row, column] - picture[row, column])


@numba.njit(cache=True, nogil=True)
def _limits(middle: float, reach: float, size: int) -> tuple[int, int]:
    """Return the first pixel within reach and the one behind the last, inside the picture."""
    first, last = math.ceil(max(middle - reach, 0.0)), math.floor(min(middle + reach, size - 1.0))
    return int(first), int(last) + 1


@numba.njit(cache=True, nogil=True)
def _covered(outside: float, softness: float) -> float:
    """Return the share of a pixel that a blurred edge covers, at a distance outside it [px]."""
    if outside > _REACH * softness:
        return 0.0
    if outside < -_REACH * softness:
        return 1.0
    return 0.5 * math.erfc(outside / (math.sqrt(2.0) * softness))


@numba.njit(cache=True, nogil=True)
def _mixed(state: np.uint64) -> np.uint64:
    """Return the random bits of a state (Steele, Lea & Flood 2014)."""
    state = (state ^ (state >> _30)) * _FIRST
    state = (state ^ (state >> _27)) * _SECOND
    return state ^ (state >> _31)


@numba.njit(cache=True, nogil=True)
def expose(  # noqa: PLR0917  numba takes them in order
    picture: Picture, factor: float, read: float, shot: float, seed: int, number: int, table: Picture
) -> NDArray[np.uint8]:
    """Return what a sensor makes of light: noise added, and whole grey levels from 0 to 255.

    Arrays: picture (height, width) [grey levels]; factor [-]; read [grey levels squared]; shot [grey levels]; table
    (65536,).
    """
    frame = np.empty(picture.shape, dtype=np.uint8)
    light, levels = picture.ravel(), frame.ravel()
    plain = math.sqrt(read)
    key = _mixed(_mixed(np.uint64(seed) + _GOLDEN) + np.uint64(number) * _GOLDEN)
    bits = key
    for pixel in range(light.size):
        if pixel % 4 == 0:
            bits = _mixed(key + np.uint64(pixel // 4 + 1) * _GOLDEN)
        value = factor * light[pixel]
        deviation = plain if shot == 0.0 else math.sqrt(read + shot * max(value, 0.0))
        value += deviation * table[bits & _MASK] + 0.5
        bits >>= _16
        levels[pixel] = np.uint8(min(max(value, 0.0), 255.0))
    return frame
