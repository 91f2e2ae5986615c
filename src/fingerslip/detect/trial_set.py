"""Data sets of trials: a folder for each trial, checksums of every file, a data card, and one table of all."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerslip.detect.labels import CLASSES, Onsets, classes_at, read_labels
from fingerslip.detect.optional import optional
from fingerslip.detect.trials import FILES, Trial, layout_digest, layout_text, read_trial, write_trial
from fingerslip.errors import DamagedError, InputError, ResultError, shorten
from fingerslip.storage.files import (
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
from fingerslip.version import __version__
from fingerslip.vision.tracks import read_tracks

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "MANIFEST",
    "TrialSet",
    "check_labels",
    "common_layout",
    "gather_trials",
    "open_trials",
    "write_parquet",
    "write_trials",
]


MANIFEST = "manifest.json"
_FORMAT = 1
_REPAIR = "write the data set again"


@dataclass(frozen=True)
class TrialSet:
    """A data set that is open: what its manifest says, and trials that are read when they are asked for."""

    folder: Path  # its folder
    names: tuple[str, ...]  # names of its trials, sorted
    conditions: Mapping[str, Mapping[str, Any]]  # conditions of every trial
    layout: str  # hash of the markers' layout
    digest: str  # hash of all of its files
    title: str  # what it is

    def trial(self, name: str) -> Trial:
        """Read a trial."""
        return read_trial(self.folder / name)

    def tracks(self, name: str) -> xr.Dataset:
        """Read the tracks of a trial."""
        return read_tracks(self.folder / name / FILES[0])

    def labels(self, name: str) -> dict[str, Onsets]:
        """Read the labels of a trial, by source."""
        return read_labels(self.folder / name / FILES[1])

    def onsets(self, source: str = "external_markers") -> dict[str, Onsets]:
        """Read the labels of one source for all trials.

        Raises
        ------
        InputError
            Where a trial has none of that source.
        """
        result = {name: self.labels(name) for name in self.names}
        for name, labels in result.items():
            if source not in labels:
                raise InputError(f"{self.folder}: {name}", f"has no labels {source!r}", f"has {', '.join(labels)}")
        return {name: labels[source] for name, labels in result.items()}


def write_trials(trials: Iterable[Trial], folder: str | Path, title: str, notes: str = "") -> TrialSet:
    """Write trials one by one as a data set, whole or not at all.

    Parameters
    ----------
    trials : iterable of Trial
        The trials; a generator is taken one at a time.
    folder : path
        The folder; a data set of that name is replaced when the new one is whole.
    title, notes : str
        What the data card says first, and what it says of limits and sources.

    Raises
    ------
    InputError
        Where there are no trials, two have one name, or their layouts differ; where the folder holds something else.
    ResultError
        Where the folder cannot be written.
    """
    final = Path(folder)
    check_replaceable(final, MANIFEST)
    with new_folder(final) as partial:
        described = _Described()
        for trial in trials:
            described.add(trial)
            described.entries[trial.name] = _written(trial, partial / trial.name)
        described.write(partial, title, notes)
    return open_trials(final)


def gather_trials(folders: Sequence[Path], folder: str | Path, title: str, notes: str = "") -> TrialSet:
    """Make a data set of trials that are written already, whole or not at all; their own folders stay."""
    final = Path(folder)
    check_replaceable(final, MANIFEST)
    with new_folder(final) as partial:
        described = _Described()
        for source in folders:
            trial = read_trial(source)
            described.add(trial)
            with writing(final):
                shutil.copytree(source, partial / trial.name, copy_function=_link)
            described.entries[trial.name] = _entry(trial, partial / trial.name)
        described.write(partial, title, notes)
    return open_trials(final)


def _link(source: str, target: str) -> None:
    """Give a file a second name, or copy it where the file system cannot."""
    try:
        Path(target).hardlink_to(source)
    except OSError:
        shutil.copy2(source, target)


class _Described:
    """What the manifest says of trials, one by one."""

    def __init__(self) -> None:
        self.entries: dict[str, dict[str, Any]] = {}
        self._first: Trial | None = None

    def add(self, trial: Trial) -> None:
        """Refuse a trial that does not go with the others."""
        self._first = self._first or trial
        common_layout(self._first.name, self._first.tracks, trial.name, trial.tracks)
        if trial.name in self.entries:
            raise InputError(f"trial {trial.name}", "stands twice", "needs each name once")

    def write(self, folder: Path, title: str, notes: str) -> None:
        """Write manifest and data card."""
        if self._first is None:
            raise InputError("trials", "got none", "needs at least one")
        manifest = {
            "format": _FORMAT,
            "title": title,
            "version": __version__,
            "layout": layout_digest(self._first.tracks),
            "layout_in_words": layout_text(self._first.tracks),
            "trials": dict(sorted(self.entries.items())),
        }
        write_json(folder / MANIFEST, manifest)
        write_text(folder / "README.md", _card(manifest, notes))


def _written(trial: Trial, folder: Path) -> dict[str, Any]:
    folder.mkdir()
    write_trial(trial, folder)
    return _entry(trial, folder)


def _entry(trial: Trial, folder: Path) -> dict[str, Any]:
    return {
        "conditions": dict(trial.conditions),
        "labels": sorted(trial.labels),
        "frames": trial.tracks.sizes["time"],
        "files": {name: file_digest(folder / name) for name in FILES},
    }


def common_layout(first: str, tracks: xr.Dataset, second: str, other: xr.Dataset) -> None:
    """Check that two trials have one layout."""
    if layout_digest(tracks) != layout_digest(other):
        fault = (
            f"has {layout_text(other)}" if layout_text(other) != layout_text(tracks) else "has other markers or rings"
        )
        repair = "make a data set for each layout"
        raise InputError(f"trial {second}", fault, f"needs the layout of trial {first}: {layout_text(tracks)}", repair)


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
    _check_files(path, entries)
    conditions = {name: entry["conditions"] for name, entry in entries.items()}
    whole = digest({name: entry["files"] for name, entry in entries.items()})
    return TrialSet(path, tuple(sorted(entries)), conditions, manifest["layout"], whole, manifest["title"])


def _check_files(folder: Path, entries: Mapping[str, Any]) -> None:
    present = {path.name for path in folder.iterdir() if path.is_dir() and not path.name.startswith(".")}
    for name in sorted(present ^ set(entries)):
        fault = f"is in the folder, not in {MANIFEST}" if name in present else f"is in {MANIFEST}, not in the folder"
        raise DamagedError(str(folder / name), fault, _REPAIR)
    for name, entry in entries.items():
        for file, wanted in entry["files"].items():
            if _digest(folder / name / file) != wanted:
                raise DamagedError(str(folder / name / file), f"is not the file of {MANIFEST}", _REPAIR)


def _digest(path: Path) -> str:
    try:
        return file_digest(path)
    except OSError as error:
        raise ResultError(f"{path}: cannot be read ({error.strerror}); {_REPAIR}") from error


def check_labels(
    onsets: Mapping[str, Onsets], names: Sequence[str], needed: Sequence[str] = ("incipient", "gross")
) -> None:
    """Check that trials have the labels that learning needs."""
    for name in names:
        if name not in onsets:
            raise InputError("labels", f"have no trial {name}", "needs every trial of the data set")
        for event in needed:
            if getattr(onsets[name], event) is None:
                repair = "leave the trial out, or slide it farther"
                raise InputError(f"trial {name}", f"has no {event} slip", "needs both onsets here", repair)


def _card(manifest: Mapping[str, Any], notes: str) -> str:
    entries = manifest["trials"]
    frames = [entry["frames"] for entry in entries.values()]
    lines = [
        f"# {manifest['title']}",
        "",
        f"{len(entries)} trials with {manifest['layout_in_words']}; {min(frames)} to {max(frames)} frames each.",
        f"Written by fingerslip {manifest['version']}.",
        "",
        "| condition | values |",
        "|---|---|",
        *(f"| {name} | {text} |" for name, text in _ranges(entries)),
        "",
        f"Labels by source: {', '.join(sorted({label for entry in entries.values() for label in entry['labels']}))}.",
        "",
        "Each trial is a folder: `tracks.nc` (positions of the markers), `labels.csv` (onsets of slip),",
        "`conditions.json` (SI units) and `provenance.json`. `manifest.json` has the SHA-256 of each file.",
    ]
    return "\n".join([*lines, *(["", notes] if notes else [])]) + "\n"


def _ranges(entries: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for name in dict.fromkeys(name for entry in entries.values() for name in entry["conditions"]):
        values = {entry["conditions"].get(name) for entry in entries.values()}
        numbers = [value for value in values if isinstance(value, int | float)]
        if len(numbers) == len(values) > 8:
            yield name, f"{len(values)} values from {np.min(numbers):.6g} to {np.max(numbers):.6g}"
        else:
            texts = (f"{value:.6g}" if isinstance(value, float) else str(value) for value in values)
            yield name, shorten(", ".join(sorted(texts)))


def write_parquet(trials: TrialSet, path: str | Path, onsets: Mapping[str, Onsets] | None = None) -> None:
    """Write a data set as one Parquet file, a row group for each trial, whole or not at all.

    Parameters
    ----------
    trials : TrialSet
        The data set.
    path : path
        The file. Columns: ``trial``, ``time_s``, ``class`` (no_slip, incipient, gross), every condition, and for each
        marker ``internal_0_x`` and so on in the unit of the tracks, null where it was not seen.
    onsets : mapping of str to Onsets, optional
        Labels of the trials; those of the external markers without it.

    Raises
    ------
    InputError
        Where PyArrow is missing, or a column of conditions mixes text and numbers.
    ResultError
        Where the file cannot be written.
    """
    arrow, parquet = optional("pyarrow"), optional("pyarrow.parquet")
    labels = trials.onsets() if onsets is None else onsets
    names = list(dict.fromkeys(name for values in trials.conditions.values() for name in values))
    schema: Any = None
    with new_file(Path(path)) as partial:
        writer: Any = None
        try:
            for name in trials.names:
                columns = _frames(name, trials.tracks(name), labels[name])
                schema = schema or _schema(arrow, trials, names, columns)
                rows = len(columns["time_s"])
                columns |= {f"condition_{entry}": [trials.conditions[name].get(entry)] * rows for entry in names}
                writer = writer or parquet.ParquetWriter(partial, schema, compression="zstd")
                writer.write_table(arrow.table(columns, schema=schema))
        finally:
            if writer is not None:
                writer.close()


def _frames(name: str, tracks: xr.Dataset, onsets: Onsets) -> dict[str, Any]:
    time = tracks["time"].values
    columns: dict[str, Any] = {
        "trial": [name] * len(time),
        "time_s": time,
        "class": [CLASSES[number] for number in classes_at(onsets, time)],
    }
    for column, (marker, kind) in enumerate(zip(tracks["marker"].values, tracks["kind"].values, strict=True)):
        for axis, label in enumerate(tracks["axis"].values):
            values = tracks["position"].values[:, column, axis]
            columns[f"{kind}_{marker}_{label}"] = np.ma.masked_invalid(values)
    return columns


def _schema(arrow: Any, trials: TrialSet, names: list[str], columns: Mapping[str, Any]) -> Any:
    texts = {"trial", "class"}
    fields = [(name, arrow.string() if name in texts else arrow.float64()) for name in columns]
    return arrow.schema([*fields, *((f"condition_{name}", _type(arrow, trials, name)) for name in names)])


def _type(arrow: Any, trials: TrialSet, name: str) -> Any:
    values = [values.get(name) for values in trials.conditions.values()]
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int, float}:
        return arrow.float64()
    if kinds <= {str}:
        return arrow.string()
    if kinds <= {bool}:
        return arrow.bool_()
    raise InputError(f"{trials.folder}: condition {name}", "mixes text and numbers", "needs one kind in all trials")
