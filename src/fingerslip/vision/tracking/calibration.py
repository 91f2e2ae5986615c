"""Calibration of a camera, in OpenCV's form: positions as a camera without distortion would have them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.tracking.opencv import opencv

__all__ = ["Calibration", "read_calibration", "undistorted"]

Floats = NDArray[np.float64]

_MATRIX = ("camera_matrix", "cameraMatrix", "K")
_DISTORTION = ("distortion_coefficients", "dist_coeffs", "distCoeffs", "D")
_FISHEYE = 4  # coefficients
_LENGTHS = (4, 5, 8, 12, 14)


@dataclass(frozen=True)
class Calibration:
    """Intrinsics of a camera.

    Parameters
    ----------
    matrix : (3, 3) array
        Camera matrix [px].
    distortion : (k,) array
        OpenCV's coefficients: k1, k2, p1, p2, ... of a pinhole, k1 to k4 of a fisheye lens.
    fisheye : bool
        Whether they are those of OpenCV's fisheye model.
    """

    matrix: Floats
    distortion: Floats
    fisheye: bool = False


def read_calibration(path: str | Path) -> Calibration:
    """Read the calibration of a camera from a file of OpenCV's ``FileStorage`` (YAML, XML or JSON).

    Parameters
    ----------
    path : path
        A file with ``camera_matrix`` and ``distortion_coefficients``, as OpenCV's calibration samples write it, or
        ``K`` and ``D``. The lens is a fisheye where the file says ``fisheye_model: 1`` or ``distortion_model: fisheye``.

    Raises
    ------
    InputError
        Where the file is missing or has no calibration.
    """
    if not Path(path).is_file():
        raise InputError(str(path), "there is no such file", "needs a calibration in OpenCV's form")
    cv2 = opencv()
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    except cv2.error as error:
        raise InputError(str(path), "is no file of OpenCV's FileStorage", "needs YAML, XML or JSON") from error
    matrix, distortion = _first(storage, _MATRIX), _first(storage, _DISTORTION)
    fisheye = _is_fisheye(storage)
    storage.release()
    if matrix is None or matrix.shape != (3, 3):
        raise InputError(str(path), "has no camera matrix", f"needs a 3 x 3 matrix {' or '.join(_MATRIX)}")
    if distortion is None or distortion.size not in ((_FISHEYE,) if fisheye else _LENGTHS):
        raise InputError(str(path), "has no distortion coefficients", f"needs {' or '.join(_DISTORTION)}")
    return Calibration(matrix.astype(np.float64), distortion.ravel().astype(np.float64), fisheye)


def _first(storage: Any, names: tuple[str, ...]) -> NDArray[Any] | None:  # noqa: ANN401  cv2 has no types
    nodes = (storage.getNode(name) for name in names)
    return next((node.mat() for node in nodes if not node.empty() and node.mat() is not None), None)


def _is_fisheye(storage: Any) -> bool:  # noqa: ANN401
    model, flag = storage.getNode("distortion_model"), storage.getNode("fisheye_model")
    named = model.isString() and model.string() in {"fisheye", "equidistant"}
    return bool(named or (flag.isInt() and flag.real() == 1))


def undistorted(calibration: Calibration, position: Floats) -> Floats:
    """Return positions as a camera with the same matrix and no distortion has them; NaN stays NaN.

    Parameters
    ----------
    calibration : Calibration
        The intrinsics.
    position : (..., 2) array
        Positions [px].
    """
    cv2 = opencv()
    undistort = cv2.fisheye.undistortPoints if calibration.fisheye else cv2.undistortPoints
    known = np.isfinite(position).all(axis=-1)
    out = np.full_like(position, np.nan)
    if known.any():
        points = np.ascontiguousarray(position[known]).reshape(-1, 1, 2)
        out[known] = undistort(points, calibration.matrix, calibration.distortion, P=calibration.matrix).reshape(-1, 2)
    return out
