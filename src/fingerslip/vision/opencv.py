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
        repair = 'pip install "fingerslip[vision]"'
        raise InputError("vision", f"OpenCV is missing ({error})", "images and videos need it", repair) from error
    return cv2
