"""When a trial slips, from what a detector does not see: external markers, contact states, a marker on the plate."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats
from fingerslip.detect.features import markers_of, rest_positions
from fingerslip.errors import InputError, shorten
from fingerslip.libraries import xr
from fingerslip.parameters import Number, parameters
from fingerslip.storage.files import csv_text, plain_cell, write_text
from fingerslip.vision.tracks import seen, tracks_in_metres

#: Names of the classes; the number of a class is its place.
CLASSES = ("no_slip", "incipient", "gross")
NO_SLIP, INCIPIENT, GROSS = range(3)

_COLUMNS = ("incipient_s", "gross_s")
_SLIPPING = 0.05  # share of a simulated contact that is incipient slip


@dataclass(frozen=True)
class Onsets:
    """When slip begins in a trial."""

    incipient: float | None  # when part of the contact begins to slip [s]
    gross: float | None  # when all of it slips [s]

    def __post_init__(self) -> None:
        for name, time in (("incipient", self.incipient), ("gross", self.gross)):
            if time is not None and not math.isfinite(time):
                raise InputError(f"onsets: {name}", f"got {time}", "needs a time in seconds, or None where none is")

    @property
    def first(self) -> float | None:
        """The earlier of the two [s]; None where there is no slip."""
        return min((time for time in (self.incipient, self.gross) if time is not None), default=None)


def classes_at(onsets: Onsets, time: Floats) -> NDArray[np.int8]:
    """Return the class of each time: gross slip from its onset on, incipient slip from its own until then.

    As in Cordova Bulens et al. 2023: what sticks again after gross slip has begun is still of the class gross.
    """
    classes = np.full(time.shape, NO_SLIP, dtype=np.int8)
    for number, onset in ((INCIPIENT, onsets.incipient), (GROSS, onsets.gross)):
        classes[time >= (math.inf if onset is None else onset)] = number
    return classes


def times_of(onsets: Iterable[Onsets]) -> Floats:
    """Return onsets as times (n, 2) [s], NaN where there is none."""
    return np.array([(entry.incipient, entry.gross) for entry in onsets], dtype=np.float64).reshape(-1, 2)


def onsets_of(times: Floats) -> list[Onsets]:
    """Return the onsets that :func:`times_of` made times (n, 2) of."""
    return [Onsets(*(None if math.isnan(time) else time for time in row)) for row in times.tolist()]


def write_onsets(onsets: Mapping[str, Onsets], path: str | Path, key: str = "trial") -> None:
    """Write the onsets of trials as CSV: columns ``trial``, ``incipient_s``, ``gross_s``, empty where there is none.

    The first column may have another name, as that of the labels of a trial by their source.
    """
    rows = ((name, onset.incipient, onset.gross) for name, onset in onsets.items())
    write_text(Path(path), csv_text([(key, *_COLUMNS), *rows]))


def read_rows(path: str | Path) -> tuple[list[str], list[dict[str | None, Any]]]:
    """Return the names in the first line of a CSV file, and its rows by these."""
    try:
        rows = csv.DictReader(io.StringIO(Path(path).read_text(encoding="utf-8-sig")), strict=True)
        return list(rows.fieldnames or ()), list(rows)
    except OSError as error:
        raise InputError(str(path), f"cannot be read ({error.strerror})", "needs a CSV file") from error
    except (UnicodeDecodeError, csv.Error) as error:
        fault = f"is no CSV ({shorten(str(error))})"
        raise InputError(str(path), fault, "needs text in UTF-8 with a first line of names") from error


def read_onsets(path: str | Path, key: str = "trial") -> dict[str, Onsets]:
    """Read onsets from a CSV file as :func:`write_onsets` writes it; of trials, ``gross_s`` may be missing."""
    needed, (names, records) = (key, *_COLUMNS), read_rows(path)
    required = needed if key == "source" else needed[:2]
    if set(names) - set(needed) or not set(required) <= set(names) or len(set(names)) < len(names):
        fault = shorten(f"has the columns {', '.join(map(str, names)) or 'none'}")
        repair = "write a first line with these names; yes or no alone is for slip in the conditions"
        raise InputError(str(path), fault, f"needs {', '.join(needed)}", repair)
    onsets: dict[str, Onsets] = {}
    for line, row in enumerate(records, start=2):
        if None in row or None in row.values():
            raise InputError(str(path), "a row has another number of cells", f"needs {len(names)}", line=line)
        name = plain_cell((row[key] or "").strip())
        if not name or name in onsets:
            problem = f"{key} {name!r} stands twice" if name else f"a row has no {key}"
            raise InputError(str(path), problem, f"needs each {key} once", line=line)
        times = []
        for column in _COLUMNS:
            text = row.get(column) or ""
            try:
                times.append(float(text) if text.strip() else None)
            except ValueError:
                times.append(math.nan)
            if times[-1] is not None and not math.isfinite(times[-1]):
                allowed = "needs seconds, or nothing where none is"
                raise InputError(f"{path}: {column}", f"got {shorten(repr(text))}", allowed, line=line)
        onsets[name] = Onsets(*times)
    return onsets


@parameters
class LabelSettings:
    """Thresholds on how far external markers go, as Cordova Bulens et al. 2023 print them."""

    # Of any external marker but the central one; with a plate marker: of the plate.
    incipient: Annotated[Number, pydantic.Field(gt=0)] = 2.0
    # Of the central external marker; with a plate marker: relative to the plate.
    gross: Annotated[Number, pydantic.Field(gt=0)] = 1.0
    units: Literal["px", "m"] = "px"  # of both; where it is m, tracks in px are turned into metres by their own scale
    rest_frames: pydantic.PositiveInt = 100  # frames at the start that are at rest
    sustained: pydantic.PositiveInt = 1  # frames in a row beyond a threshold, the first is the onset; 1 as published


def labels_from_external_markers(tracks: xr.Dataset, settings: LabelSettings | None = None) -> Onsets:
    """Return the onsets that external markers show, seen by a camera that moves with the plate."""
    settings = settings or LabelSettings()
    moved, central = _external_motion(tracks, settings)
    count = moved.shape[1]
    if count < 2:
        raise InputError("tracks", f"have {count} external marker", "needs a central one and others around it")
    distance, time = np.linalg.norm(moved, axis=2), tracks["time"].values
    others = np.delete(distance, central, axis=1)
    return Onsets(
        incipient=_first(time, np.any(others > settings.incipient, axis=1), settings.sustained),
        gross=_first(time, distance[:, central] > settings.gross, settings.sustained),
    )


def labels_from_plate(tracks: xr.Dataset, plate: xr.Dataset, settings: LabelSettings | None = None) -> Onsets:
    """Return the onsets of a plate that hangs on the sensor: when it begins to move, and when the skin stays behind.

    In the pouring task of Cordova Bulens et al. 2023 a marker on the plate is compared with the central external one.
    The plate moving with the skin is called incipient there; it is shear of the whole contact, not partial slip.
    """
    settings, time = settings or LabelSettings(), tracks["time"].values
    if plate.sizes["marker"] != 1 or not np.array_equal(plate["time"].values, time):
        fault = f"has {plate.sizes['marker']} markers at {plate.sizes['time']} times"
        raise InputError("plate", fault, f"needs one, at the {tracks.sizes['time']} times of the tracks")
    skin, central = _external_motion(tracks, settings)
    if not skin.shape[1]:
        raise InputError("tracks", "have no external marker that is seen at rest", "needs the central one")
    converted = _in_units(plate, settings).isel(axis=slice(0, 2))
    fall = (converted["position"].values - rest_positions(converted, settings.rest_frames))[:, 0]
    beside = np.linalg.norm(fall - skin[:, central], axis=1)
    return Onsets(
        incipient=_first(time, np.linalg.norm(fall, axis=1) > settings.incipient, settings.sustained),
        gross=_first(time, beside > settings.gross, settings.sustained),
    )


def labels_from_contact(time: Floats, stick_ratio: Floats) -> Onsets:
    """Return when a twentieth of a simulated contact slips, and all of it, by its stick ratio at times [s]."""
    times, ratio = np.asarray(time, dtype=float), np.asarray(stick_ratio, dtype=float)
    if times.ndim != 1 or times.shape != ratio.shape:
        raise InputError("stick_ratio", f"got shape {ratio.shape}", f"needs that of the times, {times.shape}")
    if (ratio < 0).any() or (ratio > 1).any():
        raise InputError("stick_ratio", f"got {np.nanmin(ratio):.6g} to {np.nanmax(ratio):.6g}", "needs 0 to 1, or NaN")
    # A comparison with NaN is false: what does not touch does not slip.
    return Onsets(_first(times, ratio <= 1.0 - _SLIPPING), _first(times, ratio <= 0.0))


def _external_motion(tracks: xr.Dataset, settings: LabelSettings) -> tuple[Floats, int]:
    """Return how external markers moved since rest, (n_times, n_markers, 2), and which of them is the central one.

    Those that are not seen at rest are left out; the unit is that of the thresholds.
    """
    external = markers_of(_in_units(tracks, settings), "external")
    at_rest = seen(external)[: settings.rest_frames].any(axis=0)
    external = external.isel(marker=np.flatnonzero(at_rest))
    rest = rest_positions(external, settings.rest_frames)
    central = int(np.argmin(np.linalg.norm(rest - rest.mean(axis=0), axis=1))) if len(rest) else 0
    return external["position"].values - rest, central


def _in_units(tracks: xr.Dataset, settings: LabelSettings) -> xr.Dataset:
    if settings.units == "m":
        return tracks_in_metres(tracks)
    if tracks["position"].attrs["units"] != "px":
        repair = "give thresholds in metres: LabelSettings(units='m')"
        raise InputError("labels", "thresholds are in px, tracks in m", "needs the same unit", repair)
    return tracks


def _first(time: Floats, beyond: Flags, sustained: int = 1) -> float | None:
    """Return the first time from which `sustained` records in a row are true; None where there is none."""
    if len(beyond) < sustained:
        return None
    lasting = np.lib.stride_tricks.sliding_window_view(beyond, sustained).all(axis=1)
    return float(time[np.argmax(lasting)]) if lasting.any() else None
