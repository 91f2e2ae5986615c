"""Grey frames of whatever holds them: video files, folders of images and arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.opencv import opencv
from fingerslip.vision.video import frame_rate_of, read_frames, video_info

__all__ = ["Channel", "Frames", "VideoInput", "open_frames"]

Frame = NDArray[np.uint8]
Channel = Literal["grey", "blue", "green", "red"]
VideoInput = str | Path | NDArray[Any] | Sequence[NDArray[Any]]

_COLOURS = ("blue", "green", "red")  # as OpenCV orders them


@dataclass(frozen=True)
class Frames:
    """Grey frames that can be read from the beginning as often as needed."""

    name: str  # what errors call them, such as the path of the file
    frame_rate: float  # frames a second [1/s]
    read: Callable[[], Iterator[Frame]]  # returns an iterator over the frames, each (height, width) of uint8


def open_frames(video: VideoInput, frame_rate: float | None = None, channel: Channel = "grey") -> Frames:
    """Open a video.

    Units: frame_rate [1/s].
    """
    if channel not in get_args(Channel):
        raise InputError("channel", f"got {channel!r}", f"needs one of {', '.join(get_args(Channel))}")
    if isinstance(video, str | Path):
        info = video_info(video)
        colour = "grey" if channel == "grey" else "bgr"
        rate = frame_rate_of(info, frame_rate)
        return Frames(
            str(video), rate, lambda: (_grey(one, channel, str(video)) for one in read_frames(video, colour=colour))
        )
    return _arrays(video, frame_rate, channel)


def _arrays(video: NDArray[Any] | Sequence[NDArray[Any]], frame_rate: float | None, channel: Channel) -> Frames:
    if len(video) == 0:
        raise InputError("video", "has no frames", "needs at least one")
    if frame_rate is None or not (math.isfinite(frame_rate) and frame_rate > 0):
        found = "states no frame rate" if frame_rate is None else f"got the frame rate {frame_rate}"
        raise InputError("video", found, "needs frames a second > 0", "give frame_rate")
    return Frames("video", frame_rate, lambda: (_grey(np.asarray(one), channel, "video") for one in video))


def _grey(frame: NDArray[Any], channel: Channel, name: str) -> Frame:
    """Return a frame as grey levels from 0 to 255."""
    if frame.dtype == np.uint16:
        frame = (frame >> 8).astype(np.uint8)
    if frame.dtype != np.uint8 or frame.ndim not in (2, 3) or (frame.ndim == 3 and frame.shape[2] not in (1, 3, 4)):
        found = f"a frame has the type {frame.dtype} and shape {frame.shape}"
        raise InputError(name, found, "needs uint8 or uint16, (height, width) or (height, width, 3)")
    if frame.ndim == 2:
        return np.ascontiguousarray(frame)
    if frame.shape[2] == 1:
        return np.ascontiguousarray(frame[:, :, 0])
    if channel != "grey":
        return np.ascontiguousarray(frame[:, :, _COLOURS.index(channel)])
    cv2 = opencv()
    grey: Frame = cv2.cvtColor(np.ascontiguousarray(frame[:, :, :3]), cv2.COLOR_BGR2GRAY)
    return grey
