"""The folder of tracks."""

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.report.page.page import render_page
from fingerslip.report.page.sensor import quality_report, write_tracking
from fingerslip.report.page.tracking import track_video
from fingerslip.storage.netcdf import read_netcdf
from fingerslip.vision.overlay import SHOWN_FIELDS
from fingerslip.vision.tracking.track import track_markers
from fingerslip.vision.video import open_frames, read_frames, write_video
from problems import clips


def test_page_says_what_is_wrong_and_a_failure_leaves_nothing(tmp_path):
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


def test_folder_stands_beside_the_video(tmp_path):
    write_video(tmp_path / "a.mkv", clips.filmed(clips.still(clips.field(), 5)), 30.0)
    lines = list(track_video(tmp_path / "a.mkv", None, {"rest_frames": 3}))
    assert lines == [
        "tracks of 81 markers in 5 frames, 100.00 % of the positions found",
        f"quality: {tmp_path / 'a_tracks' / 'quality.html'}",
    ]


@pytest.mark.slow
def test_more_markers_than_asked_for_are_said_and_on_the_page(tmp_path):
    write_video(tmp_path / "a.mkv", clips.filmed(clips.still(clips.field(), 5)), 30.0)
    lines = list(track_video(tmp_path / "a.mkv", None, {"rest_frames": 3, "n_markers": 5}))
    warning = "asked for 5 markers, found 81 of the same kind in the first frames"
    assert any(line.startswith("warning: ") and warning in line for line in lines)
    assert any(line.startswith("partial tracks of ") for line in lines)
    page = (tmp_path / "a_tracks" / "quality.html").read_text(encoding="utf-8")
    assert warning in page
    assert "These tracks are partial." in page


@pytest.mark.slow
def test_markers_that_are_often_lost_are_counted(tmp_path):
    field = clips.field()
    frames = list(clips.filmed(clips.still(field, 10)))
    x, y = np.round(np.asarray(clips.still(field, 10))[0, 0]).astype(int)
    for frame in frames[5:]:
        frame[y - 15 : y + 15, x - 15 : x + 15] = np.median(frame)
    write_video(tmp_path / "a.mkv", frames, 30.0)
    lines = list(track_video(tmp_path / "a.mkv", None, {"rest_frames": 3, "n_markers": 81}))
    warning = "1 of 81 markers were not seen in more than a tenth of the frames"
    assert any(line.startswith("warning: ") and warning in line for line in lines)


@pytest.mark.slow
def test_fields_are_written_with_a_picture_and_videos(tmp_path):
    write_video(tmp_path / "a.mkv", clips.filmed(clips.still(clips.field(), 8)), 30.0)
    lines = list(track_video(tmp_path / "a.mkv", None, {"rest_frames": 3, "n_markers": 81}, fields=True))
    assert lines[-1].startswith(f"fields: {tmp_path / 'a_tracks' / 'fields.nc'}, fields.png, displacement.avi")
    assert read_netcdf(tmp_path / "a_tracks" / "fields.nc")["strain"].sizes["time"] == 8
    for name in SHOWN_FIELDS:
        assert len(list(read_frames(tmp_path / "a_tracks" / f"{name}.avi", colour="bgr"))) == 8
