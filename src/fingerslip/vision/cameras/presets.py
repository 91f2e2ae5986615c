"""Cameras of an optical sensor whose axis is y: one inside that looks down on its markers, one that looks up at it.

The axes are those of the simulations: x along the slide, y up, the plate below. Both images have x to the right. The
heights, views, rates and exposures of real sensors are not published: all defaults are assumed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from fingerslip.errors import InputError
from fingerslip.vision.cameras.camera import Camera, Pose
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole, fisheye_for_view, pinhole_for_view

__all__ = ["aimed_camera", "external_camera", "internal_camera"]


def internal_camera(
    distance: float,
    view_width: float,
    *,
    target: float = 0.0,
    size: tuple[int, int] = (640, 480),
    lens: Literal["pinhole", "fisheye"] = "pinhole",
    frame_rate: float = 30.0,
    exposure: float = 10e-3,
) -> Camera:
    """Return a camera inside a sensor, above its markers; z points down in its image.

    Parameters
    ----------
    distance : float
        Height of the lens above the target [m].
    view_width : float
        Length along x that the image shows at the target [m].
    target : float, optional
        Height y of the point on the axis that it looks at [m].
    size : (int, int), optional
        Width and height of the image [px].
    lens : {'pinhole', 'fisheye'}, optional
        Kind of the lens, without distortion of its own.
    frame_rate : float, optional
        Frames a second [1/s].
    exposure : float, optional
        Exposure of a frame [s].

    Returns
    -------
    Camera
        The camera, which sees internal markers.

    Raises
    ------
    InputError
        Where a length is not above 0, or the lens is of another kind.

    Examples
    --------
    >>> from fingerslip.vision.cameras.camera import pixels_of
    >>> pixels_of(internal_camera(50e-3, 64e-3), [1e-3, 0.0, 2e-3]).round(6).tolist()
    [329.5, 259.5]
    """
    pose = Pose((0.0, target + distance, 0.0), (0.0, target, 0.0), (0.0, 0.0, -1.0))
    return Camera(_lens(lens, size, view_width, distance), pose, "internal", frame_rate, exposure)


def external_camera(
    distance: float,
    view_width: float,
    *,
    target: float = 0.0,
    size: tuple[int, int] = (640, 480),
    lens: Literal["pinhole", "fisheye"] = "pinhole",
    frame_rate: float = 30.0,
    exposure: float = 10e-3,
) -> Camera:
    """Return a camera below a transparent plate that looks up at a sensor's skin; z points up in its image.

    Parameters
    ----------
    distance : float
        Depth of the lens below the target [m].
    view_width : float
        Length along x that the image shows at the target [m].
    target : float, optional
        Height y of the point on the axis that it looks at [m].
    size : (int, int), optional
        Width and height of the image [px].
    lens : {'pinhole', 'fisheye'}, optional
        Kind of the lens, without distortion of its own.
    frame_rate : float, optional
        Frames a second [1/s].
    exposure : float, optional
        Exposure of a frame [s].

    Returns
    -------
    Camera
        The camera, which sees external markers.

    Raises
    ------
    InputError
        Where a length is not above 0, or the lens is of another kind.
    """
    pose = Pose((0.0, target - distance, 0.0), (0.0, target, 0.0), (0.0, 0.0, 1.0))
    return Camera(_lens(lens, size, view_width, distance), pose, "external", frame_rate, exposure)


def aimed_camera(kind: str, heights: ArrayLike, distance: float, view_width: float, **more: Any) -> Camera:
    """Return a camera that is aimed at markers: at their middle from inside, at the lowest one from outside.

    Arrays: heights (n_markers,) [m].
    """
    seen = np.asarray(heights, dtype=np.float64)
    if kind == "internal":
        return internal_camera(distance, view_width, target=float(np.nanmean(seen)), **more)
    return external_camera(distance, view_width, target=float(np.nanmin(seen)), **more)


def _lens(kind: str, size: tuple[int, int], view_width: float, distance: float) -> Pinhole | Fisheye:
    makers: Mapping[str, Callable[..., Pinhole | Fisheye]] = {"pinhole": pinhole_for_view, "fisheye": fisheye_for_view}
    if kind not in makers:
        raise InputError("lens", f"got {kind!r}", f"needs one of {', '.join(makers)}")
    return makers[kind](*size, view_width, distance)
