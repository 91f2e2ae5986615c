"""Videos come back as they were written, stream, and tell what is wrong with them and with their frames."""

import sys
import time as clock
import tracemalloc
from functools import partial

import cv2
import numpy as np
import pytest

from fingerslip.errors import DamagedError, InputError, ResultError, TruncatedVideoError
from fingerslip.storage.files import write_json
from fingerslip.vision import video

NOISE = np.random.default_rng(0).integers(0, 255, (4, 32, 48)).astype(np.uint8)
COLOUR = np.stack([NOISE, NOISE // 2, NOISE // 4], axis=3)
SQUARE = np.zeros((4, 4), np.uint8)


def clip(count=12, colour=False):
    """Yield frames of 64 x 48 with a bright square that moves, on a grey slope."""
    slope = np.tile(np.linspace(40, 80, 64), (48, 1)).astype(np.uint8)
    for number in range(count):
        frame = slope.copy()
        frame[16:32, 8 + 2 * number : 24 + 2 * number] = 220
        yield np.dstack([frame, frame // 2, frame // 4]) if colour else frame


def test_missing_opencv_is_told_with_the_repair(monkeypatch):
    assert callable(video.opencv().imread)
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(InputError, match=r'cv2 is missing .* need OpenCV; pip install "fingerslip\[vision\]"'):
        video.opencv()


@pytest.mark.parametrize(("name", "error"), [("a.mkv", 0), ("frames", 0), ("a.avi", 30), ("a.mp4", 30)])
@pytest.mark.parametrize("colour", [False, True])
def test_frames_come_back_in_colour_and_in_grey(tmp_path, name, error, colour):
    path = tmp_path / name
    assert video.write_video(path, clip(colour=colour), 29.97) == 12
    assert video.stated_rate(path) == pytest.approx(29.97, rel=1e-6)
    back = list(video.read_frames(path, colour="bgr" if colour else "grey"))
    for frame, original in zip(back, clip(colour=colour), strict=True):
        assert (frame.dtype, frame.shape) == (np.uint8, original.shape)
        assert np.abs(frame.astype(int) - original).mean() <= error / 4
        # Colours are stored in coarser squares, and in steps, by formats that keep grey levels.
        assert np.abs(frame.astype(int) - original).max() <= (error + 2 if not colour else 150)
    assert next(video.read_frames(path, colour="grey" if colour else "bgr")).shape == (48, 64, 3)[: 2 if colour else 3]
    assert sorted(entry.name for entry in tmp_path.iterdir()) == [name]


def test_folders_sort_their_images_take_any_size_and_replace_their_like_and_nothing_else(tmp_path):
    for number in (10, 2, 1):
        video.opencv().imwrite(str(tmp_path / f"frame_{number}.png"), np.full((4, 4), number, dtype=np.uint8))
    assert [int(frame[0, 0]) for frame in video.read_frames(tmp_path)] == [1, 2, 10]
    frames = np.full((3, 5, 7), 7, dtype=np.uint8)
    video.write_video(tmp_path / "mine", frames, 25.0)
    video.write_video(tmp_path / "mine", frames[:2], 25.0)
    np.testing.assert_array_equal(list(video.read_frames(tmp_path / "mine")), frames[:2])
    theirs = tmp_path / "theirs"
    theirs.mkdir()
    (theirs / "notes.txt").write_text("theirs")
    with pytest.raises(InputError, match=r"holds files, but no video\.json, needs a new folder"):
        video.write_video(theirs, frames, 25.0)
    assert [path.name for path in theirs.iterdir()] == ["notes.txt"]


def test_frames_stream(tmp_path):
    """Memory does not grow with the length of a video, in either direction."""

    def peak(count):
        tracemalloc.start()
        video.write_video(tmp_path / "a.avi", clip(count), 30)
        assert sum(1 for _ in video.read_frames(tmp_path / "a.avi")) == count
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    peak(2)
    assert peak(20) < 1.5 * peak(5)


def cut(path):
    path.write_bytes(path.read_bytes()[: 4 * path.stat().st_size // 5])


def test_a_truncated_video_gives_its_frames_and_then_says_so(tmp_path):
    path, found = tmp_path / "a.avi", []
    video.write_video(path, clip(20), 30)
    cut(path)
    with pytest.raises(TruncatedVideoError, match=r"a.avi: ends after \d+ of 20 frames; copy") as caught:
        found.extend(video.read_frames(path))
    assert 0 < len(found) == caught.value.found < 20


def test_what_cannot_be_read_is_told(tmp_path):
    video.write_video(tmp_path / "cut.mp4", clip(20), 30)
    cut(tmp_path / "cut.mp4")
    (tmp_path / "empty.avi").touch()
    (tmp_path / "text.avi").write_text("no video")
    (tmp_path / "none").mkdir()
    for name, said in {
        "missing.avi": "is not there",
        "empty.avi": "is empty",
        "text.avi": "cannot be read as a video",
        "cut.mp4": "an mp4 file that was cut off cannot be read",
        "none": "has no images",
    }.items():
        for read in (video.stated_rate, lambda path: list(video.read_frames(path))):
            with pytest.raises(InputError, match=said):
                read(tmp_path / name)
    video.write_video(tmp_path / "frames", clip(3), 30)
    odd = tmp_path / "frames" / "frame_000001.png"
    video.opencv().imwrite(str(odd), SQUARE)
    with pytest.raises(InputError, match=r"frame_000001.png: is 4 x 4 px, needs 64 x 48 px"):
        list(video.read_frames(tmp_path / "frames"))
    odd.write_bytes(b"")
    with pytest.raises(InputError, match="cannot be read as an image"):
        list(video.read_frames(tmp_path / "frames"))
    with pytest.raises(InputError, match="colour: got 'rgb', needs grey or bgr"):
        next(video.read_frames(tmp_path, colour="rgb"))


def test_a_folder_without_a_rate_needs_one(tmp_path):
    video.write_video(tmp_path / "frames", clip(1), 60)
    assert video.open_frames(tmp_path / "frames").frame_rate == 60
    for values in ({}, {"frame_rate": None}, {"frame_rate": "x"}, {"frame_rate": 10**400}):
        write_json(tmp_path / "frames" / "video.json", values)
        with pytest.raises(DamagedError, match=r"video\.json: has the frame rate .*write the images again"):
            video.stated_rate(tmp_path / "frames")
        assert video.open_frames(tmp_path / "frames", 25).frame_rate == 25
    (tmp_path / "frames" / "video.json").unlink()
    assert video.stated_rate(tmp_path / "frames") is None
    with pytest.raises(InputError, match=r"frames: states no frame rate, needs one; give .*--frame-rate 30"):
        video.open_frames(tmp_path / "frames")
    assert video.open_frames(tmp_path / "frames", 25).frame_rate == 25
    for rate in (0.0, -30.0, float("nan"), float("inf"), 90000.0):
        for act in (
            partial(video.open_frames, tmp_path / "frames"),
            partial(video.write_video, tmp_path / "a.avi", clip()),
        ):
            with pytest.raises(InputError, match="frame_rate: got"):
                act(rate)


FRAMES = (
    ([], "frames: got none"),
    ([np.zeros((4, 4))], "frame 0: has shape .* and type float64"),
    ([SQUARE, np.zeros((4, 6), np.uint8)], "frame 1: has shape"),
    ([np.zeros((4, 4, 4), np.uint8)], "frame 0: has shape"),
)


@pytest.mark.parametrize(
    ("name", "frames", "codec", "said"),
    [
        *((name, frames, None, said) for name in ("a.avi", "frames") for frames, said in FRAMES),
        ("a.mkv", [SQUARE[:, :3]], None, "need an even width and height; write a folder of images"),
        ("a.mkv", [SQUARE[:3]], None, "need an even width and height; write a folder of images"),
        ("a.txt", [SQUARE], None, r"has the ending '.txt', needs one of .mp4, .avi, .mkv"),
        ("a.avi", [SQUARE], "h264x", "got the codec 'h264x'"),
        ("a.avi", [SQUARE], "ZZZZ", "cannot be written with the codec"),
        ("missing/a.avi", [SQUARE], None, "cannot be written"),
    ],
)
def test_what_cannot_be_written_is_told_and_nothing_is_left(tmp_path, name, frames, codec, said):
    kind = ResultError if said.startswith("cannot be written") else InputError
    with pytest.raises(kind, match=said):
        video.write_video(tmp_path / name, frames, 30, codec=codec)
    assert list(tmp_path.iterdir()) == []


def test_frames_in_memory_and_in_files_can_be_read_again_of_any_depth_and_channel(tmp_path):
    frames = video.open_frames(NOISE, 30.0)
    for _ in range(2):
        assert np.array_equal(list(frames.read()), NOISE)
    assert frames.frame_rate == 30.0
    assert np.array_equal(next(video.open_frames(NOISE.astype(np.uint16) * 256, 30.0).read()), NOISE[0])
    assert np.array_equal(next(video.open_frames(NOISE[..., None], 30.0).read()), NOISE[0])
    assert np.array_equal(list(video.open_frames(COLOUR, 30.0, "green").read()), NOISE // 2)
    grey = next(video.open_frames(COLOUR, 30.0).read()).astype(float)
    assert np.abs(grey - (0.114 * NOISE[0] + 0.587 * (NOISE[0] // 2) + 0.299 * (NOISE[0] // 4))).max() <= 1.0
    for name in ("clip.mkv", "images"):
        video.write_video(tmp_path / name, NOISE, 25.0)
        frames = video.open_frames(tmp_path / name)
        assert np.array_equal(list(frames.read()), NOISE)
        assert (frames.frame_rate, video.open_frames(tmp_path / name, 50.0).frame_rate) == (25.0, 50.0)
    video.write_video(tmp_path / "colour", COLOUR, 25.0)
    assert np.array_equal(next(video.open_frames(tmp_path / "colour", channel="red").read()), NOISE[0] // 4)


@pytest.mark.parametrize(
    ("source", "rate", "channel", "words"),
    [
        (NOISE, None, "grey", "video: states no frame rate, needs one; give frame_rate"),
        ([], 30.0, "grey", "has no frames"),
        (NOISE, 30.0, "pink", "channel: got 'pink', needs one of grey, blue, green, red"),
        ("none.mp4", None, "grey", "none.mp4"),
        (NOISE.astype(float), 30.0, "grey", "a frame has the type float64"),
    ],
)
def test_what_cannot_be_opened_is_told(source, rate, channel, words):
    with pytest.raises(InputError, match=words):
        next(video.open_frames(source, rate, channel).read())


def test_states_of_frames():
    frame = np.random.default_rng(0).integers(80, 160, (64, 96)).astype(np.uint8)
    rest, other, bright = video.rest_exposure(frame), frame.copy(), np.full((64, 96), 253, dtype=np.uint8)
    other[3, 5] += 1
    assert video.frame_state(frame, None, rest) == video.frame_state(frame, frame[::-1], rest) == video.FINE
    assert video.frame_state(other, frame, rest) == video.FINE, "one other pixel is another frame"
    assert video.frame_state(frame // 8, None, rest) == video.DARK
    assert video.frame_state(np.full_like(frame, 255), None, rest) == video.OVEREXPOSED
    assert video.frame_state(frame.copy(), frame, rest) == video.DUPLICATED
    assert video.frame_state(bright, None, video.rest_exposure(bright)) == video.FINE, "bright at rest"


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
    for time, frame in video.live_frames(Camera(40, 0.005)):
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
    video.write_video(tmp_path / "clip.mkv", frames, 20.0)
    capture = cv2.VideoCapture(str(tmp_path / "clip.mkv"))
    expected = [(number / 20.0, 10 * number) for number in range(12)]
    for source in (capture, ((number / 20.0, frame) for number, frame in enumerate(frames))):
        taken = []
        for time, frame in video.live_frames(source):
            clock.sleep(0.002)
            taken.append((time, int(frame[0, 0])))
        assert taken == expected


def test_what_gives_no_frames_is_refused():
    with pytest.raises(InputError, match="camera: cannot be opened, needs a camera that gives frames"):
        next(video.live_frames(Camera(0, 0.0)))
    with pytest.raises(InputError, match="camera: a frame has the type float64"):
        next(video.live_frames([(0.0, np.zeros((4, 6)))]))


def test_dropped_frames_are_counted():
    cases = [0, 1, 2, 5, 6], [0, 1, 2, 3], [0.0], [0, 1, 2, 3.4]
    assert [video.dropped_frames(times) for times in cases] == [2, 0, 0, 0]


def test_frames_in_memory_may_be_those_of_a_fast_camera():
    assert video.open_frames(NOISE, 25e3).frame_rate == 25e3
    for rate in (0.0, -30.0, np.nan, np.inf):
        with pytest.raises(InputError, match=r"frame_rate: got .*, needs a number of frames a second above 0$"):
            video.open_frames(NOISE, rate)
