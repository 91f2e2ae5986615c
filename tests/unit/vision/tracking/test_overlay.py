"""The overlay: circles where markers are, in the colours of their rings, and none where they are not."""

from __future__ import annotations

import numpy as np

from fingerslip.vision.tracking.overlay import overlaid
from unit.vision.tracking.conftest import Clip


def test_circles_are_drawn_around_what_was_found(clip: Clip) -> None:
    tracks = clip.tracks.copy(deep=True)
    tracks["position"][:, 5] = np.nan
    pictures = list(overlaid(clip.frames, tracks))
    assert len(pictures) == 40
    for marker, (x, y) in enumerate(clip.truth[0]):
        # A circle goes through here.
        column, row = round(x - 1.6 * 5.0 - 1.0), round(y)
        patch = pictures[0][row - 2 : row + 3, column - 2 : column + 3].astype(int)
        coloured = np.ptp(patch, axis=2).max() > 30
        assert coloured == (marker != 5), marker


def test_frames_in_colour_are_left_as_they_are(clip: Clip) -> None:
    colour = [np.repeat(frame[..., None], 3, axis=2) for frame in clip.frames[:2]]
    before = colour[0].copy()
    assert next(overlaid(colour, clip.tracks)).shape == (480, 640, 3)
    assert np.array_equal(colour[0], before)
