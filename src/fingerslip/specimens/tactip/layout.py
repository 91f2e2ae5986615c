"""Where markers are on the dome, ring by ring, whatever the layout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.specimens.tactip.parts import Markers

__all__ = ["MarkerPlaces", "marker_places"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Markers nearer to the axis plane than this share of their spacing lie on it.
_ON_PLANE = 1e-9


@dataclass(frozen=True)
class MarkerPlaces:
    """The places of n markers, from the axis outwards.

    Parameters
    ----------
    ring : (n,) array
        Number of the ring, 0 on the axis.
    along : (n,) array
        Arc length from the axis along the outermost surface [m].
    azimuth : (n,) array
        Angle about the axis, 0 towards +x, a quarter turn towards +z [rad].
    """

    ring: Integers
    along: Floats
    azimuth: Floats

    @property
    def across(self) -> Floats:
        """Arc length towards +z [m]; 0 in the axis plane."""
        return self.along * np.sin(self.azimuth)

    def chosen(self, rows: NDArray[np.bool_]) -> MarkerPlaces:
        """Return some of the places."""
        return MarkerPlaces(self.ring[rows], self.along[rows], self.azimuth[rows])

    def on_plane(self, spacing: float) -> NDArray[np.bool_]:
        """Tell which places lie in the axis plane z = 0."""
        return np.abs(self.across) < _ON_PLANE * spacing


def marker_places(markers: Markers) -> MarkerPlaces:
    """Return the places of all markers of a layout.

    Parameters
    ----------
    markers : Markers
        The layout.

    Examples
    --------
    >>> from fingerslip.specimens.tactip.parts import Markers
    >>> [len(marker_places(Markers("hexagonal", (1,), layers, 1e-3)).ring) for layers in (6, 10)]
    [127, 331]
    """
    places = _rings(markers) if markers.layout == "rings" else _hexagons(markers)
    order = np.lexsort([np.round(places.azimuth, 9), places.ring])
    return MarkerPlaces(places.ring[order], places.along[order], places.azimuth[order])


def _rings(markers: Markers) -> MarkerPlaces:
    ring = np.repeat(np.arange(len(markers.rings)), markers.rings)
    azimuth: Floats = np.concatenate([2.0 * np.pi * np.arange(count) / count for count in markers.rings])
    return MarkerPlaces(ring, np.asarray(markers.spacing * ring, dtype=np.float64), azimuth)


def _hexagons(markers: Markers) -> MarkerPlaces:
    """Lay out a hexagonal grid in the plane; its distances from the middle become arc lengths on the dome."""
    steps = np.arange(-markers.layers, markers.layers + 1)
    first, second = (grid.ravel() for grid in np.meshgrid(steps, steps))
    ring = np.max([np.abs(first), np.abs(second), np.abs(first + second)], axis=0)
    first, second, ring = (values[ring <= markers.layers] for values in (first, second, ring))
    x, z = markers.spacing * (first + 0.5 * second), markers.spacing * np.sqrt(0.75) * second
    along: Floats = np.asarray(np.hypot(x, z), dtype=np.float64)
    azimuth: Floats = np.asarray(np.mod(np.arctan2(z, x), 2.0 * np.pi), dtype=np.float64)
    return MarkerPlaces(ring, along, azimuth)
