"""Frames in: from video files, folders of images and arrays, one grey frame at a time."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError, ResultError
from fingerslip.vision.tracking.opencv import opencv

__all__ = ["Channel", "Frames", "VideoInput", "open_frames"]

Frame = NDArray[np.uint8]
Channel = Literal["grey", "blue", "green", "red"]
VideoInput = str | Path | NDArray[Any] | Sequence[NDArray[Any]]

_IMAGES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"}
_COLOURS = ("blue", "green", "red")  # as OpenCV orders them
# Files without a frame rate state 0, or the ticks of their clock.
_HIGHEST_RATE = 20_000.0


@dataclass(frozen=True)
class Frames:
    """Grey frames that can be read from the beginning as often as needed.

    Parameters
    ----------
    name : str
        What errors call them, such as the path of the file.
    frame_rate : float
        Frames a second [1/s].
    stated : int or None
        Number of frames that the source says it has; None where it does not say.
    read : callable
        Returns an iterator over the frames, each (height, width) of uint8.
    """

    name: str
    frame_rate: float
    stated: int | None
    read: Callable[[], Iterator[Frame]]


def open_frames(video: VideoInput, frame_rate: float | None = None, channel: Channel = "grey") -> Frames:
    """Open a video.

    Parameters
    ----------
    video : path, array or sequence of arrays
        A video file that OpenCV reads; a folder of images, taken in the order of the numbers in their names; or frames,
        (n, height, width) grey or (n, height, width, 3) in OpenCV's order blue, green, red, of uint8 or uint16.
    frame_rate : float, optional
        Frames a second [1/s], instead of what the file states; folders and arrays need it.
    channel : {'grey', 'blue', 'green', 'red'}
        What is taken of colour frames.

    Raises
    ------
    InputError
        Where there is no such file, or it cannot be read as video, or the frame rate is missing.
    """
    if channel not in get_args(Channel):
        raise InputError("channel", f"got {channel!r}", f"needs one of {', '.join(get_args(Channel))}")
    if frame_rate is not None and not (math.isfinite(frame_rate) and frame_rate > 0):
        raise InputError("frame_rate", f"got {frame_rate}", "needs frames a second > 0")
    if isinstance(video, str | Path):
        path = Path(video)
        return _folder(path, frame_rate, channel) if path.is_dir() else _file(path, frame_rate, channel)
    return _arrays(video, frame_rate, channel)


def _grey(frame: NDArray[Any], channel: Channel, name: str) -> Frame:
    """Return a frame as grey levels from 0 to 255."""
    if frame.dtype == np.uint16:
        frame = (frame >> 8).astype(np.uint8)
    if frame.dtype != np.uint8 or frame.ndim not in (2, 3):
        found = f"a frame has the type {frame.dtype} and shape {frame.shape}"
        raise InputError(name, found, "needs uint8 or uint16, (height, width) or (height, width, 3)")
    if frame.ndim == 3 and frame.shape[2] == 1:
        frame = frame[:, :, 0]
    if frame.ndim == 3:
        if channel != "grey":
            return np.ascontiguousarray(frame[:, :, _COLOURS.index(channel)])
        cv2 = opencv()
        code = cv2.COLOR_BGRA2GRAY if frame.shape[2] == 4 else cv2.COLOR_BGR2GRAY
        grey: Frame = cv2.cvtColor(np.ascontiguousarray(frame), code)
        return grey
    return np.ascontiguousarray(frame)


def _needed_rate(name: str, stated: float | None, given: float | None) -> float:
    if given is not None:
        return given
    if stated is None or not (math.isfinite(stated) and 0 < stated < _HIGHEST_RATE):
        found = "states no frame rate" if stated is None or not stated > 0 else f"states {stated:.6g} frames a second"
        raise InputError(name, found, "tracks need the time of each frame", "give frame_rate (--frame-rate)")
    return stated


def _capture(path: Path) -> Any:  # noqa: ANN401  cv2 has no types
    cv2 = opencv()
    before = cv2.getLogLevel()
    cv2.setLogLevel(0)  # what is wrong with a file is said by the error
    try:
        capture = cv2.VideoCapture(str(path))
    finally:
        cv2.setLogLevel(before)
    return capture


def _file(path: Path, frame_rate: float | None, channel: Channel) -> Frames:
    if not path.is_file():
        raise InputError(str(path), "there is no such file", "needs a video file or a folder of images")
    cv2 = opencv()
    capture = _capture(path)
    opened, first = capture.isOpened(), capture.read()[0]
    rate, count = capture.get(cv2.CAP_PROP_FPS), capture.get(cv2.CAP_PROP_FRAME_COUNT)
    capture.release()
    if not (opened and first):
        found = "is empty" if path.stat().st_size == 0 else "cannot be read as a video"
        raise InputError(
            str(path), found, "needs a whole file in a format that OpenCV reads", "copy it again, or convert it"
        )
    stated = int(count) if 0 < count < 1e9 else None
    return Frames(
        str(path), _needed_rate(str(path), rate, frame_rate), stated, lambda: _decoded(path, channel)
    )


def _decoded(path: Path, channel: Channel) -> Iterator[Frame]:
    capture = _capture(path)
    try:
        while True:
            there, frame = capture.read()
            if not there:
                return
            yield _grey(frame, channel, str(path))
    finally:
        capture.release()


def _folder(folder: Path, frame_rate: float | None, channel: Channel) -> Frames:
    paths = sorted((path for path in folder.iterdir() if path.suffix.lower() in _IMAGES), key=_numbered)
    if not paths:
        raise InputError(str(folder), "has no images", f"needs files that end in {', '.join(sorted(_IMAGES))}")
    rate = _needed_rate(str(folder), None, frame_rate)
    return Frames(str(folder), rate, len(paths), lambda: _images(paths, channel))


def _numbered(path: Path) -> tuple[list[int], str]:
    return [int(digits) for digits in re.findall(r"\d+", path.stem)], path.name


def _images(paths: Sequence[Path], channel: Channel) -> Iterator[Frame]:
    cv2 = opencv()
    shape = None
    for path in paths:
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        if image is None:
            raise ResultError(f"{path}: cannot be read as an image; copy it again or remove it")
        frame = _grey(image, channel, str(path))
        if shape not in (None, frame.shape):
            raise InputError(str(path), f"has the size {frame.shape[::-1]}", f"the images before have {shape[::-1]}")
        shape = frame.shape
        yield frame


def _arrays(video: NDArray[Any] | Sequence[NDArray[Any]], frame_rate: float | None, channel: Channel) -> Frames:
    if len(video) == 0:
        raise InputError("video", "has no frames", "needs at least one")
    rate = _needed_rate("video", None, frame_rate)
    return Frames("video", rate, len(video), lambda: (_grey(np.asarray(one), channel, "video") for one in video))
