"""From a video to a folder, in lines."""

from __future__ import annotations

from pathlib import Path

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
