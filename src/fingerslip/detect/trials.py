"""A trial on disk: a folder with its tracks, labels, conditions and where it comes from."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerslip.detect.labels import Onsets, read_labels, write_labels
from fingerslip.errors import InputError, shorten
from fingerslip.storage.files import digest, read_json, write_json
from fingerslip.units import format_quantity
from fingerslip.vision.tracks import check_tracks, read_tracks, write_tracks

if TYPE_CHECKING:
    import xarray as xr

#: Conditions with a fixed meaning and their units; all are optional, and others may stand beside them.
CONDITIONS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "indentation": ("m", "how deep the sensor is pressed"),
        "direction": ("rad", "direction of the slide, from x to y"),
        "speed": ("m/s", "speed of the slide"),
        "travel": ("m", "length of the slide"),
        "friction_coefficient": ("1", "static friction coefficient"),
        "friction_decay_speed": ("m/s", "slip rate over which friction falls"),
        "load_rate": ("N/s", "how fast the load on a plate grows that hangs on the sensor"),
        "tilt": ("rad", "tilt of the plate along the slide"),
        "skin_youngs_modulus": ("Pa", "Young's modulus of the skin"),
        "gel_youngs_modulus": ("Pa", "Young's modulus of the gel"),
        "dome_radius": ("m", "radius of the dome"),
        "dome_height": ("m", "from the lowest point of the sensor to its window"),
        "ridges_height": ("m", "height of the ridges, from crown to valley"),
        "ridges_number": ("1", "number of ridges around the one on the axis"),
        "rods_length": ("m", "length of the rods inside the skin"),
        "rods_radius": ("m", "radius of the rods"),
        "repeat": ("1", "number of the repeat"),
        "seed": ("1", "seed of everything random in the trial"),
        "task": ("", "slide, hold or pour"),
    }
)

#: Units in which single values of these units are shown.
_SHOWN: Mapping[str, str] = MappingProxyType({"Pa": "kPa", "m": "mm"})
#: Files of a trial's folder.
FILES = ("tracks.nc", "labels.csv", "conditions.json", "provenance.json")

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")
_REPAIR = "write the trial again"


@dataclass(frozen=True)
class Trial:
    """One trial."""

    name: str  # name of its folder: letters, digits, ``.``, ``_`` and ``-``
    tracks: xr.Dataset  # its marker tracks
    labels: Mapping[str, Onsets]  # when it slips, by the source of the label
    conditions: Mapping[str, Any] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise InputError("trial", f"is named {shorten(repr(self.name))}", "needs letters, digits, '.', '_', '-'")
        check_tracks(self.tracks, f"trial {self.name}")
        check_conditions(self.conditions, f"trial {self.name}")


def check_conditions(conditions: Mapping[str, Any], where: str) -> None:
    """Check that conditions are plain values, those with a unit numbers."""
    for name, value in conditions.items():
        number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if not (number or (isinstance(value, str | bool | None) and not CONDITIONS.get(name, ("", ""))[0])):
            allowed = (
                "needs a finite number" if name in CONDITIONS else "needs a finite number, text, true, false or null"
            )
            raise InputError(f"{where}: {name}", f"got {shorten(repr(value))}", allowed)


def condition_text(name: str, value: str) -> str:
    """Return a condition in words, with its unit where that is known.

    Examples
    --------
    >>> condition_text("friction_decay_speed", "0.0001 to 0.0003")
    'friction decay speed: 0.0001 to 0.0003 m/s'
    >>> condition_text("gel_youngs_modulus", "2500")
    "gel Young's modulus: 2.5 kPa"
    >>> condition_text("dome_radius", "0.015")
    'dome radius: 15 mm'
    """
    unit, words = CONDITIONS.get(name, ("", ""))[0], name.replace("_", " ").replace("youngs", "Young's")
    if unit in _SHOWN and value.replace(".", "").replace("e+", "").isdecimal():
        return f"{words}: {format_quantity(float(value), unit, _SHOWN[unit])}"
    return f"{words}: {value}{f' {unit}' if unit not in {'', '1'} else ''}"


def layout_digest(tracks: xr.Dataset) -> str:
    """Return a hash of what trials of one data set have in common: unit of positions, markers, kinds and rings."""
    rings = tracks["ring"].values.astype(np.int64) if "ring" in tracks.variables else np.zeros(0, dtype=np.int64)
    kinds = [str(kind) for kind in tracks["kind"].values]
    return digest(tracks["position"].attrs["units"], kinds, tracks["marker"].values.astype(np.int64), rings)


def layout_text(tracks: xr.Dataset) -> str:
    """Return a layout in words, such as '81 internal and 19 external markers in px'."""
    kinds = tracks["kind"].values.astype(str)
    counts = [f"{(kinds == kind).sum()} {kind}" for kind in ("internal", "external") if (kinds == kind).any()]
    return f"{' and '.join(counts)} markers in {tracks['position'].attrs['units']}"


def write_trial(trial: Trial, folder: Path) -> None:
    """Write the files of a trial into a folder that exists."""
    write_tracks(trial.tracks, folder / "tracks.nc")
    write_labels(trial.labels, folder / "labels.csv")
    write_json(folder / "conditions.json", trial.conditions)
    write_json(folder / "provenance.json", json.loads(json.dumps(dict(trial.provenance))))


def read_trial(folder: Path) -> Trial:
    """Read a trial back."""
    conditions, provenance = (read_json(folder / name, _REPAIR) for name in FILES[2:])
    labels = read_labels(folder / "labels.csv")
    return Trial(folder.name, read_tracks(folder / "tracks.nc"), labels, conditions, provenance)
