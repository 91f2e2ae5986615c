"""Tracks of the markers of a simulated sensor, read off its history."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.history import sites_of_kinds
from fingerslip.libraries import xr
from fingerslip.vision.tracks import KINDS, make_tracks

#: Kind of the sites where rods begin; each stands beside the internal marker of its rod.
ROD_FOOT = "rod foot"


def marker_tracks(history: xr.Dataset, kinds: Sequence[str] = KINDS) -> xr.Dataset:
    """Return where the markers of a simulated sensor were at every record.

    Markers are recorded sites of the kinds ``internal marker`` and ``external marker``, whose names end in their ring
    and their number in it, such as ``internal-marker-2-05``. Tracks are in the axes of the history [m]. Where the feet
    of rods were recorded, `direction` is the unit vector from the foot to the marker, NaN for a marker without a rod.
    """
    rows = {kind: sites_of_kinds(history, [f"{kind} marker"]) for kind in kinds}
    chosen = np.concatenate([*rows.values(), np.empty(0, dtype=np.intp)]).astype(np.intp)
    if not chosen.size:
        repair = "a fingertip has none: write record: {groups: [internal_markers]} in the study of a tactip"
        raise InputError("history", "has no markers", "needs recorded sites of a sensor's markers", repair)
    places = history["site_position"].values
    rest, positions = places[chosen], places + history["displacement"].values
    across = rest[:, 2] if rest.shape[1] > 2 else np.zeros(len(rest))
    names = history["site"].values[chosen].astype(str)
    tracks = make_tracks(
        positions[:, chosen],
        history["time"].values,
        units="m",
        kind=[kind for kind, row in rows.items() for _ in row],
        ring=np.array([int(name.split("-")[-2]) for name in names]),
        angle=np.mod(np.arctan2(across, rest[:, 0]), 2.0 * np.pi),  # about the axis y, from +x towards +z
        attributes={"source": "simulation"},
    ).assign_coords(name=("marker", names))
    row_of_foot = {
        str(history["site"].values[row]).removeprefix("rod-foot"): row for row in sites_of_kinds(history, [ROD_FOOT])
    }
    feet = np.array([row_of_foot.get(name.removeprefix("internal-marker"), -1) for name in names], dtype=np.intp)
    if (feet < 0).all():
        return tracks
    along = positions[:, chosen] - positions[:, feet]
    along[:, feet < 0] = np.nan
    meaning = {"units": "1", "long_name": "direction of the rod, from the skin to the marker"}
    directions = along / np.linalg.norm(along, axis=2, keepdims=True)
    return tracks.assign(direction=(("time", "marker", "axis"), directions, meaning))


def filmed_tracks(history: xr.Dataset, kind: str, rest: float = 0.0) -> xr.Dataset:
    """Return the markers of one kind as the camera that films them has them before it.

    The internal camera is fixed to what holds the sensor, which is at rest in a history whose supports do not move.
    The external one stands below the plate and goes with it: a marker that sticks stays where it is.

    Units: rest [s]; returns [m].
    """
    tracks = marker_tracks(history, (kind,))
    if history.sizes.get("counterface", 0):
        tracks = seen_with_plate(tracks, history["counterface_displacement"].values[:, 0])
    if rest > 0.0:
        before = tracks.isel(time=[0]).assign_coords(time=tracks["time"].values[:1] - rest)
        tracks = xr.concat([before, tracks], "time", data_vars="minimal", coords="minimal")
    return tracks


def seen_with_plate(tracks: xr.Dataset, movement: Floats) -> xr.Dataset:
    """Return tracks as the cameras have them before them, of which the external one goes with the plate.

    Arrays: tracks [m]; movement (n_times, n_axes) [m]; returns [m].
    """
    outside = (tracks["kind"].values == "external")[:, None]
    relative = tracks["position"].values - np.where(outside, movement[:, None], 0.0)
    meaning = {"units": "m", "long_name": "position as the camera of the marker has it"}
    return tracks.assign(position=(("time", "marker", "axis"), relative, meaning))
