"""Where markers are on the dome, ring by ring, whatever the layout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.marker_layouts import MarkerLayout, hexagonal_layout, ring_layout
from fingerslip.specimens.tactip.parts import Markers

__all__ = ["MarkerPlaces", "marker_places"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Markers nearer to the axis plane than this share of their spacing lie on it.
_ON_PLANE = 1e-9


@dataclass(frozen=True)
class MarkerPlaces:
    """The places of n markers, from the axis outwards."""

    ring: Integers  # (n,), number of the ring, 0 on the axis
    along: Floats  # (n,), arc length from the axis along the outermost surface [m]
    azimuth: Floats  # (n,), angle about the axis, 0 towards +x, a quarter turn towards +z [rad]

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

    Examples
    --------
    >>> from fingerslip.specimens.tactip.parts import Markers
    >>> [len(marker_places(Markers("hexagonal", (1,), layers, 1e-3)).ring) for layers in (6, 10)]
    [127, 331]
    """
    layout = _layout(markers)
    along: Floats = np.hypot(*layout.position.T)
    return MarkerPlaces(layout.ring, along, layout.angle)


def _layout(markers: Markers) -> MarkerLayout:
    """Return the layout in a plane; its distances from the middle are arc lengths on the dome."""
    if markers.layout == "rings":
        return ring_layout(markers.spacing, markers.rings)
    return hexagonal_layout(markers.spacing, markers.layers)
