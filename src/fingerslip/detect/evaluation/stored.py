"""What classifiers say of trials, stored beside the tables of an evaluation."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fingerslip.detect.evaluation.page import Judged
from fingerslip.detect.folders import JUDGED
from fingerslip.detect.labels import Onsets
from fingerslip.errors import DamagedError, shorten
from fingerslip.storage.files import new_file

_PARTS = ("matrix", "slip", "slips", "events")


def write_judged(judged: Mapping[str, Judged], labels: Mapping[str, Onsets], folder: Path) -> None:
    """Write what classifiers say of trials, and the labels of these, into a folder."""
    arrays: dict[str, Any] = {"classifiers": np.array(list(judged)), "trials": np.array(list(labels))}
    arrays["labels"] = _times(labels)
    for number, entry in enumerate(judged.values()):
        events = {trial: entry.events[trial] for trial in labels}
        values = (entry.matrix, entry.slip, entry.slips, _times(events))
        arrays |= {f"{part}-{number}": array for part, array in zip(_PARTS, values, strict=True)}
    with new_file(folder / JUDGED) as partial, partial.open("wb") as file:
        np.savez_compressed(file, **arrays)


def read_judged(folder: Path) -> tuple[dict[str, Judged], dict[str, Onsets]]:
    """Read back what classifiers say of trials, by classifier, and the labels by trial."""
    path = folder / JUDGED
    try:
        # Arrays alone are read, so that nothing runs.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            trials = stored["trials"].tolist()
            judged = {}
            for number, name in enumerate(stored["classifiers"].tolist()):
                matrix, slip, slips, events = (stored[f"{part}-{number}"] for part in _PARTS)
                judged[name] = Judged(matrix, slip, slips, _onsets(trials, events))
            return judged, _onsets(trials, stored["labels"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        fault = f"cannot be read ({shorten(str(error))})"
        raise DamagedError(str(path), fault, "run fingerslip detect evaluate again") from error


def _times(onsets: Mapping[str, Onsets]) -> Any:
    """Return onsets as (n_trials, 2) [s], NaN where there is none."""
    return np.array([[entry.incipient, entry.gross] for entry in onsets.values()], dtype=np.float64).reshape(-1, 2)


def _onsets(trials: list[str], times: Any) -> dict[str, Onsets]:
    rows = [[None if math.isnan(time) else time for time in row] for row in times.tolist()]
    return {trial: Onsets(*row) for trial, row in zip(trials, rows, strict=True)}
