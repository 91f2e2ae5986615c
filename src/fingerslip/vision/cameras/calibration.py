"""Calibration files in OpenCV's form: YAML or JSON with ``camera_matrix`` and ``distortion_coefficients``.

Read are the files that OpenCV's FileStorage writes, those of ROS (which name the model and the size of the image), and
plain nested lists under the names that calibration scripts use.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError, ResultError, shorten
from fingerslip.parameters.yaml_text import parse_document
from fingerslip.storage.files import write_text
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole

__all__ = ["MODELS", "read_calibration", "write_calibration"]

Floats = NDArray[np.float64]

#: Names of lens models in files, and the model of each.
MODELS: Mapping[str, type[Pinhole] | type[Fisheye]] = MappingProxyType(
    {
        "pinhole": Pinhole,
        "plumb_bob": Pinhole,
        "rational_polynomial": Pinhole,
        "fisheye": Fisheye,
        "equidistant": Fisheye,
    }
)
_MATRIX = ("camera_matrix", "K", "mtx")
_DISTORTION = ("distortion_coefficients", "dist_coeffs", "dist_coeff", "dist", "D")
_LARGEST = 1_000_000  # bytes


def read_calibration(path: str | Path, *, model: str | None = None, size: tuple[int, int] | None = None) -> Any:
    """Read the intrinsics of a camera.

    Parameters
    ----------
    path : path
        The file.
    model : str, optional
        One of :data:`MODELS`, such as ``fisheye``. Without it the file says, by ``distortion_model`` or OpenCV's
        ``fisheye_model: 1``; where it does not, the camera is a pinhole.
    size : (int, int), optional
        Width and height of the image [px], where the file does not say.

    Returns
    -------
    Pinhole or Fisheye
        The intrinsics.

    Raises
    ------
    ResultError
        Where the file cannot be read.
    InputError
        Where it is no calibration.
    """
    values, where = _read_values(Path(path)), str(path)
    matrix = _array(values, _MATRIX, where)
    if matrix is None or matrix.shape != (3, 3):
        fault = f"the keys {', '.join(values)}" if matrix is None else f"a camera matrix of shape {matrix.shape}"
        raise InputError(where, shorten(f"has {fault}"), "needs camera_matrix with 3 x 3 numbers")
    if matrix[0, 1] != 0 or not np.array_equal(matrix[[1, 2, 2, 2], [0, 0, 1, 2]], [0, 0, 0, 1]):
        raise InputError(f"{where}: camera_matrix", "has a skew or another scale", "needs fx 0 cx, 0 fy cy, 0 0 1")
    width, height = size or (values.get("image_width"), values.get("image_height"))
    if width is None or height is None:
        width, height = values.get("image_size", (None, None))
    if width is None or height is None:
        raise InputError(where, "has no image_width and image_height", "needs the size of the image", "give size=")
    name = model or values.get("distortion_model") or ("fisheye" if values.get("fisheye_model") else "pinhole")
    if name not in MODELS:
        allowed = f"needs one of {', '.join(MODELS)}"
        raise InputError(f"{where}: distortion_model", f"got {shorten(repr(name))}", allowed)
    coefficients = _coefficients(_array(values, _DISTORTION, where), 4 if MODELS[name] is Fisheye else 0)
    focal_x, focal_y, centre_x, centre_y = matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    try:
        return MODELS[name](int(width), int(height), focal_x, focal_y, centre_x, centre_y, coefficients)
    except InputError as error:
        raise error.moved(lambda place: f"{where}: {place}") from None


def _read_values(path: Path) -> Mapping[str, Any]:
    """Return the keys and values of a file in JSON or YAML, also where OpenCV's tags and first line are in it."""
    try:
        content = path.read_bytes()[: _LARGEST + 1]
        text = content.decode("utf-8")
    except OSError as error:
        raise ResultError(f"{path}: cannot be read ({error.strerror}); name a calibration file") from error
    except UnicodeDecodeError as error:
        raise InputError(str(path), "is no text", "needs a calibration file in YAML or JSON") from error
    if len(content) > _LARGEST:
        raise InputError(str(path), "is larger than 1 MB", "needs a calibration file in YAML or JSON")
    text = re.sub(r"\A\s*%YAML[: ]1\.\d\s*\n", "", text).replace("!!opencv-matrix", "")
    try:
        # The tabs of JSON are no YAML.
        values = json.loads(text) if text.lstrip().startswith("{") else parse_document(text, str(path)).content
    except json.JSONDecodeError as error:
        raise InputError(str(path), f"is no JSON ({shorten(str(error))})", "needs a calibration file") from None
    if not isinstance(values, Mapping):
        raise InputError(str(path), "has no keys", "needs camera_matrix and distortion_coefficients")
    return values


def _array(values: Mapping[str, Any], names: Sequence[str], where: str) -> Floats | None:
    """Return the matrix under the first name that is there; None where there is none."""
    name = next((name for name in names if name in values), None)
    if name is None:
        return None
    content = values[name]
    try:
        if isinstance(content, Mapping):
            return np.array(content["data"], dtype=np.float64).reshape(content["rows"], content["cols"])
        array = np.array(content, dtype=np.float64)
    except (KeyError, TypeError, ValueError):
        allowed = "needs rows, cols and data, or lists of numbers"
        raise InputError(f"{where}: {name}", f"got {shorten(repr(content))}", allowed) from None
    return array.reshape(3, 3) if name in _MATRIX and array.size == 9 else array


def _coefficients(distortion: Floats | None, fewest: int) -> tuple[float, ...]:
    """Return coefficients without zeros at the end, as many as some lens has; none where there are none."""
    if distortion is None or not distortion.any():
        return ()
    last = max(int(np.flatnonzero(distortion)[-1]) + 1, fewest)
    count = next((count for count in (0, 4, 5, 8, 12) if count >= last), last)
    return (*distortion.ravel().tolist(), *[0.0] * count)[:count]


def write_calibration(intrinsics: Pinhole | Fisheye, path: str | Path) -> None:
    """Write intrinsics in the form that OpenCV's FileStorage reads, whole or not at all.

    Parameters
    ----------
    intrinsics : Pinhole or Fisheye
        The intrinsics.
    path : path
        A file that ends in ``.json``, or any other for YAML.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    is_fisheye = isinstance(intrinsics, Fisheye)
    plain = {
        "image_width": intrinsics.width,
        "image_height": intrinsics.height,
        "distortion_model": "fisheye" if is_fisheye else "pinhole",
        **({"fisheye_model": 1} if is_fisheye else {}),
    }
    arrays = {
        "camera_matrix": intrinsics.camera_matrix,
        "distortion_coefficients": np.array([intrinsics.distortion or (0.0,) * 4]),
    }
    matrices = {
        name: {"rows": array.shape[0], "cols": array.shape[1], "dt": "d", "data": array.ravel().tolist()}
        for name, array in arrays.items()
    }
    if Path(path).suffix.lower() == ".json":
        stored = {name: {"type_id": "opencv-matrix", **matrix} for name, matrix in matrices.items()}
        text = json.dumps({**plain, **stored}, indent=4)
    else:
        lines = ["%YAML:1.0", "---", *(f"{name}: {value}" for name, value in plain.items())]
        for name, matrix in matrices.items():
            lines += [f"{name}: !!opencv-matrix", *(f"   {key}: {value}" for key, value in matrix.items())]
        text = "\n".join(lines)
    write_text(Path(path), f"{text}\n")
