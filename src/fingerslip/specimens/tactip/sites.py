"""Points of a TacTip that are recorded: internal markers, the feet of their rods, external markers."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingerslip.sites import Site
from fingerslip.specimens.tactip.layout import MarkerPlaces, marker_places
from fingerslip.specimens.tactip.numbers import TacTipNumbers
from fingerslip.specimens.tactip.profile import place_points

__all__ = ["GROUPS", "marker_name", "marker_sites", "modelled_places", "points_at"]

Floats = NDArray[np.float64]

#: Groups of sites: name in study files, and kind in histories.
GROUPS: Mapping[str, str] = MappingProxyType(
    {"internal_markers": "internal marker", "rod_feet": "rod foot", "external_markers": "external marker"}
)
_REGIONS = MappingProxyType({"internal_markers": "rods", "rod_feet": "rods", "external_markers": "skin"})


def marker_name(kind: str, ring: int, number: int) -> str:
    """Return the name of a site.

    Examples
    --------
    >>> marker_name("internal marker", 2, 5)
    'internal-marker-2-05'
    """
    return f"{kind.replace(' ', '-')}-{ring}-{number:02d}"


def modelled_places(sensor: TacTipNumbers) -> MarkerPlaces:
    """Return the places of the markers that the modelled part has: those on the axis plane, on its one side, or all."""
    places = marker_places(sensor.markers)
    on_plane = places.on_plane(sensor.markers.spacing)
    rows = {"section": on_plane, "half": on_plane | (places.across > 0.0), "whole": np.ones_like(on_plane)}
    return places.chosen(rows[sensor.part])


def points_at(sensor: TacTipNumbers, places: MarkerPlaces, depth: float) -> Floats:
    """Return the points at a depth [m] under marker places, shape (n, 2) for a section, else (n, 3) [m]."""
    distance, height = place_points(sensor.dome, places.along, np.full(len(places.along), depth)).T
    x = distance * np.cos(places.azimuth)
    if sensor.part == "section":
        return np.column_stack([x, height])
    z = np.where(places.on_plane(sensor.markers.spacing), 0.0, distance * np.sin(places.azimuth))
    return np.column_stack([x, height, z])


def marker_sites(sensor: TacTipNumbers, group: str) -> tuple[Site, ...]:
    """Return the sites of one of the `GROUPS`, ring by ring, in each from +x towards +z."""
    depths = {"internal_markers": sensor.marker_depth, "rod_feet": sensor.rod_depth, "external_markers": 0.0}
    places, kind = modelled_places(sensor), GROUPS[group]
    points = points_at(sensor, places, depths[group])
    first = np.searchsorted(places.ring, places.ring)
    return tuple(
        Site(marker_name(kind, int(ring), int(number)), kind, tuple(map(float, point)), _REGIONS[group])
        for ring, number, point in zip(places.ring, np.arange(len(points)) - first + 1, points, strict=True)
    )
