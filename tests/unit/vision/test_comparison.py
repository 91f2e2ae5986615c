"""Tracks beside the truth."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.comparison import matched_tracks, track_errors
from fingerslip.vision.tracks import make_tracks

TIMES = 0.1 * np.arange(4)
POSITION = np.array([[10.0, 10.0], [30.0, 10.0], [10.0, 40.0]]) + np.arange(4)[:, None, None] * np.array([1.0, 0.0])
TRUTH = make_tracks(POSITION, TIMES, units="px", kind="external", ring=np.array([0, 1, 1]))


def test_markers_in_another_order_are_matched():
    found = make_tracks(POSITION[:, [2, 0, 1]] + 0.1, np.arange(4.0), units="px")
    matched = matched_tracks(found, TRUTH)
    assert matched["position"].values == pytest.approx(POSITION + 0.1)
    assert matched["ring"].values.tolist() == [0, 1, 1]
    errors = track_errors(matched, TRUTH)
    assert (errors.frames, errors.markers, errors.kept, errors.swapped) == (4, 3, 1.0, 0)
    assert (errors.rms, errors.largest) == pytest.approx((0.1, 0.1 * np.sqrt(2.0)))


def test_lost_swapped_and_unseen_markers_count():
    position = POSITION.copy()
    position[3, [0, 1]] = position[3, [1, 0]]
    position[1, 2] = np.nan
    found = make_tracks(position, TIMES, units="px")
    errors = track_errors(found, TRUTH)
    assert (errors.swapped, errors.kept) == (2, pytest.approx(9 / 12))
    hidden = POSITION.copy()
    hidden[:, 1] = np.nan
    assert track_errors(found, make_tracks(hidden, TIMES, units="px")).markers == 2


def test_nothing_found_and_a_video_that_was_cut_off():
    matched = matched_tracks(make_tracks(np.full((2, 1, 2), np.nan), [0.0, 1.0], units="px"), TRUTH)
    assert np.isnan(matched["position"].values).all()
    errors = track_errors(matched, TRUTH)
    assert (errors.rms, errors.largest, errors.kept) == (None, None, 0.0)


def test_more_frames_or_other_markers_are_refused():
    with pytest.raises(InputError, match="needs at most 2, as the truth has"):
        matched_tracks(TRUTH, TRUTH.isel(time=[0, 1]))
    with pytest.raises(InputError, match="needs the same times and markers"):
        track_errors(TRUTH.isel(marker=[0, 1]), TRUTH)
