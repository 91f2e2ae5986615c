"""Element sizes in a TacTip: fine in the skin that can touch and around the rods, growing into the gel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fingerslip.mesh.sizes import GROWTH
from fingerslip.specimens.tactip.numbers import TacTipNumbers

__all__ = ["SensorSizes", "size_function"]

Floats = NDArray[np.float64]


class SensorSizes(Protocol):
    """Element sizes of a mesh that is finer where it can touch."""

    @property
    def contact_size(self) -> float:
        """Size in the skin that can touch, and at the rods [m]."""
        ...

    @property
    def bulk_size(self) -> float:
        """Largest size [m]."""
        ...

    @property
    def contact_reach(self) -> float:
        """Height above the lowest point up to which the skin is meshed at `contact_size` [m]."""
        ...


def size_function(sensor: TacTipNumbers, sizes: SensorSizes, rods: Floats) -> Callable[[float, float, float], float]:
    """Return the wanted size [m] at x, y, z [m].

    Parameters
    ----------
    sensor : TacTipNumbers
        The sensor.
    sizes : SensorSizes
        Sizes.
    rods : (n, 2, dim) array
        Both ends of the axes of the rods [m].
    """
    foot = np.zeros((len(rods), 3))
    foot[:, : rods.shape[2]] = rods[:, 0]
    axis = np.zeros_like(foot)
    axis[:, : rods.shape[2]] = rods[:, 1] - rods[:, 0]
    square = np.maximum(np.sum(axis**2, axis=1), 1e-30)
    deepest = sensor.skin.relief + sensor.skin.thickness

    def size(x: float, y: float, z: float) -> float:
        beyond = max(_beyond_skin(sensor, x, y, z, deepest), y - sizes.contact_reach)
        if len(foot):
            offset = np.array([x, y, z]) - foot
            share = np.clip((offset * axis).sum(axis=1) / square, 0.0, 1.0)
            away = np.sqrt(((offset - share[:, None] * axis) ** 2).sum(axis=1).min()) - sensor.rods.radius
            beyond = min(beyond, away)
        return min(sizes.bulk_size, sizes.contact_size + GROWTH * max(beyond, 0.0))

    return size


def _beyond_skin(sensor: TacTipNumbers, x: float, y: float, z: float, deepest: float) -> float:
    """Return how far a point lies inside the skin [m], about; negative in it."""
    dome = sensor.dome
    across = max((x * x + z * z) ** 0.5 - dome.flat_radius, 0.0)
    up = dome.radius - min(y, dome.radius)
    return dome.radius - (across * across + up * up) ** 0.5 - deepest
