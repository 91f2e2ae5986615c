"""Data sets from a lab's own recordings: a folder, a table of conditions, and labels where they are known."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from fingerslip.detect.folders import TRACK_FILES
from fingerslip.detect.labels import LabelSettings, Onsets, labels_from_external_markers, read_rows, times_of
from fingerslip.detect.trials import CONDITIONS, Trial
from fingerslip.errors import InputError, shorten
from fingerslip.libraries import xr
from fingerslip.storage.files import plain_cell
from fingerslip.units import parse_quantity
from fingerslip.vision.tracks import make_tracks, read_tracks, read_tracks_csv

#: Column of a table of conditions that names the recording of the outer camera.
EXTERNAL = "external"
#: Column that says of a whole recording whether there is slip in it, and its values.
SLIP, SLIP_WORD, NO_SLIP_WORD = "slip", "yes", "no"
# Recordings of two cameras that end farther apart than this [s] are not of one trial; they have to begin together.
_APART = 0.1
_NO_RING = -1
_SHOWN = {"m": "mm", "m/s": "mm/s", "rad": "deg", "Pa": "kPa"}  # units in which people write some others
_KEPT = ("frame_rate", "image_width", "image_height", "source", "warnings")
_HEADING = re.compile(r"\s*(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]+)\])?\s*")


def read_any_tracks(path: Path) -> xr.Dataset:
    """Read tracks from a CSV file or a netCDF file, by the ending of its name."""
    return read_tracks_csv(path) if path.suffix == ".csv" else read_tracks(path)


def read_conditions(path: str | Path) -> dict[str, dict[str, Any]]:
    """Read the conditions of trials from a CSV file, by the file of the recording."""
    conditions: dict[str, dict[str, Any]] = {}
    for line, row in enumerate(read_rows(path)[1], start=2):
        file = plain_cell((row.pop("file", None) or "").strip())
        if not file or file in conditions:
            problem = f"{file!r} stands twice" if file else "a row has no file"
            raise InputError(str(path), problem, "needs a column 'file' with each recording once", line=line)
        if None in row:
            raise InputError(str(path), "a row has more cells than there are names", "needs as many", line=line)
        conditions[file] = {}
        for heading, cell in row.items():
            match = _HEADING.fullmatch(heading or "")
            if match is None:
                allowed = "needs a name, or a name with a unit in brackets"
                raise InputError(str(path), f"has the column {heading!r}", allowed)
            if cell and cell.strip():
                value = _value(match["name"], match["unit"], cell.strip(), f"{path}: line {line}")
                conditions[file][match["name"]] = value
    if not conditions:
        raise InputError(str(path), "has no rows", "needs one for each recording")
    return conditions


def _value(name: str, unit: str | None, cell: str, where: str) -> Any:
    si = CONDITIONS.get(name, "")
    if si not in ("", "1"):
        try:
            return parse_quantity(f"{cell} {unit or ''}".strip(), si, where=f"{where}: {name}")
        except InputError as error:
            if not error.found.endswith("has no unit"):
                raise
            repair = f"write it in the first line, as in {name} [{_SHOWN.get(si, si)}]"
            raise InputError(error.where, error.found, error.allowed, repair) from None
    if unit is not None:
        allowed = ", ".join(condition for condition, its in CONDITIONS.items() if its not in ("", "1"))
        raise InputError(f"{where}: {name}", f"has the unit {unit}", f"takes none; units are known of {allowed}")
    if name == SLIP and cell not in (SLIP_WORD, NO_SLIP_WORD):
        raise InputError(f"{where}: {name}", f"got {shorten(repr(cell))}", f"needs {SLIP_WORD} or {NO_SLIP_WORD}")
    try:
        return float(cell)
    except ValueError:
        return cell


def recorded_trials(
    folder: str | Path,
    conditions: str | Path,
    onsets: Mapping[str, Onsets] = MappingProxyType({}),
    *,
    tracking: Mapping[str, Any] = MappingProxyType({}),
    external_tracking: Mapping[str, Any] = MappingProxyType({}),
) -> Iterator[Trial]:
    """Yield a trial for each recording, for :func:`fingerslip.detect.trials.write_trials`.

    `onsets` are labels of the user; both cameras are read by :func:`read_recording` with the options of each. Without
    `rest_frames` of the inner camera, outer markers rest as long as the inner ones are found to.
    """
    table = read_conditions(conditions)
    from fingerslip.detect.residual import frames_at_rest

    # All names are checked first: tracking the others takes long.
    for file, values in table.items():
        for name in (file, values.get(EXTERNAL)):
            if name is not None and not (Path(folder) / str(name)).exists():
                raise InputError(str(conditions), f"names {name}", f"needs files that are in {folder}")
    for file, values in table.items():
        path, outer = Path(folder) / file, values.pop(EXTERNAL, None)
        tracks, origin = read_recording(path, tracking), {"recording": file}
        wrong = [tracks.attrs.get("warnings")]
        if outer is not None:
            outside = read_recording(Path(folder) / str(outer), external_tracking)
            tracks = with_external(tracks, outside, str(outer))
            origin["external_recording"] = str(outer)
            wrong.append(outside.attrs.get("warnings"))
        if any(wrong):
            origin["warnings"] = "\n".join(filter(None, wrong))
        labels = {"user": onsets[path.stem]} if path.stem in onsets else {}
        _check_within(labels, float(tracks["time"].values[-1:].max(initial=0.0)), path.stem)
        if values.get(SLIP) == NO_SLIP_WORD:
            labels["user"] = Onsets(None, None)
        if (tracks["kind"].values.astype(str) == "external").sum() > 1:
            settings = LabelSettings(rest_frames=tracking.get("rest_frames") or frames_at_rest(tracks))
            labels["external_markers"] = labels_from_external_markers(tracks, settings)
        if not labels and SLIP not in values:
            allowed = "needs external markers in the tracks, a label of your own, or yes or no in a column 'slip'"
            unused = ", ".join(sorted(set(onsets) - {Path(name).stem for name in table}))
            repair = f"labels name {shorten(unused)}, as no trial here is named" if unused else ""
            raise InputError(f"trial {path.stem}", "has nothing to label it by", allowed, repair)
        yield Trial(path.stem, tracks, labels, values, origin)


def _check_within(labels: Mapping[str, Onsets], end: float, name: str) -> None:
    """Refuse onsets after the end [s] of a trial, such as milliseconds."""
    if (last := np.nan_to_num(times_of(labels.values())).max(initial=0.0)) > end:
        fault = f"has slip at {last:g} s, after its end at {end:.3g} s"
        raise InputError(f"labels: {name}", fault, "needs times within it", "write seconds of the clip")


def with_external(tracks: xr.Dataset, outer: xr.Dataset, where: str = "external") -> xr.Dataset:
    """Return the tracks of both cameras of a sensor in one dataset, at the times of the inner one.

    Both recordings have to begin together; their rates may differ. Attributes are those of the inner one: what is wrong
    with the other makes labels doubtful, not what a detector sees.
    """
    time, other = tracks["time"].values, outer["time"].values
    if abs((time[-1] - time[0]) - (other[-1] - other[0])) > _APART:
        fault = f"lasts {other[-1] - other[0]:.3g} s beside {time[-1] - time[0]:.3g} s"
        raise InputError(where, fault, "needs two recordings that begin and end together", "cut them to one length")
    if tracks["position"].attrs["units"] != outer["position"].attrs["units"]:
        raise InputError(where, f"is in {outer['position'].attrs['units']}", "needs the unit of the inner camera")
    from fingerslip.vision.cameras.camera import interpolate

    seen = interpolate(outer, time - time[0] + other[0])
    count, first = outer.sizes["marker"], int(tracks["marker"].max()) + 1
    ring = tracks["ring"].values if "ring" in tracks.variables else np.zeros(tracks.sizes["marker"], dtype=np.int64)
    return make_tracks(
        np.concatenate([tracks["position"].values, seen[:, :, : tracks.sizes["axis"]]], axis=1),
        time,
        units=str(tracks["position"].attrs["units"]),
        kind=["internal"] * tracks.sizes["marker"] + ["external"] * count,
        marker=np.concatenate([tracks["marker"].values, first + np.arange(count)]),
        # Markers outside are in no ring of the inner ones.
        ring=np.concatenate([ring, np.full(count, _NO_RING)]),
        attributes={name: tracks.attrs[name] for name in _KEPT if name in tracks.attrs},
    )


def read_recording(path: Path, tracking: Mapping[str, Any]) -> xr.Dataset:
    """Return the tracks of a recording: read where it is a file of tracks, else followed through the video.

    What is wrong with a video stands in the attribute ``warnings`` of its tracks.
    """
    if path.suffix in TRACK_FILES:
        return read_any_tracks(path)
    # The tracker is slow to load, and files of tracks do not need it.
    from fingerslip.vision.tracking.track import TrackingWarning, track_markers

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TrackingWarning)
        tracks = track_markers(path, **tracking)
    n_markers = tracking.get("n_markers")
    if n_markers is not None and tracks.sizes["marker"] != n_markers:
        fault = f"shows {tracks.sizes['marker']} markers"
        repair = "look at it with fingerslip track, or give another number"
        raise InputError(str(path), fault, f"needs {n_markers}", repair)
    # What only its quality page needs stays behind: data sets hold positions and qualities.
    return tracks.drop_vars([name for name in tracks.data_vars if name not in ("position", "quality")])
