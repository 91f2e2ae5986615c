"""Videos in and out: files that OpenCV reads, and folders of images. Frames stream, so memory does not grow."""

from __future__ import annotations

import contextlib
import itertools
import os
import queue
import re
import sys
import threading
import time as clock
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import DamagedError, InputError, ResultError, TruncatedVideoError, optional_module, shorten
from fingerslip.storage.files import check_replaceable, new_file, new_folder, read_json, write_json


def opencv() -> ModuleType:
    """Return the module ``cv2``; raise InputError where OpenCV is not installed.

    It says nothing on standard error unless ``OPENCV_FFMPEG_LOGLEVEL`` or ``OPENCV_LOG_LEVEL`` is set: what cannot be
    read is an error of ours, with the file and what to do.
    """
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # FFmpeg's level "quiet", read at the first video
    os.environ.setdefault("OPENCV_LOG_LEVEL", "ERROR")  # at the import
    cv2: ModuleType = optional_module("cv2", "vision", "vision", "images and videos need OpenCV")
    return cv2


Frame = NDArray[np.uint8]

#: Codec of each ending of a file. Those of ``mp4`` and ``avi`` lose detail, that of ``mkv`` keeps every grey level.
CODECS = {".mp4": "mp4v", ".avi": "MJPG", ".mkv": "FFV1"}
_IMAGES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"}
_RATE_FILE = "video.json"
_FASTEST = 1e4  # frames a second; files without a rate state their time base instead
# Containers without an index estimate their length: so much may be missing from a whole file.
_MISSING_FRAMES, _MISSING_SHARE = 2, 0.01


def stated_rate(path: Path) -> float | None:
    """Return the frames a second [1/s] that a video file or a folder of images states; None where it does not."""
    if not path.is_dir():
        with _open_reader(path) as (cv2, capture):
            rate: float = capture.get(cv2.CAP_PROP_FPS)
        return rate if 0 < rate <= _FASTEST else None
    _images(path)  # there have to be some
    if not (path / _RATE_FILE).is_file():
        return None
    repair = "write the images again, or give frame_rate (--frame-rate)"
    content = read_json(path / _RATE_FILE, repair).get("frame_rate")
    try:
        return _check_rate(float(str(content)))
    except (ValueError, OverflowError) as error:
        raise DamagedError(str(path / _RATE_FILE), f"has the frame rate {shorten(repr(content))}", repair) from error


def _check_rate(rate: float | None, name: str = "", fastest: float = _FASTEST) -> float:
    """Return the frames a second [1/s] of the video of a name; refuse what is none."""
    if rate is None:
        raise InputError(name, "states no frame rate", "needs one", "give frame_rate, as in --frame-rate 30")
    if not 0 < rate <= fastest:
        limit = f", up to {fastest:g}" * (fastest == _FASTEST)
        raise InputError("frame_rate", f"got {rate}", f"needs a number of frames a second above 0{limit}")
    return float(rate)


def read_frames(path: str | Path, colour: str = "grey") -> Iterator[Frame]:
    """Yield the frames of a video file, or of a folder of images by the numbers in their names.

    They are (height, width), or (height, width, 3) with blue first where `colour` is ``bgr``, of uint8. Where the video
    says that it has more than it gives, TruncatedVideoError comes behind the last.
    """
    if colour not in ("grey", "bgr"):
        raise InputError("colour", f"got {colour!r}", "needs grey or bgr")
    path = Path(path)
    if path.is_dir():
        yield from _folder_frames(path, colour)
        return
    with _open_reader(path) as (cv2, capture):
        conversions = {(2, "bgr"): cv2.COLOR_GRAY2BGR, (3, "grey"): cv2.COLOR_BGR2GRAY}
        stated, number = capture.get(cv2.CAP_PROP_FRAME_COUNT), 0
        while (row := capture.read())[0]:
            code = conversions.get((row[1].ndim, colour))
            yield row[1] if code is None else cv2.cvtColor(row[1], code)
            number += 1
    if number == 0:
        raise InputError(str(path), "has no frame that can be decoded", "needs a video with frames", "record it again")
    if stated - number > max(_MISSING_FRAMES, _MISSING_SHARE * stated):
        raise TruncatedVideoError(str(path), number, round(stated))


