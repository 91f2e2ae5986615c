"""Both cameras of a sensor at once, as trials of slip detection need them: one inside and one behind the plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.cameras import PUBLISHED_FRAME_RATE
from fingerslip.vision.cameras.camera import Camera, frame_times, image_attributes, interpolated, pixels_per_metre
from fingerslip.vision.cameras.errors import PositionErrors
from fingerslip.vision.cameras.point import MEASURED_ERRORS, PointCamera, point_tracks
from fingerslip.vision.tracks import make_tracks

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["PUBLISHED_FRAME_RATE", "CameraPair", "metres_per_pixel", "pair_tracks", "plate_mark"]


# Positions are kept to this share of a pixel, far below their noise, so that files are small.
_KEPT = 1.0 / 1024.0


@dataclass(frozen=True)
class CameraPair:
    """The cameras of one trial."""

    internal: Camera  # both cameras, with one frame rate
    external: Camera  # both cameras, with one frame rate
    errors: PositionErrors = MEASURED_ERRORS  # errors of the positions of both
    seed: int = 0  # seed of the errors

    def __post_init__(self) -> None:
        """Check that both take the same frames, each of its own markers."""
        rates = self.internal.frame_rate, self.external.frame_rate
        if rates[0] != rates[1]:
            found = f"got {rates[0]:g} and {rates[1]:g} frames a second"
            raise InputError("cameras: frame_rate", found, "needs one rate of both cameras")
        for kind in ("internal", "external"):
            sees = getattr(self, kind).sees
            if sees != kind:
                raise InputError(f"cameras: {kind}", f"sees {sees} markers", f"needs a camera that sees {kind} ones")


def pair_tracks(pair: CameraPair, markers: xr.Dataset) -> xr.Dataset:
    """Return what both cameras and a tracker make of markers.

    Units: markers [m]; returns [px].
    """
    seen = [
        point_tracks(PointCamera(camera, pair.errors, 2 * pair.seed + number), markers)
        for number, camera in enumerate((pair.internal, pair.external))
    ]
    position = np.concatenate([one["position"].values for one in seen], axis=1)
    more = {
        name: np.concatenate([one[name].values for one in seen])
        for name in ("marker", "ring", "angle")
        if all(name in one.coords for one in seen)
    }
    scale = metres_per_pixel(pair.external)
    return make_tracks(
        np.round(position / _KEPT) * _KEPT,
        seen[0]["time"].values,
        units="px",
        kind=[kind for one in seen for kind in one["kind"].values.astype(str)],
        attributes={
            **image_attributes(pair.external, f"simulation, point cameras, seed {pair.seed}"),
            "metres_per_pixel_x": scale,
            "metres_per_pixel_y": scale,
        },
        **more,
    )


def plate_mark(pair: CameraPair, displacement: NDArray[np.float64], time: NDArray[np.float64]) -> xr.Dataset:
    """Return the track of a marker on the plate, below the axis at first, as the external camera sees it [px].

    Arrays: displacement (n, 3) [m]; time (n,) [s].
    """
    mark = make_tracks(displacement[:, None], time, units="m", kind="external")
    camera, times = pair.external, frame_times(pair.external, mark)
    # As far as a marker may fall it is in sight: it need not be in the middle of the image.
    image = camera.intrinsics.project(camera.pose.to_camera(interpolated(mark, times)))
    noise = pair.errors.noise * np.random.default_rng([pair.seed, 3]).standard_normal(image.shape)
    return make_tracks(image + noise, times, units="px", kind="external")


def metres_per_pixel(camera: Camera) -> float:
    """Return the length of a pixel in the middle of the image, as far away as what the camera looks at [m]."""
    return 1.0 / float(pixels_per_metre(camera, np.asarray(camera.pose.target, dtype=np.float64)))
