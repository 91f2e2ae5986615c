"""Frames as a whole: dark, overexposed, duplicated."""

from __future__ import annotations

import numpy as np

from fingerslip.vision.video import DARK, DUPLICATED, FINE, OVEREXPOSED, frame_state, rest_exposure

FRAME = np.random.default_rng(0).integers(80, 160, (64, 96)).astype(np.uint8)
REST = rest_exposure(FRAME)


def test_states() -> None:
    assert frame_state(FRAME, None, REST) == FINE
    assert frame_state(FRAME, FRAME[::-1], REST) == FINE
    assert frame_state(FRAME // 8, None, REST) == DARK
    assert frame_state(np.full_like(FRAME, 255), None, REST) == OVEREXPOSED
    assert frame_state(FRAME.copy(), FRAME, REST) == DUPLICATED


def test_one_other_pixel_is_another_frame() -> None:
    other = FRAME.copy()
    other[3, 5] += 1
    assert frame_state(other, FRAME, REST) == FINE


def test_frames_that_are_bright_at_rest_are_not_overexposed() -> None:
    bright = np.full((64, 96), 253, dtype=np.uint8)
    assert frame_state(bright, None, rest_exposure(bright)) == FINE
