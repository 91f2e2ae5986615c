"""Tracks beside the truth."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.comparison import matched_tracks, track_errors
from fingerslip.vision.tracks import make_tracks


def truth():
    rest = np.array([[10.0, 10.0], [30.0, 10.0], [10.0, 40.0]])
    position = rest[None] + np.arange(4)[:, None, None] * np.array([1.0, 0.0])
    return make_tracks(position, 0.1 * np.arange(4), units="px", kind="external", ring=np.array([0, 1, 1]))


def test_markers_in_another_order_are_matched():
    known = truth()
    order = [2, 0, 1]
    found = make_tracks(known["position"].values[:, order] + 0.1, np.arange(4.0), units="px")
    matched = matched_tracks(found, known)
    assert matched["position"].values == pytest.approx(known["position"].values + 0.1)
    assert matched["ring"].values.tolist() == [0, 1, 1]
    errors = track_errors(matched, known)
    assert (errors.frames, errors.markers, errors.kept, errors.swapped) == (4, 3, 1.0, 0)
    assert errors.rms == pytest.approx(0.1)
    assert errors.largest == pytest.approx(0.1 * np.sqrt(2.0))


def test_lost_swapped_and_unseen_markers_count():
    known = truth()
    position = known["position"].values.copy()
    position[3, [0, 1]] = position[3, [1, 0]]
    position[1, 2] = np.nan
    found = make_tracks(position, known["time"].values, units="px")
    errors = track_errors(found, known)
    assert errors.swapped == 2
    assert errors.kept == pytest.approx(9 / 12)
    hidden = known["position"].values.copy()
    hidden[:, 1] = np.nan
    seen = track_errors(found, make_tracks(hidden, known["time"].values, units="px"))
    assert seen.markers == 2


def test_nothing_found_and_a_video_that_was_cut_off():
    known = truth()
    short = make_tracks(np.full((2, 1, 2), np.nan), [0.0, 1.0], units="px")
    matched = matched_tracks(short, known)
    assert np.isnan(matched["position"].values).all()
    errors = track_errors(matched, known)
    assert (errors.rms, errors.largest, errors.kept) == (None, None, 0.0)


def test_more_frames_or_other_markers_are_refused():
    known = truth()
    with pytest.raises(InputError, match="needs at most 2, as the truth has"):
        matched_tracks(known, known.isel(time=[0, 1]))
    with pytest.raises(InputError, match="needs the same times and markers"):
        track_errors(known.isel(marker=[0, 1]), known)
