"""The pictures of light that do not change over time: of an empty background, and of one that is all marker."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fingerslip.vision.cameras.look import Lighting, PixelCamera

__all__ = ["brightness", "empty_picture", "marker_picture", "ring_mask"]

Picture = NDArray[np.float32]
Floats = NDArray[np.float64]

_MASKED = 3.0  # standard deviations of the bright ring on either side


def empty_picture(pixel_camera: PixelCamera) -> Picture:
    """Return the grey levels (height, width) of a frame without markers, noise and changes over time."""
    look, lighting = pixel_camera.look, pixel_camera.lighting
    surface = look.background + _texture(pixel_camera)
    return (_even_light(pixel_camera, lighting) * surface + _added_light(pixel_camera)).astype(np.float32)


def marker_picture(pixel_camera: PixelCamera) -> Picture:
    """Return the grey levels (height, width) that each pixel would have if a marker covered it."""
    light = _even_light(pixel_camera, pixel_camera.lighting)
    return (light * pixel_camera.look.marker + _added_light(pixel_camera)).astype(np.float32)


def brightness(lighting: Lighting, times: Floats) -> Floats:
    """Return the factors [-] by which light is brighter at some times [s] than at the time 0, without flicker."""
    wave = lighting.flicker * np.sin(2.0 * math.pi * lighting.flicker_rate * times)
    found: Floats = np.maximum(1.0 + lighting.drift * times + wave, 0.0)
    return found


def ring_mask(pixel_camera: PixelCamera) -> NDArray[np.bool_]:
    """Tell which pixels (height, width) a tracker may use: those inside the bright ring; all without one."""
    ring = pixel_camera.lighting.ring
    x, y = _grid(pixel_camera)
    height = pixel_camera.camera.intrinsics.height
    largest = math.inf if ring is None else (ring.radius - _MASKED * ring.width) * height
    found: NDArray[np.bool_] = np.hypot(x, y) < largest
    return found


def _grid(pixel_camera: PixelCamera) -> tuple[Floats, Floats]:
    """Return x and y of all pixels from the middle of the image [px], to be broadcast."""
    lens = pixel_camera.camera.intrinsics
    x = np.arange(lens.width, dtype=np.float64) - 0.5 * (lens.width - 1)
    y = np.arange(lens.height, dtype=np.float64) - 0.5 * (lens.height - 1)
    return x[None, :], y[:, None]


def _even_light(pixel_camera: PixelCamera, lighting: Lighting) -> Floats:
    x, y = _grid(pixel_camera)
    corner = x[0, -1] ** 2 + y[-1, 0] ** 2
    lost = lighting.vignetting * (x * x + y * y) / max(corner, 1.0)
    along = (x * math.cos(lighting.gradient_angle) + y * math.sin(lighting.gradient_angle)) / x.size
    found: Floats = np.maximum((1.0 - lost) * (1.0 + lighting.gradient * along), 0.0)
    return found


def _added_light(pixel_camera: PixelCamera) -> Floats:
    """Return the grey levels that glare and ring add."""
    lighting = pixel_camera.lighting
    x, y = _grid(pixel_camera)
    found = np.zeros((y.size, x.size))
    for spot in lighting.glare:
        across, down = x - (spot.x - 0.5) * x.size, y - (spot.y - 0.5) * y.size
        found += spot.level * np.exp(-0.5 * (across * across + down * down) / (spot.radius * x.size) ** 2)
    if lighting.ring is not None:
        off = np.hypot(x, y) / y.size - lighting.ring.radius
        found += lighting.ring.level * np.exp(-0.5 * (off / lighting.ring.width) ** 2)
    return found


def _texture(pixel_camera: PixelCamera) -> Floats:
    """Return a seeded pattern of the background [grey levels]; zeros without one."""
    lighting, lens = pixel_camera.lighting, pixel_camera.camera.intrinsics
    shape = (lens.height, lens.width)
    if lighting.texture == 0:
        return np.zeros(shape)
    from scipy import ndimage

    random = np.random.default_rng([pixel_camera.seed, 1])
    pattern: Floats = ndimage.gaussian_filter(random.standard_normal(shape), lighting.texture_length, mode="wrap")
    pattern *= lighting.texture / pattern.std()
    return pattern
