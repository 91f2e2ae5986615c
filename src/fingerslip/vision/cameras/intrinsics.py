"""Intrinsics of a camera: from points in its own frame to pixels and back, and files of them.

The models are OpenCV's pinhole and fisheye. Calibration files, YAML or JSON with ``camera_matrix`` and
``distortion_coefficients``, are those that OpenCV's FileStorage writes, those of ROS (which name the model and the size
of the image), and plain nested lists under the names that calibration scripts use.

The camera's frame has x to the right, y down and z forwards, from the centre of the lens. Pixels count from the middle
of the first one, as in OpenCV. Distortion acts on x/z and y/z [-] and grows with the distance from the axis up to a
largest one, beyond which the polynomials fold the picture back onto itself; what is beyond has no image. A pinhole with
distortion, and writing a file, need OpenCV to be installed.
"""

from __future__ import annotations

import functools
import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

import numpy as np
import pydantic
from numpy.polynomial import Polynomial

from fingerslip.arrays import Floats
from fingerslip.errors import InputError, ResultError, shorten
from fingerslip.parameters import Number, parameters
from fingerslip.parameters.yaml_text import parse_document
from fingerslip.storage.files import write_text
from fingerslip.vision.video import opencv

PixelCount = Annotated[int, pydantic.Field(ge=1, le=100_000)]
PositiveNumber = Annotated[Number, pydantic.Field(gt=0)]

_REAL = 1e-9
_STEPS, _HALVINGS, _EXACT = 200, 60, 1e-9


@parameters
class _Lens:
    """Focal lengths, a principal point and coefficients of distortion."""

    width: Annotated[PixelCount, "Size of the image [px]."]
    height: Annotated[PixelCount, "Size of the image [px]."]
    focal_x: Annotated[PositiveNumber, "Focal lengths [px]."]
    focal_y: Annotated[PositiveNumber, "Focal lengths [px]."]
    centre_x: Annotated[Number, "Principal point [px]."]
    centre_y: Annotated[Number, "Principal point [px]."]
    distortion: tuple[Number, ...] = ()
    coefficient_counts: ClassVar[tuple[int, ...]]  # how many coefficients there may be

    def __post_init__(self) -> None:
        """Check the number of coefficients."""
        if len(self.distortion) not in self.coefficient_counts:
            fault = f"got {len(self.distortion)} coefficients"
            allowed = f"needs one of {', '.join(map(str, self.coefficient_counts))}"
            repair = "leave zeros at the end out; the tilt of a sensor is not modelled"
            raise InputError("distortion", fault, allowed, repair)

    @property
    def camera_matrix(self) -> Floats:
        """OpenCV's camera matrix, shape (3, 3) [px]."""
        return np.array([[self.focal_x, 0.0, self.centre_x], [0.0, self.focal_y, self.centre_y], [0.0, 0.0, 1.0]])

    def _pixels(self, plane: Floats) -> Floats:
        return plane * (self.focal_x, self.focal_y) + (self.centre_x, self.centre_y)

    def _plane(self, pixels: Floats) -> Floats:
        return (np.asarray(pixels, dtype=np.float64) - (self.centre_x, self.centre_y)) / (self.focal_x, self.focal_y)


@parameters
class Pinhole(_Lens):
    """A pinhole with OpenCV's lens distortion.

    Examples
    --------
    >>> import numpy as np
    >>> import fingerslip as fs
    >>> fs.Pinhole(640, 480, 500.0, 500.0, 319.5, 239.5).project(np.array([0.0, 0.01, 0.1])).tolist()
    [319.5, 289.5]
    """

    distortion: Annotated[
        tuple[Number, ...],
        "None, 4, 5, 8 or 12 coefficients k1, k2, p1, p2, k3, k4, k5, k6, s1 to s4 in OpenCV's order.",
    ] = ()
    coefficient_counts = (0, 4, 5, 8, 12)

    def project(self, points: Floats) -> Floats:
        """Return pixels (..., 2) of points (..., 3) [m] in the camera's frame; NaN behind it and beyond the lens."""
        points = np.asarray(points, dtype=np.float64)
        depth = np.where(points[..., 2] > 0, points[..., 2], np.nan)
        return self._pixels(self._distort(points[..., :2] / depth[..., None]))

    def directions(self, pixels: Floats) -> Floats:
        """Return unit vectors (..., 3) of the rays that pixels (..., 2) see; NaN where the lens images none."""
        plane = self._plane(pixels)
        if any(self.distortion) and plane.size:
            cv2, distorted, once = opencv(), plane, np.eye(3)
            # OpenCV 4 has another name for it where one says how exact it should be.
            iterate = getattr(cv2, "undistortPointsIter", cv2.undistortPoints)
            stop = cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, _STEPS, 1e-4 * _EXACT
            pairs, distortion = plane.reshape(-1, 1, 2), np.array(self.distortion)
            plane = iterate(pairs, once, distortion, R=once, P=once, criteria=stop).reshape(plane.shape)
            plane[~(np.abs(self._distort(plane) - distorted) < _EXACT).all(axis=-1)] = np.nan
        rays = np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1)
        return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))

    def _distort(self, plane: Floats) -> Floats:
        """Return where the lens puts undistorted points (..., 2) [-], NaN beyond it."""
        if not any(self.distortion) or not plane.size:
            return plane
        beyond = np.hypot(plane[..., 0], plane[..., 1]) > _largest_radius(self.distortion)
        rays = np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1).reshape(-1, 1, 3)
        pixels, _ = opencv().projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), np.array(self.distortion))
        distorted: Floats = pixels.reshape(plane.shape)
        distorted[beyond] = np.nan
        return distorted


