"""A data set as one Parquet table: a row for each frame, for learning code in any language."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerslip.detect.labels import CLASSES, Onsets, classes_at
from fingerslip.detect.optional import optional
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError
from fingerslip.files import new_file

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr

__all__ = ["write_parquet"]


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
