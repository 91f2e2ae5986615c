"""Markers that are followed frame by frame are those of the whole tracks."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.tracking.track import open_markers
from unit.vision.tracking.conftest import RATE, REST, Clip


def test_frames_give_what_the_tracks_have(clip: Clip) -> None:
    stream = open_markers(clip.frames, n_markers=81, rest_frames=REST, frame_rate=RATE)
    seen = list(stream)
    np.testing.assert_array_equal([one.position for one in seen], clip.tracks["position"].values)
    np.testing.assert_array_equal([one.quality for one in seen], clip.tracks["quality"].values)
    np.testing.assert_allclose([one.time for one in seen], clip.tracks["time"].values)


def test_the_reference_tells_how_many_markers_there_are_and_in_which_rings(clip: Clip) -> None:
    at_rest = open_markers(clip.frames, n_markers=81, rest_frames=REST, frame_rate=RATE).at_rest
    assert at_rest.sizes["marker"] == 81
    np.testing.assert_array_equal(at_rest["ring"].values, clip.tracks["ring"].values)


def test_a_stream_can_be_gone_through_again(clip: Clip) -> None:
    stream = open_markers(clip.frames[:12], n_markers=81, rest_frames=REST, frame_rate=RATE)
    first, again = ([one.position for one in stream] for _ in range(2))
    np.testing.assert_array_equal(first, again)


def test_counts_have_to_be_above_zero(clip: Clip) -> None:
    with pytest.raises(InputError, match="rest_frames: got 0, needs a number >= 1"):
        open_markers(clip.frames, rest_frames=0, frame_rate=RATE)