@parameters
class Fisheye(_Lens):
    """A fisheye camera of OpenCV's model (Kannala & Brandt 2006), without skew.

    Examples
    --------
    A ray at 45 degrees to the axis:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> lens = fs.Fisheye(640, 480, focal_x=300.0, focal_y=300.0, centre_x=319.5, centre_y=239.5)
    >>> lens.project(np.array([0.1, 0.0, 0.1])).round(2).tolist()
    [555.12, 239.5]
    """

    distortion: Annotated[tuple[Number, ...], "None or four coefficients k1 to k4."] = ()
    coefficient_counts = (0, 4)

    def project(self, points: Floats) -> Floats:
        """Return pixels (..., 2) of points (..., 3) [m], also beside and behind it; NaN beyond the lens."""
        points = np.asarray(points, dtype=np.float64)
        across = np.hypot(points[..., 0], points[..., 1])
        angle = np.arctan2(across, points[..., 2])
        distance = self._distance(np.where(angle > self._largest_angle, np.nan, angle))
        # On the axis the direction does not matter.
        scale = distance / np.where(across > 0, across, 1.0)
        return self._pixels(points[..., :2] * scale[..., None])

    def directions(self, pixels: Floats) -> Floats:
        """Return unit vectors (..., 3) of the rays that pixels (..., 2) see; NaN where the lens images none."""
        plane = self._plane(pixels)
        distance = np.hypot(plane[..., 0], plane[..., 1])
        # By bisection, which is sure also where the distance hardly rises.
        low, high = np.zeros_like(distance), np.full_like(distance, min(self._largest_angle, np.pi))
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            inside = self._distance(middle) < distance
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        angle = 0.5 * (low + high)
        angle = np.where(np.abs(self._distance(angle) - distance) < _EXACT, angle, np.nan)
        across = plane * (np.sin(angle) / np.where(distance > 0, distance, 1.0))[..., None]
        return np.concatenate([across, np.cos(angle)[..., None]], axis=-1)

    def _distance(self, angle: Floats) -> Floats:
        """Return the distance from the axis [-] of rays at some angles from it [rad], θ (1 + k1 θ² + ... + k4 θ⁸)."""
        return np.asarray(angle * Polynomial([1.0, *self.distortion])(angle * angle))

    @property
    def _largest_angle(self) -> float:
        series = Polynomial([1.0, *self.distortion])
        return math.sqrt(_first_root(series + 2.0 * Polynomial([0.0, 1.0]) * series.deriv()))


@functools.lru_cache
def _largest_radius(distortion: tuple[float, ...]) -> float:
    """Return the largest distance r from the axis that has an image in a pinhole [-].

    With numerator N and denominator D of the radial factor, the image radius r N(r²)/D(r²) rises until
    N D + 2 u (N' D - N D') is zero at u = r², or D is.
    """
    k1, k2, _, _, k3, k4, k5, k6 = (*distortion, *[0.0] * 4)[:8]
    numerator, denominator, u = Polynomial([1.0, k1, k2, k3]), Polynomial([1.0, k4, k5, k6]), Polynomial([0.0, 1.0])
    slope = numerator * denominator + 2.0 * u * (numerator.deriv() * denominator - numerator * denominator.deriv())
    return math.sqrt(min(_first_root(slope), _first_root(denominator)))


def _first_root(polynomial: Polynomial) -> float:
    """Return the least positive real root of a polynomial whose constant is not 0; infinity without one."""
    # The inverses of the roots are those of the reversed polynomial, whose leading coefficient is never small.
    inverse = Polynomial(polynomial.coef[::-1]).roots()
    real = inverse.real[(np.abs(inverse.imag) <= _REAL * np.abs(inverse)) & (inverse.real > _REAL)]
    return float(1.0 / real.max()) if real.size else math.inf