@contextlib.contextmanager
def _open_reader(path: Path) -> Iterator[tuple[ModuleType, Any]]:
    """Give OpenCV and its reader of a video file."""
    if not path.is_file():
        raise InputError(str(path), "is not there", "needs a video file or a folder of images")
    if path.stat().st_size == 0:
        raise InputError(str(path), "is empty", "needs a video", "record it again")
    cv2 = opencv()
    capture = cv2.VideoCapture(str(path))
    try:
        if not capture.isOpened():
            raise InputError(
                str(path),
                "cannot be read as a video",
                "needs a whole file in a format that OpenCV knows",
                "convert it, as with 'ffmpeg -i IN OUT.avi'; an mp4 file that was cut off cannot be read at all",
            )
        yield cv2, capture
    finally:
        capture.release()


def _images(folder: Path) -> list[Path]:
    """Return the images of a folder by the numbers in their names: frame_2 stands before frame_10."""
    images = [path for path in folder.iterdir() if path.suffix.lower() in _IMAGES]
    if not images:
        raise InputError(str(folder), "has no images", f"needs files that end in {', '.join(sorted(_IMAGES))}")
    return sorted(images, key=lambda path: [int(s) if s.isdigit() else s for s in re.split(r"(\d+)", path.name)])


def _folder_frames(folder: Path, colour: str) -> Iterator[Frame]:
    cv2, first = opencv(), None
    for path in _images(folder):
        frame: Frame | None = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE if colour == "grey" else cv2.IMREAD_COLOR)
        if frame is None:
            raise InputError(str(path), "cannot be read as an image", "needs a whole image file", "record it again")
        first = first or frame.shape
        if frame.shape != first:
            fault = f"is {frame.shape[1]} x {frame.shape[0]} px"
            raise InputError(str(path), fault, f"needs {first[1]} x {first[0]} px, as the first image has")
        yield frame


def write_video(
    path: str | Path, frames: Iterable[NDArray[Any]], frame_rate: float, *, codec: str | None = None
) -> int:
    """Write frames as a video as they come, whole or not at all, and return their number.

    The path ends in ``.mp4``, ``.avi`` or ``.mkv``, or is a folder, which gets PNG images and the frame rate [1/s] in
    ``video.json``; a folder that holds something else is refused. Frames are (height, width), or (height, width, 3)
    with blue first, of uint8. The codec has four letters of OpenCV; without it, it is that of :data:`CODECS`.
    """
    path, checked, rate = Path(path), _check_frames(frames), _check_rate(frame_rate)
    if not path.suffix:
        check_replaceable(path, _RATE_FILE)
        cv2, written = opencv(), 0
        with new_folder(path) as partial:
            for written, frame in enumerate(checked, start=1):
                content = cv2.imencode(".png", frame)[1]
                (partial / f"frame_{written - 1:06d}.png").write_bytes(content.tobytes())
            write_json(partial / _RATE_FILE, {"frame_rate": rate})
        return written
    chosen = codec or CODECS.get(path.suffix.lower())
    if chosen is None or len(chosen) != 4:
        fault = f"has the ending {path.suffix!r}" if codec is None else f"got the codec {codec!r}"
        raise InputError(str(path), fault, f"needs one of {', '.join(CODECS)}, or a folder, or a codec of four letters")
    return _write_file(path, checked, rate, chosen)


def _check_frames(frames: Iterable[NDArray[Any]]) -> Iterator[Frame]:
    """Yield frames that are like the first one."""
    shape = None
    for number, frame in enumerate(frames):
        like = frame.dtype == np.uint8 and (frame.ndim == 2 or frame.shape[2:] == (3,)) and frame.size
        shape = shape or frame.shape
        if not like or frame.shape != shape:
            fault = f"has shape {frame.shape} and type {frame.dtype}"
            raise InputError(f"frame {number}", fault, f"needs uint8 and the shape of the first, {shape}")
        yield frame
    if shape is None:
        raise InputError("frames", "got none", "needs at least one")


