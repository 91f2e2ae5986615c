"""Points of a TacTip that are recorded: internal markers, the feet of their rods, external markers."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingerslip.sites import Site, ring_sites
from fingerslip.specimens.tactip.numbers import TacTipNumbers
from fingerslip.specimens.tactip.profile import MarkerPlaces, marker_places, place_points

Floats = NDArray[np.float64]

#: Groups of sites: name in study files, and kind in histories.
GROUPS: Mapping[str, str] = MappingProxyType(
    {"internal_markers": "internal marker", "rod_feet": "rod foot", "external_markers": "external marker"}
)


def modelled_places(sensor: TacTipNumbers) -> MarkerPlaces:
    """Return the places of the markers that the modelled part has: those on the axis plane, on its one side, or all."""
    places = marker_places(sensor.markers)
    on_plane = places.on_plane(sensor.markers.spacing)
    rows = {"section": on_plane, "half": on_plane | (places.across > 0.0), "whole": np.ones_like(on_plane)}
    return places.chosen(rows[sensor.part])


def points_at(sensor: TacTipNumbers, places: MarkerPlaces, depth: float) -> Floats:
    """Return the points at a depth [m] under marker places, shape (n, 2) for a section, else (n, 3) [m]."""
    distance, height = place_points(sensor.dome, places.along, depth).T
    x = distance * np.cos(places.azimuth)
    if sensor.part == "section":
        return np.column_stack([x, height])
    z = np.where(places.on_plane(sensor.markers.spacing), 0.0, distance * np.sin(places.azimuth))
    return np.column_stack([x, height, z])


def marker_sites(sensor: TacTipNumbers, group: str) -> tuple[Site, ...]:
    """Return the sites of one of the `GROUPS`, ring by ring, in each from +x towards +z: ``internal-marker-2-05``."""
    depths = {"internal_markers": sensor.marker_depth, "rod_feet": sensor.rod_depth, "external_markers": 0.0}
    places, region = modelled_places(sensor), "skin" if group == "external_markers" else "rods"
    return ring_sites(GROUPS[group], places.ring, points_at(sensor, places, depths[group]), region)
