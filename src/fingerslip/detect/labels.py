"""When a trial slips, from what a detector does not see: external markers, contact states, a marker on the plate."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.features import markers_of, rest_positions
from fingerslip.errors import InputError, ResultError, shorten
from fingerslip.storage.files import csv_text, plain_cell, write_text
from fingerslip.vision.tracks import seen, tracks_in_metres

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]

#: Names of the classes; the number of a class is its place.
CLASSES = ("no_slip", "incipient", "gross")
NO_SLIP, INCIPIENT, GROSS = range(3)

_COLUMNS = ("trial", "incipient_s", "gross_s")
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
        times = [time for time in (self.incipient, self.gross) if time is not None]
        return min(times) if times else None


def classes_at(onsets: Onsets, time: NDArray[np.float64]) -> NDArray[np.int8]:
    """Return the class of each time: gross slip from its onset on, incipient slip from its own until then.

    As in Cordova Bulens et al. 2023: what sticks again after gross slip has begun is still of the class gross.
    """
    classes = np.full(time.shape, NO_SLIP, dtype=np.int8)
    for number, onset in ((INCIPIENT, onsets.incipient), (GROSS, onsets.gross)):
        if onset is not None:
            classes[time >= onset] = number
    return classes


def write_onsets(onsets: Mapping[str, Onsets], path: str | Path, key: str = "trial") -> None:
    """Write the onsets of trials as CSV: columns ``trial``, ``incipient_s``, ``gross_s``, empty where there is none.

    The first column may have another name, as that of the labels of a trial by their source.
    """
    rows = ((name, onset.incipient, onset.gross) for name, onset in onsets.items())
    write_text(Path(path), csv_text([(key, *_COLUMNS[1:]), *rows]))


def read_onsets(path: str | Path) -> dict[str, Onsets]:
    """Read the onsets of trials from a CSV file as :func:`write_onsets` writes it; ``gross_s`` may be missing."""
    try:
        rows = csv.DictReader(io.StringIO(Path(path).read_text(encoding="utf-8-sig")), strict=True)
        names, records = list(rows.fieldnames or ()), list(rows)
    except OSError as error:
        raise InputError(str(path), f"cannot be read ({error.strerror})", "needs a CSV file of onset times") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(str(path), f"is no CSV ({shorten(str(error))})", "needs text in UTF-8") from error
    if set(names) - set(_COLUMNS) or not {"trial", "incipient_s"} <= set(names) or len(set(names)) < len(names):
        fault = shorten(f"has the columns {', '.join(map(str, names)) or 'none'}")
        raise InputError(str(path), fault, f"needs {', '.join(_COLUMNS)}", "write a first line with these names")
    onsets: dict[str, Onsets] = {}
    for line, row in enumerate(records, start=2):
        trial = plain_cell((row["trial"] or "").strip())
        if not trial or trial in onsets:
            problem = f"trial {trial!r} stands twice" if trial else "a row has no trial"
            raise InputError(str(path), problem, "needs each trial once", line=line)
        onsets[trial] = Onsets(*(seconds(row.get(name), f"{path}: {name}", line) for name in _COLUMNS[1:]))
    return onsets


def read_labels(path: str | Path) -> dict[str, Onsets]:
    """Read the labels of a trial back."""
    try:
        rows = list(csv.reader(io.StringIO(Path(path).read_text(encoding="utf-8"))))
    except (OSError, UnicodeDecodeError) as error:
        raise ResultError(f"{path}: cannot be read as labels; write the trial again") from error
    if not rows or rows[0] != ["source", *_COLUMNS[1:]] or any(len(row) != 3 for row in rows):
        raise InputError(str(path), "is no table of labels", "needs the columns source, incipient_s, gross_s")
    return {
        plain_cell(row[0]): Onsets(*(seconds(row[n], f"{path}: {_COLUMNS[n]}", line) for n in (1, 2)))
        for line, row in enumerate(rows[1:], start=2)
    }


def seconds(text: str | None, where: str, line: int | None = None) -> float | None:
    """Return a time that a cell holds [s]; None where the cell is empty."""
    if text is None or not text.strip():
        return None
    try:
        time = float(text)
    except ValueError:
        time = math.nan
    if not math.isfinite(time):
        raise InputError(where, f"got {shorten(repr(text))}", "needs seconds, or nothing where none is", line=line)
    return time


@dataclass(frozen=True)
class LabelSettings:
    """Thresholds on how far external markers go, as Cordova Bulens et al. 2023 print them."""

    incipient: float = 2.0  # of any external marker but the central one; with a plate marker: of the plate
    gross: float = 1.0  # of the central external marker; with a plate marker: relative to the plate
    units: str = "px"  # of both, px or m; tracks in px are turned into metres by their own scale where it is m
    rest_frames: int = 100  # frames at the start that are at rest
    sustained: int = 1  # frames in a row beyond a threshold, the first of which is the onset; 1 as published

    def __post_init__(self) -> None:
        for name in ("incipient", "gross", "rest_frames", "sustained"):
            if not getattr(self, name) > 0:
                raise InputError(f"labels: {name}", f"got {getattr(self, name)}", "needs a number > 0")
        if self.units not in ("px", "m"):
            raise InputError("labels: units", f"got {self.units!r}", "needs 'px' or 'm'")


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


def _first(time: Floats, beyond: NDArray[np.bool_], sustained: int = 1) -> float | None:
    """Return the first time from which `sustained` records in a row are true; None where there is none."""
    if len(beyond) < sustained:
        return None
    lasting = np.lib.stride_tricks.sliding_window_view(beyond, sustained).all(axis=1)
    return float(time[np.argmax(lasting)]) if lasting.any() else None
