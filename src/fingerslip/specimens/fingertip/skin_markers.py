"""Dots on the skin of a fingertip in space, as a camera below a plate sees them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.marker_layouts import hexagonal_layout
from fingerslip.sites import Site
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.pose import posed
from fingerslip.specimens.fingertip.skin_surface import skin_section, solid_shape

__all__ = ["skin_markers"]

Floats = NDArray[np.float64]

_KIND = "external marker"


def skin_markers(fingertip: FingertipNumbers, spacing: float = 1.5e-3, layers: int = 4) -> tuple[Site, ...]:
    """Return dots on the skin around its lowest point: a hexagonal lattice where it is seen from straight below.

    No paper prints such dots with dimensions; spacing and number are assumed.

    Units: spacing [m].
    """
    solid_shape(fingertip)
    layout = hexagonal_layout(spacing, layers)
    places = posed(fingertip, _lowest(fingertip, *layout.position.T))
    first = np.searchsorted(layout.ring, layout.ring)
    return tuple(
        Site(f"external-marker-{ring}-{number:02d}", _KIND, tuple(map(float, place)), "epidermis")
        for ring, number, place in zip(layout.ring, np.arange(layout.count) - first + 1, places, strict=True)
    )


def _lowest(fingertip: FingertipNumbers, x: Floats, z: Floats) -> Floats:
    """Return the (n, 3) points of the palmar skin above (n,) points x, z of a plane [m]; all are within the finger."""
    centre, height, width = skin_section(fingertip, x)
    return np.column_stack([x, centre - height * np.sqrt(1.0 - (z / width) ** 2), z])
