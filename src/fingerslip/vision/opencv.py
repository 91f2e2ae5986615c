"""OpenCV, loaded when it is first needed: it is an optional dependency."""

from __future__ import annotations

import os
from types import ModuleType

from fingerslip.errors import InputError

__all__ = ["opencv"]


def opencv() -> ModuleType:
    """Return the module ``cv2``.

    Its video reader says nothing on standard error unless ``OPENCV_FFMPEG_LOGLEVEL`` is set: what cannot be read is an
    error of ours, with the file and what to do.

    Raises
    ------
    InputError
        Where OpenCV is not installed.
    """
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # FFmpeg's level "quiet", read at the first video
    try:
        import cv2
    except ImportError as error:
        repair = 'pip install "fingerslip[vision]"'
        raise InputError("vision", f"OpenCV is missing ({error})", "images and videos need it", repair) from error
    return cv2
