"""Frames as they come, with their times: cameras, addresses, readers of OpenCV, and whatever yields both."""

from __future__ import annotations

import contextlib
import itertools
import queue
import threading
import time as clock
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.video import Channel, Frame, grey_frame, opencv

#: A camera's index or address, an open ``cv2.VideoCapture``, or what yields times [s] and frames.
Source = int | str | Any | Iterable[tuple[float, NDArray[Any]]]

# A gap between frames longer than so many times the usual one hides a frame that was dropped.
_GAP = 1.5


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

    Raises
    ------
    InputError
        Where the camera cannot be opened, or a frame is none.

    Examples
    --------
    >>> import numpy as np
    >>> frames = ((0.1 * number, np.zeros((4, 6, 3), dtype=np.uint8)) for number in range(2))
    >>> [(time, frame.shape) for time, frame in live_frames(frames)]
    [(0.0, (4, 6)), (0.1, (4, 6))]
    """
    name = str(source) if isinstance(source, int | str) else "camera"
    rows: Any = source
    if isinstance(source, int | str) or hasattr(source, "read"):
        rows = _camera_frames(source, name)
    for time, frame in rows:
        yield float(time), grey_frame(np.asarray(frame), channel, name)


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
    waiting: queue.Queue[tuple[float, NDArray[Any] | None]] = queue.Queue(maxsize=1)
    stopped = threading.Event()

    def fill() -> None:
        is_there = True
        while is_there and not stopped.is_set():
            is_there, frame = capture.read()
            row = clock.perf_counter(), frame if is_there else None
            while True:
                try:
                    waiting.put_nowait(row)
                    break
                except queue.Full:
                    # The end may not take the place of the last frame.
                    if not is_there and not stopped.is_set():
                        clock.sleep(1e-3)
                        continue
                    with contextlib.suppress(queue.Empty):
                        waiting.get_nowait()

    thread = threading.Thread(target=fill, daemon=True)
    thread.start()
    start = None
    try:
        while True:
            came, frame = waiting.get()
            if frame is None:
                return
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
