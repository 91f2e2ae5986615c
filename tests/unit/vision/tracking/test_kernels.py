"""Fits of single markers: what is known is found, glare does not pull, nothing is found where nothing is."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.vision.tracking.kernels import (
    AMPLITUDE,
    COLUMNS,
    CORRELATION,
    N_PROFILE,
    WEIGHT,
    learn_profiles,
    learn_shapes,
    measure_markers,
)
from problems import clips

LOOK = clips.Look(shape=(64, 64), noise=0.0)
CIRCLE = np.array([[1.0, 0.0, 1.0]])
WINDOW, RADIUS = np.array([11.0]), np.array([5.0])
EVERYWHERE = np.empty((0, 0), dtype=bool)


def frame(x: float, y: float, **changes: object) -> np.ndarray:
    return next(clips.filmed(np.array([[[x, y]]]), clips.with_look(LOOK, **changes)))


def profile() -> np.ndarray:
    out = learn_profiles(frame(32.0, 32.0).astype(float), np.array([[32.0, 32.0]]), WINDOW, CIRCLE, -1.0)
    out = np.interp(np.arange(N_PROFILE), np.flatnonzero(np.isfinite(out[0])), out[0][np.isfinite(out[0])])[None]
    out -= out[:, -4:].mean()
    return out / out[:, 0]


def measured(image: np.ndarray, start: tuple[float, float], mask: np.ndarray = EVERYWHERE) -> np.ndarray:
    out = np.empty((1, COLUMNS))
    measure_markers(image, mask, np.array([start]), RADIUS, WINDOW, CIRCLE, profile(), -1.0, out)
    return out[0]


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.25, -0.4), (0.5, 0.5), (0.13, 0.77)])
def test_centre_is_found_below_the_pixel_from_pixels_away(shift: tuple[float, float]) -> None:
    x, y = 31.0 + shift[0], 33.0 + shift[1]
    found = measured(frame(x, y), (x + 4.0, y - 3.0))
    # Grey levels are whole numbers, and the profile is that of one frame.
    assert found[:2] == pytest.approx([x, y], abs=0.05)
    assert found[AMPLITUDE] == pytest.approx(120.0, rel=0.03)
    assert found[CORRELATION] > 0.99
    assert found[WEIGHT] > 0.95


def test_gradient_of_the_light_does_not_shift_the_centre() -> None:
    found = measured(frame(32.3, 31.6, gradient=0.4), (32.0, 32.0))
    assert found[:2] == pytest.approx([32.3, 31.6], abs=0.05)


def test_glare_beside_the_marker_does_not_pull() -> None:
    image = frame(32.3, 31.6).astype(float)
    rows, columns = np.mgrid[:64, :64]
    image += 90.0 * np.exp(-((columns - 41.0) ** 2 + (rows - 31.0) ** 2) / 8.0)
    found = measured(image.clip(0, 255).astype(np.uint8), (32.0, 32.0))
    assert found[:2] == pytest.approx([32.3, 31.6], abs=0.05)
    assert found[WEIGHT] < 0.97


def test_nothing_is_found_on_an_empty_background_outside_and_behind_the_mask() -> None:
    empty = np.full((64, 64), 120, dtype=np.uint8)
    behind = np.zeros((64, 64), dtype=bool)
    for found in (
        measured(empty, (32.0, 32.0)),
        measured(frame(32.0, 32.0), (np.nan, np.nan)),
        measured(frame(32.0, 32.0), (-40.0, 5.0)),
        measured(frame(32.0, 32.0), (32.0, 32.0), behind),
    ):
        assert found[CORRELATION] == 0.0
        assert np.isnan(found[0])


def test_shapes_are_ellipses_of_determinant_one() -> None:
    rows, columns = np.mgrid[:64, :64]
    image = np.where(((columns - 32) / 8.0) ** 2 + ((rows - 32) / 5.0) ** 2 < 1.0, 40.0, 160.0)
    points, window = np.array([[32.0, 32.0]]), np.array([14.0])
    a, b, c = learn_shapes(image, points, RADIUS, window, -1.0)[0]
    assert a * c - b * b == pytest.approx(1.0)
    # The metric is the inverse of the squared axes.
    assert c / a == pytest.approx((8.0 / 5.0) ** 2, rel=0.15)
    assert b == pytest.approx(0.0, abs=0.01)
    line = np.where(np.abs(rows - 32) < 2, 40.0, 160.0)
    assert learn_shapes(line, points, RADIUS, window, -1.0).tolist() == [[1.0, 0.0, 1.0]]
