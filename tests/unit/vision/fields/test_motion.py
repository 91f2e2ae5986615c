"""Velocities are those of Savitzky and Golay where nothing is missing, and right where something is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from fingerslip.errors import InputError
from fingerslip.vision.fields import rest_positions, smooth_velocity, window_frames

RANDOM = np.random.default_rng(0)


def test_rest_is_the_mean_of_what_was_seen():
    position = np.array([[[1.0, 2.0], [0.0, 0.0]], [[3.0, 2.0], [np.nan, np.nan]], [[9.0, 9.0], [9.0, 9.0]]])
    np.testing.assert_array_equal(rest_positions(position, 2), [[2.0, 2.0], [0.0, 0.0]])
    assert np.isnan(rest_positions(np.full((3, 1, 2), np.nan), 2)).all()
    for frames in (0, 4):
        with pytest.raises(InputError, match=f"rest: got {frames} frames, needs 1 to 3"):
            rest_positions(position, frames)


@pytest.mark.parametrize("frames", [5, 7, 21])
def test_velocity_is_that_of_the_known_filter(frames):
    position = RANDOM.standard_normal((60, 4, 2))
    known = savgol_filter(position, frames, 2, deriv=1, delta=1 / 30, axis=0, mode="interp")
    np.testing.assert_allclose(smooth_velocity(position, np.arange(60) / 30, frames), known, atol=1e-9)


def test_parabolas_are_exact_at_uneven_times_and_with_gaps():
    times = np.sort(RANDOM.uniform(0, 2, 80))
    position = (1.0 + 3.0 * times - 2.0 * times**2)[:, None, None] * np.array([[1.0, -2.0], [0.5, 4.0]])
    truth = (3.0 - 4.0 * times)[:, None, None] * np.array([[1.0, -2.0], [0.5, 4.0]])
    lost = RANDOM.random((80, 2)) < 0.2
    position[lost] = np.nan
    found = smooth_velocity(position, times, 15)
    np.testing.assert_array_equal(np.isnan(found[..., 0]), lost)
    np.testing.assert_allclose(found[~lost], truth[~lost], rtol=1e-6)


def test_noise_is_damped_as_stated():
    noise = RANDOM.standard_normal((4000, 10, 2))
    half, step = 3, 1 / 30
    expected = np.sqrt(3 / (half * (half + 1) * (2 * half + 1))) / step
    assert smooth_velocity(noise, np.arange(4000) * step, 7)[3:-3].std() == pytest.approx(expected, rel=0.02)


def test_a_marker_seen_too_rarely_has_no_velocity():
    position = np.zeros((20, 1, 2))
    position[3:] = np.nan
    assert np.isnan(smooth_velocity(position, np.arange(20.0), 5)).all()


def test_the_window_spans_the_smoothing_time():
    times = np.arange(100) / 30
    assert [window_frames(times, span) for span in (0.01, 0.2, 1.0)] == [5, 7, 31]
    with pytest.raises(InputError, match="has 4 frames, and the smoothing time spans 7"):
        window_frames(times[:4], 0.2)
    with pytest.raises(InputError, match="spans 5"):
        window_frames(times[:1], 0.2)
    with pytest.raises(InputError, match="smoothing: got 0"):
        window_frames(times, 0)
