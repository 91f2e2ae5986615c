"""Measures of quality: counts, lost intervals, noise, jumps."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.vision.tracking.track import Lost, jumps, lost_intervals, noise_at_rest, seen_count, seen_share
from unit.vision.tracking.conftest import Clip


def test_everything_was_seen(clip: Clip) -> None:
    assert (seen_count(clip.tracks) == 81).all()
    assert seen_share(clip.tracks) == 1.0
    assert lost_intervals(clip.tracks) == []
    assert 0.002 < np.median(noise_at_rest(clip.tracks)) < 0.03


def test_lost_intervals_begin_and_end_where_they_do(clip: Clip) -> None:
    tracks = clip.tracks.copy(deep=True)
    for marker, first, last in ((3, 5, 9), (3, 20, 20), (7, 30, 39)):
        tracks["position"][first : last + 1, marker] = np.nan
    assert lost_intervals(tracks) == [Lost(3, 5, 9, True), Lost(3, 20, 20, True), Lost(7, 30, 39, False)]
    assert lost_intervals(tracks)[0].frames == 5


def test_swap_is_a_jump(clip: Clip) -> None:
    assert np.nanmax(jumps(clip.tracks)) < 3.0
    tracks = clip.tracks.copy(deep=True)
    swapped = tracks["position"].values[20:, [11, 12]]
    tracks["position"][20:, [12, 11]] = swapped
    found = jumps(tracks)
    assert found.shape == (39, 81)
    assert np.argwhere(found > 20.0).tolist() == [[19, 11], [19, 12]]
    assert found[19, 11] == pytest.approx(np.linalg.norm(swapped[0, 0] - swapped[0, 1]), rel=0.2)
