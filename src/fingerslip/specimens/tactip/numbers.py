"""The TacTip as numbers: which of them do not fit together, and the points of it that are recorded."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.marker_layouts import MarkerLayout
from fingerslip.materials.choice import MaterialChoice
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.sites import Site, ring_sites
from fingerslip.specimens.protocol import check_regions
from fingerslip.specimens.tactip.parts import (
    Dome,
    Markers,
    Rods,
    Skin,
    Window,
    place_points,
)
from fingerslip.units import millimetres

#: What of the sensor is modelled: its section in 2D, its half z >= 0 or the whole of it in 3D.
Part = Literal["section", "half", "whole"]
# Distance of neighbouring rods over their diameter, at least.
_APART = 1.1
REGIONS = ("skin", "gel", "rods", "window")


@parameters
class TacTipNumbers:
    """The numbers of a TacTip, held to fit together."""

    part: Annotated[Part, "What is modelled: the section through the axis, the half z >= 0, or the whole sensor in 3D."]
    dome: Annotated[Dome, "The surface on which the crowns of the skin lie."]
    skin: Annotated[Skin, "Thickness and ridges."]
    rods: Annotated[Rods, "Rigid rods from each ridge to its internal markers."]
    markers: Annotated[Markers, "Layout of the internal markers."]
    window: Annotated[Window, "Rigid window above the gel."]
    materials: Annotated[
        dict[str, MaterialChoice],
        "dict of str to Elastic, NeoHookean, MooneyRivlin or Ogden : Material of each of `skin`, `gel`, `rods` and "
        "`window`.",
    ]
    formulation: Annotated[Literal["plane_strain", "plane_stress"], "Out-of-plane behaviour of the section."]
    depth: Annotated[PositiveLength, "Out-of-plane thickness of the section [m]."]

    def __post_init__(self) -> None:
        check_regions(self.materials, REGIONS)
        deepest, room = self.skin.relief + self.skin.thickness, min(self.dome.radius, self.dome.height)
        if deepest >= room:
            allowed = f"needs < {millimetres(room)} (dome.radius, dome.height)"
            raise InputError("skin", f"got {millimetres(deepest)} from crowns to its inside", allowed)
        rods, thickness, ridges = self.rods, self.skin.thickness, self.skin.ridges
        if rods.embedding >= thickness:
            allowed = f"needs < {millimetres(thickness)} (skin.thickness)"
            raise InputError("rods.embedding", f"got {millimetres(rods.embedding)}", allowed)
        if ridges.enabled and rods.radius >= 0.9 * (ridges.bend_radius + thickness / 2):
            allowed = f"needs < {millimetres(0.9 * (ridges.bend_radius + thickness / 2))}, inside its ridge"
            raise InputError("rods.radius", f"got {millimetres(rods.radius)}", allowed)
        _check_ends(self)
        if ridges.enabled:
            _check_layout(self)

    @property
    def marker_depth(self) -> float:
        """Depth of the internal markers below the outermost surface [m]."""
        return self.skin.relief + self.skin.thickness + self.rods.length

    @property
    def rod_depth(self) -> float:
        """Depth at which rods begin below the outermost surface [m]."""
        return self.skin.thickness - self.rods.embedding


def _check_ends(sensor: TacTipNumbers) -> None:
    """Refuse rods that reach the window or each other."""
    from scipy.spatial import cKDTree

    rods, places = sensor.rods, sensor.markers.places
    fault = f"markers {millimetres(sensor.marker_depth)} below the crowns"
    if sensor.marker_depth >= sensor.dome.radius:
        raise InputError("rods.length", fault, f"needs < {millimetres(sensor.dome.radius)} (dome.radius)")
    distance, height = place_points(sensor.dome, np.hypot(*places.position.T), sensor.marker_depth).T
    if height.max() + rods.radius >= sensor.dome.height:
        raise InputError("rods.length", fault, "needs markers below the window", "make the rods shorter")
    ends = np.column_stack([distance * np.cos(places.angle), height, distance * np.sin(places.angle)])
    nearest = float(cKDTree(ends).query(ends, k=2)[0][:, 1].min()) if len(ends) > 1 else np.inf
    if nearest <= _APART * 2.0 * rods.radius:
        allowed = f"needs ends at least {millimetres(_APART * 2.0 * rods.radius)} apart"
        repair = "make the rods shorter or thinner, or markers.spacing larger"
        raise InputError("rods.length", f"has ends {millimetres(nearest)} apart", allowed, repair)


def _check_layout(sensor: TacTipNumbers) -> None:
    """Refuse markers that are not one ring in the crown of each ridge."""
    markers, ridges = sensor.markers, sensor.skin.ridges
    if markers.layout != "rings":
        fault = "is hexagonal under concentric ridges"
        allowed = "needs rings, as a rod begins in the crown of a ridge and a ridge is a ring"
        raise InputError("markers.layout", fault, allowed, "or take a smooth skin, skin: {ridges: {enabled: false}}")
    if abs(markers.spacing - ridges.pitch) > 1e-9:
        allowed = f"needs {millimetres(ridges.pitch)} (skin.ridges.pitch), as a ridge has each ring"
        raise InputError("markers.spacing", f"got {millimetres(markers.spacing)}", allowed)
    if len(markers.rings) - 1 > ridges.number:
        fault = f"has {len(markers.rings) - 1} rings around the axis"
        raise InputError("markers.rings", fault, f"needs at most {ridges.number} (skin.ridges.number)")


#: Groups of sites: name in study files, and kind in histories.
GROUPS: Mapping[str, str] = MappingProxyType(
    {"internal_markers": "internal marker", "rod_feet": "rod foot", "external_markers": "external marker"}
)


def modelled_places(sensor: TacTipNumbers) -> MarkerLayout:
    """Return the places of the markers that the modelled part has: those on the axis plane, on its one side, or all."""
    places = sensor.markers.places
    rows = {"section": places.on_x, "half": places.on_x | (places.position[:, 1] > 0.0)}
    return places.select(rows[sensor.part]) if sensor.part in rows else places


def points_at(sensor: TacTipNumbers, places: MarkerLayout, depth: float) -> Floats:
    """Return the points at a depth [m] under marker places, shape (n, 2) for a section, else (n, 3) [m]."""
    distance, height = place_points(sensor.dome, np.hypot(*places.position.T), depth).T
    x = distance * np.cos(places.angle)
    if sensor.part == "section":
        return np.column_stack([x, height])
    return np.column_stack([x, height, np.where(places.on_x, 0.0, distance * np.sin(places.angle))])


def marker_sites(sensor: TacTipNumbers, group: str) -> tuple[Site, ...]:
    """Return the sites of one of the `GROUPS`, ring by ring, in each from +x towards +z: ``internal-marker-2-05``."""
    depths = {"internal_markers": sensor.marker_depth, "rod_feet": sensor.rod_depth, "external_markers": 0.0}
    places, region = modelled_places(sensor), "skin" if group == "external_markers" else "rods"
    return ring_sites(GROUPS[group], places.ring, points_at(sensor, places, depths[group]), region)
