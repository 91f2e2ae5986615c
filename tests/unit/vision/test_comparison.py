"""Tracks beside the truth, and the statistics of their errors."""

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.comparison import PositionErrors, matched_tracks, position_errors, track_errors
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
    unseen = np.where(np.arange(3)[:, None] == 2, np.nan, POSITION)
    matched = matched_tracks(TRUTH, make_tracks(unseen, TIMES, units="px"))
    assert np.isnan(matched["position"].values[:, 2]).all(), "what has no truth is no marker of it"


def tracks(position):
    return make_tracks(position, np.arange(len(position)) / 30.0, units="px")


def test_noise_bias_and_losses_are_told_apart():
    random = np.random.default_rng(0)
    truth = random.uniform(0, 100, (500, 80, 2))
    found = truth + 0.03 * random.standard_normal((80, 2)) + 0.01 * random.standard_normal(truth.shape)
    found[random.random((500, 80)) < 0.02] = np.nan
    measured = position_errors(tracks(found), tracks(truth))
    assert measured.noise == pytest.approx(0.01, rel=0.02)
    assert measured.bias == pytest.approx(0.03, rel=0.2)
    assert measured.lost == pytest.approx(0.02, rel=0.1)
    assert abs(measured.correlation) < 0.02
    assert measured.rms == np.hypot(measured.noise, measured.bias)


def test_white_noise_of_few_frames_is_no_bias_and_no_errors_are_none():
    white, zeros = np.random.default_rng(0).standard_normal((10, 2000, 2)), tracks(np.zeros((10, 2000, 2)))
    measured = position_errors(tracks(white), zeros)
    assert measured.noise == pytest.approx(1.0, rel=0.02)
    assert measured.bias < 0.1
    assert position_errors(zeros, zeros) == PositionErrors(0.0)
    truth = np.zeros((5, 2, 2))
    truth[:, 1] = np.nan
    assert position_errors(tracks(truth), tracks(truth)).lost == 0.0, "outside the image"


ZEROS, NANS = np.zeros((5, 2, 2)), np.full((5, 2, 2), np.nan)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: matched_tracks(TRUTH, TRUTH.isel(time=[0, 1])), "needs at most 2, as the truth has"),
        (lambda: track_errors(TRUTH.isel(marker=[0, 1]), TRUTH), "needs the same times and markers in both"),
        (lambda: position_errors(tracks(ZEROS), tracks(ZEROS[:, :1])), "needs the same times and markers in both"),
        (lambda: position_errors(tracks(NANS), tracks(ZEROS)), "tracks: has no marker in three frames"),
    ],
)
def test_what_cannot_be_compared_is_refused(call, said):
    with pytest.raises(InputError, match=said):
        call()