def pinhole_for_view(width: int, height: int, view_width: float, distance: float) -> Pinhole:
    """Return a pinhole without distortion that sees a given width at a given distance.

    Parameters
    ----------
    width, height : int
        Size of the image [px].
    view_width : float
        Length that the width of the image shows [m].
    distance : float
        Distance from the lens [m] at which it does.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.pinhole_for_view(640, 480, 0.064, 0.05).focal_x
    500.0
    """
    lens: Pinhole = lens_for_view("pinhole", width, height, view_width, distance)
    return lens


def lens_for_view(kind: str, width: int, height: int, view_width: float, distance: float) -> Any:
    """Return a pinhole, or a fisheye with equal distances for equal angles, as of :func:`pinhole_for_view`."""
    if kind not in ("pinhole", "fisheye"):
        raise InputError("lens", f"got {kind!r}", "needs one of pinhole, fisheye")
    if not (view_width > 0 and distance > 0):
        raise InputError("view_width, distance", f"got {view_width}, {distance}", "needs lengths > 0 in metres")
    is_pinhole, across = kind == "pinhole", 0.5 * view_width
    focal = width * distance / view_width if is_pinhole else 0.5 * width / math.atan2(across, distance)
    return MODELS[kind](width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))


#: Names of lens models in files, and the model of each.
MODELS: Mapping[str, type[Pinhole] | type[Fisheye]] = MappingProxyType(
    dict.fromkeys(("pinhole", "plumb_bob", "rational_polynomial"), Pinhole)
    | dict.fromkeys(("fisheye", "equidistant"), Fisheye)
)
_MATRIX = ("camera_matrix", "K", "mtx")
_DISTORTION = ("distortion_coefficients", "dist_coeffs", "dist_coeff", "dist", "D")
_LARGEST = 1_000_000  # bytes


def read_calibration(
    path: str | Path, *, model: str | None = None, size: tuple[int, int] | None = None
) -> Pinhole | Fisheye:
    """Return the intrinsics of a camera that a file holds.

    Parameters
    ----------
    path : path
        The file.
    model : str, optional
        One of :data:`MODELS`, such as ``fisheye``. Without it the file says, by ``distortion_model`` or OpenCV's
        ``fisheye_model: 1``; where it does not, the camera is a pinhole.
    size : (int, int), optional
        Width and height of the image [px], where the file does not say.

    Raises
    ------
    ResultError, InputError
        Where the file cannot be read; where it is no calibration.

    Examples
    --------
    >>> import tempfile
    >>> import fingerslip as fs
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     fs.write_calibration(fs.pinhole_for_view(640, 480, 40e-3, 50e-3), f"{folder}/camera.yaml")
    ...     lens = fs.read_calibration(f"{folder}/camera.yaml")
    >>> lens.focal_x, lens.distortion
    (800.0, ())
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
    lens, coefficients = MODELS[name], _array(values, _DISTORTION, where)
    numbers: list[float] = [] if coefficients is None else coefficients.ravel().tolist()
    # Zeros at the end are left out, as far as the lens may have so few coefficients.
    last = max((count for count, number in enumerate(numbers, start=1) if number), default=0)
    count = next((count for count in lens.coefficient_counts if count >= last), last)
    focal_x, focal_y, centre_x, centre_y = matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    try:
        distortion = (*numbers, *[0.0] * count)[:count]
        return lens(int(width), int(height), focal_x, focal_y, centre_x, centre_y, distortion)
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


def write_calibration(intrinsics: Pinhole | Fisheye, path: str | Path) -> None:
    """Write intrinsics in the form that OpenCV's FileStorage reads, whole or not at all.

    Parameters
    ----------
    intrinsics : Pinhole or Fisheye
        The intrinsics.
    path : path
        A file that ends in ``.json``, or any other for YAML; see :func:`read_calibration`.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    cv2, is_json = opencv(), Path(path).suffix.lower() == ".json"
    is_fisheye = isinstance(intrinsics, Fisheye)
    storage = cv2.FileStorage(".json" if is_json else ".yml", cv2.FileStorage_WRITE | cv2.FileStorage_MEMORY)
    storage.write("image_width", intrinsics.width)
    storage.write("image_height", intrinsics.height)
    storage.write("distortion_model", "fisheye" if is_fisheye else "pinhole")
    storage.write("fisheye_model", int(is_fisheye))
    storage.write("camera_matrix", intrinsics.camera_matrix)
    storage.write("distortion_coefficients", np.array([intrinsics.distortion or (0.0,) * 4]))
    write_text(Path(path), storage.releaseAndGetString())
