"""Frames as they come: cameras whose newest frame counts, readers of files, and whatever yields times and frames."""

from __future__ import annotations

import time as clock

import cv2
import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.sources import dropped_frames, live_frames
from fingerslip.vision.video import write_video


class Camera:
    """A camera that gives a frame each so many seconds, numbered by their grey level."""

    def __init__(self, frames: int, interval: float) -> None:
        self.frames, self.interval, self.number = frames, interval, 0

    def isOpened(self) -> bool:  # noqa: N802  as OpenCV has it
        return self.frames > 0

    def get(self, _: int) -> float:
        return -1.0

    def read(self):
        clock.sleep(self.interval)
        self.number += 1
        return self.number <= self.frames, np.full((4, 6, 3), self.number, dtype=np.uint8)


def test_a_slow_reader_gets_the_newest_frames_and_the_last_one():
    levels, times = [], []
    for time, frame in live_frames(Camera(40, 0.005)):
        levels.append(int(frame[0, 0]))
        times.append(time)
        clock.sleep(0.02)
    assert len(levels) < 30
    assert sorted(set(levels)) == levels
    assert levels[-1] == 40
    assert times[0] == 0.0
    assert (np.diff(times) > 0).all()


def test_of_a_file_and_of_what_yields_frames_none_is_dropped(tmp_path):
    frames = [np.full((48, 64), 10 * number, dtype=np.uint8) for number in range(12)]
    write_video(tmp_path / "clip.mkv", frames, 20.0)
    capture = cv2.VideoCapture(str(tmp_path / "clip.mkv"))
    expected = [(number / 20.0, 10 * number) for number in range(12)]
    for source in (capture, ((number / 20.0, frame) for number, frame in enumerate(frames))):
        taken = []
        for time, frame in live_frames(source):
            clock.sleep(0.002)
            taken.append((time, int(frame[0, 0])))
        assert taken == expected


def test_what_gives_no_frames_is_refused():
    with pytest.raises(InputError, match="camera: cannot be opened, needs a camera that gives frames"):
        next(live_frames(Camera(0, 0.0)))
    with pytest.raises(InputError, match="camera: a frame has the type float64"):
        next(live_frames([(0.0, np.zeros((4, 6)))]))


def test_dropped_frames_are_counted():
    cases = [0, 1, 2, 5, 6], [0, 1, 2, 3], [0.0], [0, 1, 2, 3.4]
    assert [dropped_frames(times) for times in cases] == [2, 0, 0, 0]
