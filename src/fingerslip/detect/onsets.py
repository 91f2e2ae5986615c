"""When slip begins in a trial, and files of onset times: labels of trials and what detectors submit."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError, shortened
from fingerslip.files import csv_text, plain_cell, write_text

__all__ = [
    "CLASSES",
    "GROSS",
    "INCIPIENT",
    "NO_SLIP",
    "Onsets",
    "classes_at",
    "read_onsets",
    "seconds",
    "write_onsets",
]

#: Names of the classes; the number of a class is its place.
CLASSES = ("no_slip", "incipient", "gross")
NO_SLIP, INCIPIENT, GROSS = range(3)

_COLUMNS = ("trial", "incipient_s", "gross_s")


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

    Examples
    --------
    >>> classes_at(Onsets(1.0, 3.0), np.array([0.0, 1.0, 2.0, 3.0])).tolist()
    [0, 1, 1, 2]
    """
    found = np.full(time.shape, NO_SLIP, dtype=np.int8)
    for number, onset in ((INCIPIENT, onsets.incipient), (GROSS, onsets.gross)):
        if onset is not None:
            found[time >= onset] = number
    return found


def write_onsets(onsets: Mapping[str, Onsets], path: str | Path) -> None:
    """Write the onsets of trials as CSV: columns ``trial``, ``incipient_s``, ``gross_s``, empty where there is none.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    rows = ((trial, _text(one.incipient), _text(one.gross)) for trial, one in onsets.items())
    write_text(Path(path), csv_text([_COLUMNS, *rows]))


def read_onsets(path: str | Path) -> dict[str, Onsets]:
    """Read the onsets of trials from a CSV file as :func:`write_onsets` writes it; ``gross_s`` may be missing."""
    rows = _rows(Path(path))
    found: dict[str, Onsets] = {}
    for line, row in enumerate(rows, start=2):
        trial = plain_cell((row["trial"] or "").strip())
        if not trial or trial in found:
            problem = f"trial {trial!r} stands twice" if trial else "a row has no trial"
            raise InputError(str(path), problem, "needs each trial once", line=line)
        incipient, gross = (seconds(row.get(name), f"{path}: {name}", line) for name in _COLUMNS[1:])
        found[trial] = Onsets(incipient, gross)
    return found


def _rows(path: Path) -> list[dict[str, str | None]]:
    try:
        rows = csv.DictReader(io.StringIO(path.read_text(encoding="utf-8-sig")), strict=True)
        names, found = tuple(rows.fieldnames or ()), list(rows)
    except OSError as error:
        raise InputError(str(path), f"cannot be read ({error.strerror})", "needs a CSV file of onset times") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(str(path), f"is no CSV ({shortened(str(error))})", "needs text in UTF-8") from error
    if set(names) - set(_COLUMNS) or not {"trial", "incipient_s"} <= set(names) or len(set(names)) < len(names):
        raise InputError(
            str(path),
            shortened(f"has the columns {', '.join(map(str, names)) or 'none'}"),
            f"needs {', '.join(_COLUMNS)}",
            "write a first line with these names",
        )
    return found


def seconds(text: str | None, where: str, line: int | None = None) -> float | None:
    """Return a time that a cell holds [s]; None where the cell is empty.

    Raises
    ------
    InputError
        Where it is no finite number.
    """
    if text is None or not text.strip():
        return None
    try:
        time = float(text)
    except ValueError:
        time = math.nan
    if not math.isfinite(time):
        raise InputError(where, f"got {shortened(repr(text))}", "needs seconds, or nothing where none is", line=line)
    return time


def _text(time: float | None) -> str:
    return "" if time is None else repr(float(time))
