"""OpenCV, loaded when it is first needed: it is an optional dependency."""

from __future__ import annotations

from types import ModuleType

from fingerslip.errors import InputError

__all__ = ["opencv"]


def opencv() -> ModuleType:
    """Return the module ``cv2``.

    Raises
    ------
    InputError
        Where OpenCV is not installed.
    """
    try:
        import cv2
    except ImportError as error:
        raise InputError(
            "tracking", f"OpenCV is missing ({error})", "videos need it", 'pip install "fingerslip[vision]"'
        ) from error
    return cv2
