"""Frames of arrays, folders and files, grey and in colour."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.video import open_frames, write_video

GREY = np.random.default_rng(0).integers(0, 255, (4, 32, 48)).astype(np.uint8)


def test_arrays_can_be_read_again() -> None:
    frames = open_frames(GREY, 30.0)
    for _ in range(2):
        assert np.array_equal(list(frames.read()), GREY)
    assert frames.frame_rate == 30.0


def test_colour_is_made_grey_or_a_channel_is_taken() -> None:
    colour = np.stack([GREY, GREY // 2, GREY // 4], axis=3)
    assert np.array_equal(list(open_frames(colour, 30.0, "green").read()), GREY // 2)
    grey = next(open_frames(colour, 30.0).read()).astype(float)
    assert np.abs(grey - (0.114 * GREY[0] + 0.587 * (GREY[0] // 2) + 0.299 * (GREY[0] // 4))).max() <= 1.0


def test_sixteen_bits_and_single_channels() -> None:
    assert np.array_equal(next(open_frames(GREY.astype(np.uint16) * 256, 30.0).read()), GREY[0])
    assert np.array_equal(next(open_frames(GREY[..., None], 30.0).read()), GREY[0])


def test_files_and_folders(tmp_path: Path) -> None:
    for name in ("clip.mkv", "images"):
        write_video(tmp_path / name, GREY, 25.0)
        frames = open_frames(tmp_path / name)
        assert frames.frame_rate == 25.0
        assert np.array_equal(list(frames.read()), GREY)
        assert open_frames(tmp_path / name, 50.0).frame_rate == 50.0


def test_colour_file_by_channel(tmp_path: Path) -> None:
    colour = np.zeros((3, 32, 48, 3), dtype=np.uint8)
    colour[..., 2] = 200
    write_video(tmp_path / "red", colour, 25.0)
    assert next(open_frames(tmp_path / "red", channel="red").read()).mean() == 200
    assert next(open_frames(tmp_path / "red", channel="blue").read()).mean() == 0


@pytest.mark.parametrize(
    ("video", "rate", "channel", "words"),
    [
        (GREY, None, "grey", "video: states no frame rate, needs frames a second > 0; give frame_rate"),
        (GREY, -3.0, "grey", "got the frame rate -3.0"),
        ([], 30.0, "grey", "has no frames"),
        (GREY, 30.0, "pink", "channel: got 'pink', needs one of grey, blue, green, red"),
        ("none.mp4", None, "grey", "none.mp4"),
    ],
)
def test_what_cannot_be_opened(video: object, rate: float | None, channel: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        open_frames(video, rate, channel)  # type: ignore[arg-type]


def test_frames_of_another_type_are_refused() -> None:
    with pytest.raises(InputError, match="a frame has the type float64"):
        next(open_frames(GREY.astype(float), 30.0).read())
