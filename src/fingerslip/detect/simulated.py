"""Trials of simulated sensors: what their two cameras see of a run, and its labels.

A trial begins with the first hold after the press, in which the sensor rests. The inner camera is fixed to the sensor;
the outer one stands behind the plate, and goes with it while a plate slides as prescribed.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.detect.labels import Onsets, labels_from_contact, labels_from_external_markers, labels_from_plate
from fingerslip.detect.trials import CONDITIONS, Trial
from fingerslip.errors import InputError
from fingerslip.history import phase_times, read_history
from fingerslip.libraries import xr
from fingerslip.marker_tracks import marker_tracks, seen_with_plate
from fingerslip.results import HISTORY, RESULT, stored_result
from fingerslip.slip.windows import stick_ratio
from fingerslip.units import parse_quantity
from fingerslip.vision.cameras import PUBLISHED_FRAME_RATE
from fingerslip.vision.cameras.camera import external_camera, internal_camera
from fingerslip.vision.cameras.point import CameraPair, pair_tracks, plate_mark

#: A marker on the skin touches where it is nearer to the plate than this [m]; penetrations are below 15 um.
_TOUCHING = 50e-6
#: How far a plate that falls is filmed [m]: as far as plates slide in the paper.
_TRAVEL = 14e-3


def trial_cameras(seed: int = 0) -> CameraPair:
    """Return the cameras that film a trial with a seed."""
    rate = PUBLISHED_FRAME_RATE
    inside = internal_camera(40e-3, 50e-3, target=6e-3, frame_rate=rate)
    return CameraPair(inside, external_camera(60e-3, 60e-3, frame_rate=rate), seed=seed % 2**61)


def simulated_trial(
    name: str, history: xr.Dataset, *, seed: int = 0, conditions: Mapping[str, Any] | None = None
) -> Trial:
    """Return the trial of a run: of pouring where its plate hangs on the sensor as a rigid body, else of a slide.

    Labels of a slide are those of the external markers that touch the plate at rest, of all external markers (the paper
    does not say which of the two it takes), and of the contact. Those of pouring are of a marker on the plate beside
    the central external marker, and of the contact; the trial ends once the plate has fallen far enough.
    """
    markers, plate = _after_press(history)
    cameras, labels = trial_cameras(seed), dict[str, Onsets]()
    if history.sizes.get("rigid_body", 0):
        fallen = np.linalg.norm(plate - plate[0], axis=1) > _TRAVEL
        last = int(np.argmax(fallen)) + 1 if fallen.any() else len(plate)
        markers, plate = markers.isel(time=slice(0, last)), plate[:last]
        height, fall = np.where(np.arange(plate.shape[1]) == 1, plate, 0.0), np.zeros((len(plate), 3))
        fall[:, 0] = plate[:, 0] - plate[0, 0]
        tracks = pair_tracks(cameras, seen_with_plate(markers, height))
        labels["plate"] = labels_from_plate(tracks, plate_mark(cameras, fall, markers["time"].values))
        task: dict[str, Any] = {"task": "pour"}
    else:
        tracks = pair_tracks(cameras, seen_with_plate(markers, plate))
        # y is the normal of the plate.
        height = markers["position"].values[0, :, 1] - plate[0, 1]
        touching = np.flatnonzero((markers["kind"].values == "external") & (height < _TOUCHING))
        labels["external_markers"] = labels_from_external_markers(tracks.isel(marker=touching))
        labels["all_external_markers"] = labels_from_external_markers(tracks)
        direction = float(np.mod(np.arctan2(0.0, plate[-1, 0] - plate[0, 0]), 2.0 * np.pi))
        task = {"task": "slide", "direction": direction}
    start = float(markers.attrs["start"])
    ratio = stick_ratio(history).sel(time=slice(start - 1e-9, start + float(markers["time"][-1]) + 1e-9))
    # Rounding leaves shares of 1 + 1e-16.
    labels["contact"] = labels_from_contact(ratio["time"].values - start, np.clip(ratio.values, 0.0, 1.0))
    task |= {"indentation": round(float(plate[0, 1]), 9), "seed": seed, **(conditions or {})}
    origin = {name: str(history.attrs[name]) for name in ("fingerslip_version", "kinematics") if name in history.attrs}
    return Trial(name, tracks, labels, task, {"source": "simulation", **origin})


def film_results(folder: str | Path, *, seed: int = 0) -> Iterator[Trial]:
    """Yield the trial of every finished run of a study."""
    folders = sorted(path.parent for path in Path(folder).glob(f"*/{RESULT}"))
    if not folders:
        repair = "fingerslip run computes them"
        raise InputError(str(folder), "has no finished runs", "needs the folder of the results of a study", repair)
    for path in folders:
        result, history = stored_result(path), read_history(path / HISTORY)
        conditions = _conditions({**result.swept, **result.sampled})
        yield simulated_trial(path.name, history, seed=seed + zlib.crc32(path.name.encode()), conditions=conditions)


def _conditions(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return what was swept and sampled, groups of values too, as conditions in SI units, by the last part of its path.

    A value of the sensor that is a condition has the last two parts of its path as its name.
    """
    conditions: dict[str, Any] = {}
    for path, value in values.items():
        name, of_sensor = path.rpartition(".")[2], "_".join(path.split(".")[-2:])
        if isinstance(value, Mapping):
            conditions |= _conditions({f"{path}.{entry}": inner for entry, inner in value.items()})
        elif name in ("static", "friction_coefficient"):
            conditions["friction_coefficient"] = float(value)
        elif name == "sample":
            conditions["repeat"] = int(value)
        elif name == "mass":
            conditions["mass"] = parse_quantity(value, "kg", where=path)
        elif path.startswith("tactip.") and of_sensor in CONDITIONS:
            unit = CONDITIONS[of_sensor]
            conditions[of_sensor] = value if unit == "1" else parse_quantity(value, unit, where=path)
        elif isinstance(value, int | float):
            conditions[name] = value
    return conditions


def _after_press(history: xr.Dataset) -> tuple[xr.Dataset, Floats]:
    """Return the markers from the first hold on, their time from 0, and the displacement of the plate then."""
    holds = phase_times(history, "hold")
    if not holds:
        raise InputError("history", "has no hold", "needs one after the press, in which the sensor rests")
    tracks = marker_tracks(history)
    for kind in ("internal", "external"):
        if not (tracks["kind"].values == kind).any():
            repair = "write record: {groups: [internal_markers, external_markers]} in the study"
            raise InputError("history", f"has no {kind} markers", "needs both kinds", repair)
    rows = np.flatnonzero(history["time"].values >= holds[0][0] - 1e-9)
    sliding = tracks.isel(time=rows)
    first = float(sliding["time"][0])
    plate: Floats = history["counterface_displacement"].values[rows, 0]
    return sliding.assign_coords(time=sliding["time"] - first).assign_attrs(start=first), plate
