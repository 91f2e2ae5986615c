"""The folder of tracks."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.errors import InputError
from fingerslip.report.page.page import render_page
from fingerslip.report.page.sensor import quality_report, write_tracking
from fingerslip.vision.tracking.track import track_markers
from fingerslip.vision.video import open_frames
from problems import clips


def test_page_says_what_is_wrong_and_a_failure_leaves_nothing(tmp_path: Path) -> None:
    frames = list(clips.filmed(clips.still(clips.field(), 6)))
    tracks = track_markers(frames, n_markers=81, rest_frames=4, frame_rate=30.0)
    tracks.attrs |= {"partial": 1, "warnings": "something is odd"}
    page = render_page(quality_report(tracks, frames[0]))
    for words in ("These tracks are partial.", "something is odd", "largest noise at rest", "No marker was lost"):
        assert words in page
    broken = open_frames([*frames[:3], frames[3][:100]], 30.0)
    with pytest.raises(InputError, match="frame 3"):
        write_tracking(tracks, broken, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []
