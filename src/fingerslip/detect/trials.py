"""Trials, a folder each, and data sets of them: checksums of every file, a data card, and one table of all."""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from fingerslip.detect.classifiers import optional
from fingerslip.detect.labels import CLASSES, Onsets, classes_at, read_onsets, write_onsets
from fingerslip.errors import DamagedError, InputError, shorten
from fingerslip.libraries import xr
from fingerslip.storage.files import (
    check_digests,
    check_replaceable,
    digest,
    file_digest,
    new_file,
    new_folder,
    read_json,
    write_json,
    write_text,
    writing,
)
from fingerslip.units import format_quantity
from fingerslip.version import __version__
from fingerslip.vision.tracks import check_tracks, read_tracks, write_tracks

#: Units of conditions with a fixed meaning; all are optional, and others may stand beside them.
CONDITIONS: Mapping[str, str] = MappingProxyType(
    {
        "indentation": "m",  # how deep the sensor is pressed
        "direction": "rad",  # of the slide, from x to y
        "speed": "m/s",  # of the slide
        "travel": "m",  # length of the slide
        "friction_coefficient": "1",  # static
        "friction_decay_speed": "m/s",  # slip rate over which friction falls
        "rest": "s",  # at the start of the film
        "load_rate": "N/s",  # how fast the load on a plate grows that hangs on the sensor
        "tilt": "rad",  # of the plate along the slide
        "skin_youngs_modulus": "Pa",
        "gel_youngs_modulus": "Pa",
        "dome_radius": "m",
        "dome_height": "m",  # from the lowest point of the sensor to its window
        "ridges_height": "m",  # from crown to valley
        "ridges_number": "1",  # around the one on the axis
        "rods_length": "m",  # inside the skin
        "rods_radius": "m",
        "repeat": "1",  # its number
        "seed": "1",  # of everything random in the trial
        "task": "",  # slide, hold or pour
    }
)

#: Units in which single values of these units are shown.
_SHOWN: Mapping[str, str] = MappingProxyType({"Pa": "kPa", "m": "mm"})
#: Files of a trial's folder, and the one of a data set that names them.
FILES, MANIFEST = ("tracks.nc", "labels.csv", "conditions.json", "provenance.json"), "manifest.json"
_FORMAT, _REPAIR = 1, "write the data set again"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")


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
        for name, value in self.conditions.items():
            number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
            if not (number or (isinstance(value, str | bool | None) and not CONDITIONS.get(name))):
                allowed = f"needs a finite number{'' if name in CONDITIONS else ', text, true, false or null'}"
                raise InputError(f"trial {self.name}: {name}", f"got {shorten(repr(value))}", allowed)


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
    unit, words = CONDITIONS.get(name, ""), name.replace("_", " ").replace("youngs", "Young's")
    if unit in _SHOWN and value.replace(".", "").replace("e+", "").isdecimal():
        return f"{words}: {format_quantity(float(value), unit, _SHOWN[unit])}"
    return f"{words}: {value}{f' {unit}' if unit not in {'', '1'} else ''}"


def layout_digest(tracks: xr.Dataset) -> str:
    """Return a hash of what trials of one data set have in common: unit of positions, markers, kinds and rings."""
    rings = tracks["ring"].values.astype(np.int64) if "ring" in tracks.variables else np.zeros(0, dtype=np.int64)
    kinds = [str(kind) for kind in tracks["kind"].values]
    return digest(tracks["position"].attrs["units"], kinds, tracks["marker"].values.astype(np.int64), rings)


def layout_text(tracks: xr.Dataset) -> str:
    """Return a layout in words, such as '7 internal and 1 external markers (rings of 1 and 6) in px'."""
    kinds = tracks["kind"].values.astype(str)
    counts = {kind: (kinds == kind).sum() for kind in ("internal", "external") if (kinds == kind).any()}
    rings, words = "no rings", " and ".join(f"{count} {kind}" for kind, count in counts.items())
    if "ring" in tracks.variables:
        numbers = tracks["ring"].values[kinds == next(iter(counts))]
        sizes = np.unique(numbers[numbers >= 0], return_counts=True)[1]  # others have no ring
        rings = f"rings of {' and '.join(', '.join(map(str, sizes)).rsplit(', ', 1))}" if sizes.size else rings
    return f"{words} markers ({rings}) in {tracks['position'].attrs['units']}"


def write_trial(trial: Trial, folder: Path) -> None:
    """Write the files of a trial into a folder that exists."""
    write_tracks(trial.tracks, folder / "tracks.nc")
    write_onsets(trial.labels, folder / "labels.csv", key="source")
    write_json(folder / "conditions.json", trial.conditions)
    write_json(folder / "provenance.json", json.loads(json.dumps(dict(trial.provenance))))


def read_trial(folder: Path) -> Trial:
    """Read a trial back."""
    tracks, labels = read_tracks(folder / FILES[0]), read_onsets(folder / FILES[1], "source")
    conditions, provenance = (read_json(folder / name, "write the trial again") for name in FILES[2:])
    return Trial(folder.name, tracks, labels, conditions, provenance)


@dataclass(frozen=True)
class TrialSet:
    """A data set that is open: what its manifest says, and trials that are read when they are asked for."""

    folder: Path
    names: tuple[str, ...]  # names of its trials, sorted
    conditions: Mapping[str, Mapping[str, Any]]  # conditions of every trial
    digest: str  # hash of all of its files
    title: str

    def trial(self, name: str) -> Trial:
        """Read a trial."""
        return read_trial(self.folder / name)

    def tracks(self, name: str) -> xr.Dataset:
        """Read the tracks of a trial."""
        return read_tracks(self.folder / name / FILES[0])

    def labels(self, name: str) -> dict[str, Onsets]:
        """Read the labels of a trial, by source."""
        return read_onsets(self.folder / name / FILES[1], "source")

    def onsets(self, source: str = "external_markers") -> dict[str, Onsets]:
        """Read the labels of one source for all trials; raise InputError where a trial has none of that source."""
        result = {name: self.labels(name) for name in self.names}
        for name, labels in result.items():
            if source not in labels:
                repair = f"write --labels {min(labels)}" if labels else ""
                if "slip" in self.conditions[name]:
                    repair = "ask of whole trials: fingerslip detect evaluate --whole"
                fault, allowed = f"has no labels {source!r}", f"has {', '.join(labels) or 'none'}"
                raise InputError(f"{self.folder}: {name}", fault, allowed, repair)
        return {name: labels[source] for name, labels in result.items()}


def write_trials(trials: Iterable[Trial | Path], folder: str | Path, title: str, notes: str = "") -> TrialSet:
    """Write trials one by one as a data set, whole or not at all; one that is in the folder is replaced when this is.

    Of a trial that is written already, its folder is given, and stays. The data card says the title first; notes say
    limits and sources.
    """
    folder = Path(folder)
    check_replaceable(folder, MANIFEST)
    entries: dict[str, dict[str, Any]] = {}
    layouts: dict[str, str] = {}
    with new_folder(folder) as unfinished:
        for source in trials:
            trial = read_trial(source) if isinstance(source, Path) else source
            layouts[layout_digest(trial.tracks)] = layout_text(trial.tracks)
            if len({words.rsplit(maxsplit=1)[1] for words in layouts.values()}) > 1:
                fault, allowed = f"has {layouts.popitem()[1]}", f"needs the unit of {next(iter(layouts.values()))}"
                raise InputError(f"trial {trial.name}", fault, allowed, "convert it")
            if trial.name in entries:
                raise InputError(f"trial {trial.name}", "stands twice", "needs each name once")
            with writing(folder):
                (unfinished / trial.name).mkdir()
                if isinstance(source, Path):
                    for file in FILES:
                        _link(source / file, unfinished / trial.name / file)
                else:
                    write_trial(trial, unfinished / trial.name)
            entries[trial.name] = {
                "conditions": dict(trial.conditions),
                "labels": sorted(trial.labels),
                "frames": trial.tracks.sizes["time"],
                "files": {name: file_digest(unfinished / trial.name / name) for name in FILES},
            }
        if not layouts:
            raise InputError("trials", "got none", "needs at least one")
        manifest = {
            "format": _FORMAT,
            "title": title,
            "version": __version__,
            # Of trials with different layouts there is none; what needs no layout can learn from them.
            "layout": next(iter(layouts)) if len(layouts) == 1 else "",
            "layout_in_words": "; ".join(dict.fromkeys(layouts.values())),
            "trials": dict(sorted(entries.items())),
        }
        write_json(unfinished / MANIFEST, manifest)
        write_text(unfinished / "README.md", _card(manifest, notes))
    return open_trials(folder)


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:  # not every file system can
        shutil.copy2(source, target)


def open_trials(folder: str | Path) -> TrialSet:
    """Open a data set; its trials are read when they are asked for."""
    path = Path(folder)
    try:
        manifest = read_json(path / MANIFEST, _REPAIR)
    except FileNotFoundError:
        repair = "fingerslip detect collect makes one of recordings"
        raise InputError(str(path), f"has no {MANIFEST}", "needs the folder of a data set", repair) from None
    if manifest.get("format") != _FORMAT:
        raise DamagedError(str(path / MANIFEST), f"has the format {manifest.get('format')}, not {_FORMAT}", _REPAIR)
    entries: dict[str, Any] = manifest["trials"]
    present = {entry.name for entry in path.iterdir() if entry.is_dir() and not entry.name.startswith(".")}
    for name in sorted(present ^ set(entries)):
        fault = f"is in the folder, not in {MANIFEST}" if name in present else f"is in {MANIFEST}, not in the folder"
        raise DamagedError(str(path / name), fault, _REPAIR)
    for name, entry in entries.items():
        check_digests(path / name, entry["files"], f"is not the file of {MANIFEST}", _REPAIR)
    conditions = {name: entry["conditions"] for name, entry in entries.items()}
    whole = digest({name: entry["files"] for name, entry in entries.items()})
    return TrialSet(path, tuple(sorted(entries)), conditions, whole, manifest["title"])


def check_labels(
    onsets: Mapping[str, Onsets], names: Sequence[str], needed: Sequence[str] = ("incipient", "gross")
) -> None:
    """Check that trials have the labels that learning needs: both onsets, or none."""
    for name in names:
        if name not in onsets:
            raise InputError("labels", f"have no trial {name}", "needs every trial of the data set")
        for event in needed:
            # A trial without any slip is a negative.
            if getattr(onsets[name], event) is None and onsets[name].first is not None:
                repair = "leave the trial out, or slide it farther"
                raise InputError(f"trial {name}", f"has no {event} slip", "needs both onsets here", repair)


def _card(manifest: Mapping[str, Any], notes: str) -> str:
    entries = manifest["trials"]
    frames = [entry["frames"] for entry in entries.values()]
    rows = []
    for name in dict.fromkeys(name for entry in entries.values() for name in entry["conditions"]):
        values = {entry["conditions"].get(name) for entry in entries.values()}
        numbers = [value for value in values if isinstance(value, int | float)]
        texts = [f"{value:.6g}" if isinstance(value, float) else str(value) for value in values]
        if len(numbers) == len(values) > 8:
            texts = [f"{len(values)} values from {min(numbers):.6g} to {max(numbers):.6g}"]
        rows.append(f"| {name} | {shorten(', '.join(sorted(texts)))} |")
    lines = [
        f"# {manifest['title']}",
        "",
        f"{len(entries)} trials with {manifest['layout_in_words']}; {min(frames)} to {max(frames)} frames each.",
        f"Written by fingerslip {manifest['version']}.",
        "",
        "| condition | values |",
        "|---|---|",
        *rows,
        "",
        f"Labels by source: {', '.join(sorted({label for entry in entries.values() for label in entry['labels']}))}.",
        "",
        "Each trial is a folder: `tracks.nc` (positions of the markers), `labels.csv` (onsets of slip),",
        "`conditions.json` (SI units) and `provenance.json`. `manifest.json` has the SHA-256 of each file.",
    ]
    return "\n".join([*lines, *(["", notes] if notes else [])]) + "\n"


def write_parquet(trials: TrialSet, path: str | Path) -> None:
    """Write a data set as one Parquet file, a row group for each trial, whole or not at all.

    Columns: ``trial``, ``time_s``, ``class`` by the external markers, every condition, and for each marker
    ``internal_0_x`` and so on in the unit of the tracks, null where it was not seen.
    """
    arrow, parquet = optional("pyarrow"), optional("pyarrow.parquet")
    labels, texts = trials.onsets(), {"trial": arrow.string(), "class": arrow.string()}
    of_arrow: Any = {float: arrow.float64(), int: arrow.float64(), str: arrow.string(), bool: arrow.bool_()}
    kinds = {}
    for condition in dict.fromkeys(name for values in trials.conditions.values() for name in values):
        python = {type(values.get(condition)) for values in trials.conditions.values()} - {type(None)}
        kinds[condition], *others = {of_arrow[entry] for entry in python} or {arrow.float64()}
        if others:
            raise InputError(f"{trials.folder}: condition {condition}", "mixes kinds", "needs one kind in all trials")
    types = texts | {f"condition_{condition}": kind for condition, kind in kinds.items()}
    with new_file(Path(path)) as unfinished, contextlib.ExitStack() as stack:
        writer: Any = None
        for name in trials.names:
            columns = _frames(name, trials.tracks(name), labels[name])
            values, rows = trials.conditions[name], len(columns["time_s"])
            columns |= {f"condition_{condition}": [values.get(condition)] * rows for condition in kinds}
            schema = arrow.schema([(column, types.get(column, arrow.float64())) for column in columns])
            if writer is None:
                writer = stack.enter_context(parquet.ParquetWriter(unfinished, schema, compression="zstd"))
            writer.write_table(arrow.table(columns, schema=schema))


def _frames(name: str, tracks: xr.Dataset, onsets: Onsets) -> dict[str, Any]:
    """Return the columns of the frames of a trial, positions masked where a marker was not seen."""
    time, position = tracks["time"].values, tracks["position"].values
    markers = [f"{kind}_{marker}" for kind, marker in zip(tracks["kind"].values, tracks["marker"].values, strict=True)]
    names = [f"{marker}_{axis}" for marker in markers for axis in tracks["axis"].values]
    return {
        "trial": [name] * len(time),
        "time_s": time,
        "class": [CLASSES[number] for number in classes_at(onsets, time)],
        **dict(zip(names, np.ma.masked_invalid(position.reshape(len(time), -1).T), strict=True)),
    }