def _write_file(path: Path, frames: Iterator[Frame], rate: float, codec: str) -> int:
    cv2, written, first = opencv(), 0, next(frames)
    height, width = first.shape[:2]
    if height % 2 or width % 2:
        # OpenCV leaves a row or a column out without a word.
        fault = f"gets frames of {width} x {height} px"
        raise InputError(str(path), fault, "video files need an even width and height", "write a folder of images")
    with new_file(path) as partial:
        size, code = (width, height), cv2.VideoWriter_fourcc(*codec)
        writer = cv2.VideoWriter(str(partial), code, rate, size, isColor=first.ndim == 3)
        try:
            if not writer.isOpened():
                others = " or ".join(CODECS.values())
                fault = f"{path}: cannot be written with the codec {codec}"
                raise ResultError(f"{fault}; give write access, or another codec such as {others}")
            for frame in itertools.chain([first], frames):
                writer.write(frame)
                written += 1
        finally:
            writer.release()
        count = 0
        # OpenCV says nothing when the disk is full.
        with contextlib.suppress(InputError), _open_reader(partial) as (_, capture):
            count = round(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        if written - count > max(_MISSING_FRAMES, _MISSING_SHARE * written):
            raise ResultError(f"{path}: holds {count} of {written} frames; free some space or choose another folder")
    return written


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
    """Open a video, a folder of images, or frames in memory, with the frames a second [1/s] given or stated."""
    if channel not in get_args(Channel):
        raise InputError("channel", f"got {channel!r}", f"needs one of {', '.join(get_args(Channel))}")
    if isinstance(video, str | Path):
        name, colour = str(video), "grey" if channel == "grey" else "bgr"
        rate = _check_rate(stated_rate(Path(video)) if frame_rate is None else frame_rate, name)
        return Frames(name, rate, lambda: (grey_frame(frame, channel, name) for frame in read_frames(video, colour)))
    if len(video) == 0:
        raise InputError("video", "has no frames", "needs at least one")
    rate = _check_rate(frame_rate, "video", sys.float_info.max)
    return Frames("video", rate, lambda: (grey_frame(np.asarray(frame), channel, "video") for frame in video))


def frames_text(count: int, frames: Frames, given: float | None) -> str:
    """Say how many frames a video has, how many a second, and whether that rate is the file's."""
    origin = "the file's" if given is None else "--frame-rate"
    return f"{count} frames at {frames.frame_rate:g} a second ({origin})"


def grey_frame(frame: NDArray[Any], channel: Channel, name: str) -> Frame:
    """Return a frame as grey levels from 0 to 255."""
    frame = np.asarray(frame)
    if frame.dtype == np.uint16:
        frame = (frame >> 8).astype(np.uint8)
    if frame.dtype != np.uint8 or frame.ndim not in (2, 3) or (frame.ndim == 3 and frame.shape[2] not in (1, 3, 4)):
        fault = f"a frame has the type {frame.dtype} and shape {frame.shape}"
        allowed = "needs uint8 or uint16, (height, width) or (height, width, 3)"
        raise InputError(name, fault, allowed, "give grey levels from 0 to 255 as np.uint8")
    if frame.ndim == 3 and frame.shape[2] == 1:
        frame = frame[:, :, 0]
    elif frame.ndim == 3 and channel == "grey":
        cv2 = opencv()
        frame = cv2.cvtColor(np.ascontiguousarray(frame[:, :, :3]), cv2.COLOR_BGR2GRAY)
    elif frame.ndim == 3:
        frame = frame[:, :, _COLOURS.index(channel)]
    return np.ascontiguousarray(frame)


FINE, DARK, OVEREXPOSED, DUPLICATED = range(4)
#: States of a frame by their number.
STATES = ("fine", "dark", "overexposed", "duplicated")

_FEW = (slice(None, None, 8),) * 2  # a frame is judged by every eighth pixel of every eighth row
_SATURATED = 250
_DARK_SHARE = 0.25
_DARKEST = 4.0  # grey levels
_SATURATED_MORE = 0.4


@dataclass(frozen=True)
class Exposure:
    """How bright the rest frames are."""

    mean: float  # mean grey level
    saturated: float  # share of pixels that are saturated


def rest_exposure(frame: Frame) -> Exposure:
    """Return how bright a frame is."""
    few = frame[_FEW]
    return Exposure(float(few.mean()), float((few >= _SATURATED).mean()))


def frame_state(frame: Frame, before: Frame | None, rest: Exposure) -> int:
    """Return the state of a frame: `FINE`, `DARK`, `OVEREXPOSED` or `DUPLICATED`.

    Dark is below a quarter of the mean level at rest, overexposed where two fifths more of the pixels are saturated
    than at rest, duplicated where no pixel differs from the frame before.
    """
    now = rest_exposure(frame)
    if now.mean < max(_DARK_SHARE * rest.mean, _DARKEST):
        return DARK
    if now.saturated > rest.saturated + _SATURATED_MORE:
        return OVEREXPOSED
    # A few pixels settle it nearly always.
    if before is not None and np.array_equal(frame[_FEW], before[_FEW]) and np.array_equal(frame, before):
        return DUPLICATED
    return FINE


#: A camera's index or address, an open ``cv2.VideoCapture``, or what yields times [s] and frames.
Source = int | str | Any | Iterable[tuple[float, NDArray[Any]]]

# A gap between frames longer than so many times the usual one hides a frame that was dropped.
_GAP = 1.5
_PATIENCE = 0.05  # s, after which a camera is asked whether it still runs


def live_frames(source: Source, channel: Channel = "grey") -> Iterator[tuple[float, Frame]]:
    """Yield time [s] and grey frame (height, width) of each frame of a source, once and as they come.

    A camera is read in a thread of its own, and only its newest frame is kept: who is too slow drops frames, and does
    not fall behind. Times are then those at which frames came, from the first one on. Of a reader of a file no frame is
    dropped, and times are the file's own.

    Parameters
    ----------
    source : int, str, cv2.VideoCapture or iterable of (float, array)
        Index or address of a camera, a reader that is open, or times [s] and frames, grey or with blue first.
    channel : {'grey', 'blue', 'green', 'red'}, optional
        What is taken of colour frames.

    Returns
    -------
    iterator of (float, array)
        Times and frames.

    Examples
    --------
    >>> import numpy as np
    >>> import fingerslip as fs
    >>> frames = ((0.1 * number, np.zeros((4, 6, 3), dtype=np.uint8)) for number in range(2))
    >>> [(time, frame.shape) for time, frame in fs.live_frames(frames)]
    [(0.0, (4, 6)), (0.1, (4, 6))]
    """
    name = str(source) if isinstance(source, int | str) else "camera"
    is_camera = isinstance(source, int | str) or hasattr(source, "read")
    rows: Any = _camera_frames(source, name) if is_camera else source
    for time, frame in rows:
        yield float(time), grey_frame(frame, channel, name)


def _camera_frames(source: Any, name: str) -> Iterator[tuple[float, NDArray[Any]]]:
    cv2 = opencv()
    capture = source if hasattr(source, "read") else cv2.VideoCapture(source)
    try:
        if not capture.isOpened():
            repair = "look whether it is plugged in, free, and has this index or address"
            raise InputError(name, "cannot be opened", "needs a camera that gives frames", repair)
        if capture.get(cv2.CAP_PROP_FRAME_COUNT) > 0:
            rate, number = capture.get(cv2.CAP_PROP_FPS) or 30.0, itertools.count()
            while (row := capture.read())[0]:
                yield next(number) / rate, row[1]
        else:
            yield from _newest(capture)
    finally:
        if capture is not source:
            capture.release()


def _newest(capture: Any) -> Iterator[tuple[float, NDArray[Any]]]:
    """Yield when each frame came since the first [s], and the frame, of those only the newest that waits."""
    waiting: queue.Queue[tuple[float, NDArray[Any]]] = queue.Queue(maxsize=1)
    stopped = threading.Event()

    def fill() -> None:
        while not stopped.is_set() and (row := capture.read())[0]:
            # A frame that still waits gives way.
            with contextlib.suppress(queue.Empty):
                waiting.get_nowait()
            waiting.put((clock.perf_counter(), row[1]))

    thread = threading.Thread(target=fill, daemon=True)
    thread.start()
    start = None
    try:
        while thread.is_alive() or not waiting.empty():
            try:
                came, frame = waiting.get(timeout=_PATIENCE)
            except queue.Empty:
                continue
            start = came if start is None else start
            yield came - start, frame
    finally:
        stopped.set()
        thread.join(timeout=1.0)


def dropped_frames(times: Sequence[float]) -> int:
    """Return how many frames are missing between times [s], by gaps longer than the usual one."""
    gaps = np.diff(np.asarray(times, dtype=np.float64))
    if gaps.size < 2:
        return 0
    usual = float(np.median(gaps))
    return int(np.rint(gaps[gaps > _GAP * usual] / usual - 1.0).sum())
