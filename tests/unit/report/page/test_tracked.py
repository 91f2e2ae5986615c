"""From a video to a folder, in lines."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.report.page.tracked import track_video
from fingerslip.vision.video import write_video
from problems import clips


def test_folder_stands_beside_the_video(tmp_path: Path) -> None:
    write_video(tmp_path / "a.mkv", clips.filmed(clips.still(clips.field(), 5)), 30.0)
    lines = list(track_video(tmp_path / "a.mkv", None, {"rest_frames": 3}))
    assert lines == [
        "tracks of 81 markers in 5 frames, 100.00 % of the positions found",
        f"quality: {tmp_path / 'a_tracks' / 'quality.html'}",
    ]


@pytest.mark.slow
def test_more_markers_than_asked_for_are_said_and_on_the_page(tmp_path: Path) -> None:
    write_video(tmp_path / "a.mkv", clips.filmed(clips.still(clips.field(), 5)), 30.0)
    lines = list(track_video(tmp_path / "a.mkv", None, {"rest_frames": 3, "n_markers": 5}))
    warning = "asked for 5 markers, found 81 of the same kind in the first frames"
    assert any(line.startswith("warning: ") and warning in line for line in lines)
    assert any(line.startswith("partial tracks of ") for line in lines)
    page = (tmp_path / "a_tracks" / "quality.html").read_text(encoding="utf-8")
    assert warning in page
    assert "These tracks are partial." in page
