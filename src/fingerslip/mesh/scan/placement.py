"""Where a scanned finger lies to the plate: tip towards +x, pad down, plate from below."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerslip.arrays import Floats
from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.scan.surfaces import Surface

_FAR = np.radians(45.0)


@dataclass(frozen=True)
class Placement:
    """A rigid motion: rotation, then shift, as :func:`placement_from_directions` returns it.

    Parameters
    ----------
    rotation : (3, 3) array
        Its rows are the new axes in the old coordinates.
    shift : (3,) array
        Shift along the new axes [m].
    """

    rotation: Floats
    shift: Floats


def place_surface(surface: Surface, placement: Placement) -> Surface:
    """Return a surface that is moved; skin and phalanx take the same placement.

    Parameters
    ----------
    surface : Surface
        The surface.
    placement : Placement
        The motion, such as that of :func:`placement_from_directions`.
    """
    return dataclasses.replace(surface, points=surface.points @ placement.rotation.T + placement.shift)


def placement_from_directions(skin: Surface, tip: ArrayLike, pad: ArrayLike, plate_angle: float = 0.0) -> Placement:
    """Return the placement of skin and phalanx from the principal axis of the skin and two rough directions.

    The new x axis is the principal axis of the skin's area that lies closest to `tip`; y is up, away from `pad`; z
    is lateral. The most distal point then has x = 0 and the lowest one y = 0, where the plate touches first; z = 0 is
    in the middle.

    Parameters
    ----------
    skin : Surface
        The skin.
    tip : (3,) array_like
        Rough direction from the palm to the tip, in the scan's axes.
    pad : (3,) array_like
        Rough direction in which the pad faces, in the scan's axes.
    plate_angle : float
        Angle between the finger's axis and the plate [rad]; positive with the tip down.

    Raises
    ------
    InputError
        Where a direction is zero or both are parallel.
    MeshError
        Where no long axis lies within 45 degrees of `tip`.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial import ConvexHull
    >>> import fingerslip as fs
    >>> corners = np.array(list(np.ndindex(2, 2, 2))) * (12e-3, 30e-3, 14e-3)
    >>> scan = fs.Surface(corners, ConvexHull(corners).simplices)
    >>> placement = fs.placement_from_directions(scan, tip=(0, 1, 0), pad=(0, 0, -1))
    >>> fs.place_surface(scan, placement).points.min(axis=0).round(6).tolist()
    [-0.03, 0.0, -0.006]
    """
    towards = _unit("tip", tip)
    centres, weights = skin.corners.mean(axis=1), skin.areas / skin.area
    off = centres - weights @ centres
    longest = np.linalg.eigh((off * weights[:, None]).T @ off)[1][:, -1]
    axis = longest if longest @ towards >= 0 else -longest
    if axis @ towards < np.cos(_FAR):
        angle = np.degrees(np.arccos(axis @ towards))
        fault = f"its long axis is {angle:.0f} degrees off the direction of the tip"
        repair = "correct tip, or give landmarks (placement_from_landmarks) for a finger cut short"
        raise MeshError(skin.name, fault, "needs at most 45 degrees", repair)
    return _placement(skin, axis, _unit("pad", pad), plate_angle)


def placement_from_landmarks(
    skin: Surface, tip: ArrayLike, base: ArrayLike, pad: ArrayLike, plate_angle: float = 0.0
) -> Placement:
    """Return the placement from three points: the x axis goes from `base` to `tip`, the side of `pad` is down.

    Parameters
    ----------
    skin : Surface
        The skin.
    tip, base, pad : (3,) array_like
        Points at the tip, in the middle of the proximal end, and on the middle of the pad [m], in the scan's axes.
    plate_angle : float
        Angle between the finger's axis and the plate [rad]; positive with the tip down.

    Raises
    ------
    InputError
        Where the three points are on a line.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial import ConvexHull
    >>> import fingerslip as fs
    >>> corners = np.array(list(np.ndindex(2, 2, 2))) * (12e-3, 30e-3, 14e-3)
    >>> scan = fs.Surface(corners, ConvexHull(corners).simplices)
    >>> tip, base, pad = (6e-3, 30e-3, 7e-3), (6e-3, 0.0, 7e-3), (6e-3, 25e-3, 0.0)
    >>> placement = fs.placement_from_landmarks(scan, tip, base, pad)
    >>> fs.place_surface(scan, placement).points.min(axis=0).round(6).tolist()
    [-0.03, 0.0, -0.006]
    """
    start = np.asarray(base, dtype=float)
    axis = _unit("tip", np.asarray(tip, dtype=float) - start)
    return _placement(skin, axis, _unit("pad", np.asarray(pad, dtype=float) - start), plate_angle)


def _placement(skin: Surface, axis: Floats, pad: Floats, plate_angle: float) -> Placement:
    up = -(pad - (pad @ axis) * axis)
    if np.linalg.norm(up) < 1e-3:
        raise InputError("pad", "is parallel to the direction of the tip", "needs a direction across the finger")
    up /= np.linalg.norm(up)
    cosine, sine = np.cos(plate_angle), np.sin(plate_angle)
    tilt = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    rotation = tilt @ np.stack([axis, up, np.cross(axis, up)])
    turned = skin.points @ rotation.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    return Placement(rotation, -np.array([high[0], low[1], (low[2] + high[2]) / 2]))


def _unit(name: str, direction: ArrayLike) -> Floats:
    vector = np.asarray(direction, dtype=float)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)) or np.linalg.norm(vector) == 0:
        raise InputError(name, f"got {direction!r}", "needs three numbers that are not all zero")
    return np.asarray(vector / np.linalg.norm(vector))
