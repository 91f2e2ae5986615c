"""The tracks of a trial: both cameras, the frames, and the errors of the tracker."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.study.definition.settings import TrialSettings
from fingerslip.vision.cameras.camera import Camera, Pose, aimed_camera
from fingerslip.vision.cameras.point import MEASURED_ERRORS, CameraPair, PositionErrors

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Eyes", "drawn_cameras", "drawn_eyes"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Eyes:
    """The cameras of one trial."""

    noise: float  # standard deviation of positions [px]
    shift: tuple[float, float]  # (float, float), how far the cameras are beside the axis, along x and z [m]
    turn: float  # how far they are turned about their own axis [rad]
    seed: int  # seed of the errors


def drawn_eyes(settings: TrialSettings, number: int) -> Eyes:
    """Return the cameras of a trial, drawn from its number and the seed of the data set."""
    draw = np.random.default_rng([settings.seed, number])
    x, z, turn = draw.uniform(-1.0, 1.0, 3)
    noise, seed = draw.uniform(*settings.noise), int(draw.integers(2**31))
    return Eyes(float(noise), (settings.shift * float(x), settings.shift * float(z)), settings.turn * float(turn), seed)


def drawn_cameras(settings: TrialSettings, eyes: Eyes, markers: xr.Dataset) -> CameraPair:
    """Return the cameras of a trial, which look at its markers.

    Units: markers [m].
    """
    cameras = {}
    for kind in ("internal", "external"):
        markers_of_kind = markers.isel(marker=np.flatnonzero(markers["kind"].values == kind))
        cameras[kind] = _camera(settings, eyes, kind, markers_of_kind["position"].values[0, :, 1])
    share = eyes.noise / MEASURED_ERRORS.noise
    errors = PositionErrors(eyes.noise, share * MEASURED_ERRORS.bias, MEASURED_ERRORS.correlation)
    return CameraPair(cameras["internal"], cameras["external"], errors, eyes.seed)


def _camera(settings: TrialSettings, eyes: Eyes, kind: str, heights: Floats) -> Camera:
    """Return a camera that stands beside its place and is turned."""
    camera = aimed_camera(
        kind,
        heights,
        settings.distance,
        settings.view_width,
        size=(settings.width, settings.height),
        frame_rate=settings.frame_rate,
        exposure=0.0,
    )
    return dataclasses.replace(camera, pose=_shift_pose(camera.pose, eyes))


def _shift_pose(pose: Pose, eyes: Eyes) -> Pose:
    x, z = eyes.shift
    position, target = ((at[0] + x, at[1], at[2] + z) for at in (pose.position, pose.target))
    side = np.sin(eyes.turn) * pose.rotation[0]
    up = np.cos(eyes.turn) * np.asarray(pose.up) + side
    return Pose(position, target, (float(up[0]), float(up[1]), float(up[2])))
