"""Overlays show each marker that is seen with its arrow, and nothing of one that is not."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.overlay import RING_COLOURS, overlay_frames, write_overlay
from fingerslip.vision.tracks import make_tracks
from fingerslip.vision.video import read_frames, video_info

GREY = np.full((120, 160), 90, dtype=np.uint8)


def tracks(**more):
    """Return two markers; the first moves by 20 px along x, the second is lost at the second time."""
    position = np.array([[[40.0, 60.0], [100.0, 60.0]], [[60.0, 60.0], [np.nan, np.nan]]])
    return make_tracks(position, [0.0, 0.1], units="px", ring=[0, 1], **more)


def coloured(frame, ring: int) -> np.ndarray:
    """Tell which pixels below the text have the colour of a ring."""
    found = (np.abs(frame.astype(int) - RING_COLOURS[ring]).sum(axis=2) < 60) & (np.arange(120) > 30)[:, None]
    return np.asarray(found)


def test_markers_have_circles_and_arrows_in_the_colour_of_their_ring():
    first, second = overlay_frames([GREY, GREY], tracks())
    assert first.shape == (120, 160, 3)
    for frame, ring, x in ((first, 0, 40), (first, 1, 100), (second, 0, 60)):
        columns = np.flatnonzero(coloured(frame, ring).any(axis=0))
        assert x - 5 <= columns.min() <= x + 5
    assert np.flatnonzero(coloured(first, 0).any(axis=0)).max() <= 45, "no arrow at rest"
    assert np.flatnonzero(coloured(second, 0).any(axis=0)).max() == pytest.approx(80, abs=1)
    assert not coloured(second, 1).any(), "a lost marker is not drawn"
    assert (first[:30] == 255).all(axis=2).any(), "time and count"


def test_arrows_may_be_others_and_stretched():
    arrows = np.zeros((2, 2, 2))
    arrows[0, 0] = [0.0, 10.0]
    (frame,) = overlay_frames([GREY], tracks().isel(time=slice(1)), arrows=arrows[:1], stretch=3.0)
    assert np.flatnonzero(coloured(frame, 0).any(axis=1)).max() == pytest.approx(90, abs=1)


def test_colour_frames_are_kept_and_not_drawn_on():
    colour = np.dstack([GREY, GREY // 2, GREY // 3])
    before = colour.copy()
    frame = next(overlay_frames([colour, colour], tracks()))
    np.testing.assert_array_equal(colour, before)
    assert frame[119, 159].tolist() == [90, 45, 30]


def test_an_overlay_is_written_at_the_rate_of_the_tracks(tmp_path):
    known = tracks(attributes={"frame_rate": 10.0})
    assert write_overlay([GREY, GREY], known, tmp_path / "overlay.mkv") == 2
    assert video_info(tmp_path / "overlay.mkv").frame_rate == 10.0
    np.testing.assert_array_equal(
        list(read_frames(tmp_path / "overlay.mkv", colour="bgr")), list(overlay_frames([GREY, GREY], known))
    )


def test_what_does_not_fit_is_refused(tmp_path):
    with pytest.raises(InputError, match="frame_rate: is not there"):
        write_overlay([GREY], tracks(), tmp_path / "a.avi")
    with pytest.raises(InputError, match=r"arrows: got shape \(1, 2, 2\)"):
        overlay_frames([GREY], tracks(), arrows=np.zeros((1, 2, 2)))
    with pytest.raises(InputError, match="frames: got 1, needs 2"):
        list(overlay_frames([GREY], tracks()))
    with pytest.raises(InputError, match="is in m, needs px"):
        overlay_frames([GREY], make_tracks(np.zeros((1, 1, 2)), [0.0], units="m"))


def test_no_frames_are_none():
    assert list(overlay_frames([], tracks().isel(time=slice(0)))) == []
