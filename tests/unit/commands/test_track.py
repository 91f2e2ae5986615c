"""``fingerslip track``: a folder with everything in it, and clear words where there is none."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fingerslip.vision.tracks import read_tracks
from fingerslip.vision.video import video_info, write_video
from problems import clips


def test_folder_has_tracks_overlay_and_page(invoke: Callable[..., Any], tmp_path: Path) -> None:
    frames = clips.filmed(clips.slide(clips.field(), 0.3, count=12, rest=6))
    write_video(tmp_path / "clip.avi", frames, 60.0)
    done = invoke("track", "clip.avi", "--markers", 81, "--rest", 6)
    assert done.exit_code == 0, done.stderr
    assert "tracks of 81 markers in 12 frames, 100.00 % of the positions found" in done.stdout
    folder = tmp_path / "clip_tracks"
    assert sorted(path.name for path in folder.iterdir()) == ["overlay.avi", "quality.html", "tracks.csv", "tracks.nc"]
    assert read_tracks(folder / "tracks.nc").sizes["marker"] == 81
    assert video_info(folder / "overlay.avi").frame_count == 12
    assert "following its markers" in done.stderr
    again = invoke("track", "clip.avi", "--markers", 81, "--rest", 6, "--quiet")
    assert (again.stdout, again.stderr) == (done.stdout, "")


def test_partial_tracks_are_called_so(invoke: Callable[..., Any], tmp_path: Path) -> None:
    write_video(tmp_path / "images", clips.filmed(clips.still(clips.field()[:75], 6)), 60.0)
    done = invoke("track", "images", "--markers", 81, "--rest", 4, "--layout", "free", "--dark", "--out", "there")
    assert done.exit_code == 0, done.stderr
    assert "warning: found 75 of 81 markers in the first frames" in done.stdout
    assert "partial tracks of 75 markers" in done.stdout
    assert "These tracks are partial." in (tmp_path / "there" / "quality.html").read_text()


def test_a_broken_mp4_is_one_line(tmp_path: Path) -> None:
    # FFmpeg would add lines of its own on the process's standard error, which only another process shows.
    (tmp_path / "cut.mp4").write_bytes(b"\x00\x00\x00\x18ftypmp42\x00\x00\x00\x00mp42isom" + bytes(range(256)) * 9)
    track = [sys.executable, "-m", "fingerslip", "track", "cut.mp4", "--quiet"]
    done = subprocess.run(track, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: cut.mp4: cannot be read as a video, needs a whole file")


def test_wrong_input_is_one_line_and_leaves_nothing(invoke: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "clip.mp4").write_text("no video")
    done = invoke("track", "clip.mp4")
    assert done.exit_code == 2
    assert "error: clip.mp4: cannot be read as a video" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["clip.mp4"]
