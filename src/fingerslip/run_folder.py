"""The folder of a run: its result as JSON beside its other files, with the checksums that prove all of them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, NotRequired

import pydantic
from typing_extensions import TypedDict

from fingerslip.digest import file_digest
from fingerslip.errors import DamagedError, ResultError
from fingerslip.files import read_json, write_json
from fingerslip.results import RunResult
from fingerslip.slip.events import events_from_mapping, events_mapping
from fingerslip.slip.front import EdgeContact
from fingerslip.slip.peaks import Peak

__all__ = [
    "HISTORY",
    "LOG",
    "RESULT",
    "RUN",
    "read_result",
    "result_from_mapping",
    "result_mapping",
    "stored_result",
    "unchecked_result",
    "write_result",
]

#: Files in the folder of a run.
HISTORY, RESULT, RUN, LOG = "history.nc", "events.json", "run.yaml", "log.txt"

_REPAIR = "run the study again"

_Number = pydantic.FiniteFloat | Annotated[int, pydantic.Field(ge=-(2**63), lt=2**63)]  # integers of any size otherwise


class _Edge(TypedDict):
    boundary: str
    time_s: pydantic.FiniteFloat
    distance_m: pydantic.FiniteFloat


class _Stored(TypedDict):
    """What the JSON of a run holds."""

    run: str
    identity: str
    swept: dict[str, Any]
    sampled: NotRequired[dict[str, Any]]
    events_s: dict[str, dict[str, pydantic.FiniteFloat | bool | None]]
    acceleration_peaks: list[dict[str, pydantic.FiniteFloat]]
    numbers: dict[str, _Number | None]
    edge_contact: _Edge | None
    mesh_hash: str
    mesh_size: pydantic.FiniteFloat
    wall_time_s: pydantic.FiniteFloat
    versions: dict[str, str]
    files: dict[str, str]


_STORED: pydantic.TypeAdapter[Any] = pydantic.TypeAdapter(_Stored)


def result_mapping(result: RunResult) -> dict[str, Any]:
    """Return a result as plain data for JSON, without what other files hold: its values and uncertainties."""
    return {
        "run": result.name,
        "identity": result.identity,
        "swept": dict(result.swept),
        **({"sampled": dict(result.sampled)} if result.sampled else {}),
        "events_s": events_mapping(result.events),
        "acceleration_peaks": [
            {"time_s": peak.time, "height_m_per_s2": peak.height, "prominence_m_per_s2": peak.prominence}
            for peak in result.peaks
        ],
        "numbers": dict(result.numbers),
        "edge_contact": _edge_mapping(result.edge),
        "mesh_hash": result.mesh_hash,
        "mesh_size": result.mesh_size,
        "wall_time_s": round(result.seconds, 3),
        "versions": dict(result.versions),
    }


def result_from_mapping(values: Mapping[str, Any]) -> RunResult:
    """Read a result back from plain data: the inverse of :func:`result_mapping`."""
    peaks = tuple(
        Peak(peak["time_s"], peak["height_m_per_s2"], peak["prominence_m_per_s2"])
        for peak in values["acceleration_peaks"]
    )
    return RunResult(
        name=values["run"],
        swept=dict(values["swept"]),
        events=events_from_mapping(values["events_s"]),
        peaks=peaks,
        numbers=dict(values["numbers"]),
        edge=_edge_from(values["edge_contact"]),
        identity=values["identity"],
        mesh_hash=values["mesh_hash"],
        mesh_size=values["mesh_size"],
        seconds=values["wall_time_s"],
        versions=dict(values["versions"]),
        sampled=dict(values.get("sampled", {})),
    )


def read_result(folder: Path, *, is_whole: bool = False) -> RunResult | None:
    """Read the result of a finished run from its folder, without its values and uncertainties."""
    try:
        return unchecked_result(folder) if is_whole else stored_result(folder)
    except ResultError:
        return None


def stored_result(folder: Path) -> RunResult:
    """Read the result of a finished run as :func:`read_result` does, and say what is wrong with a damaged one."""
    result, digests = _read_result(folder)
    for name, written in digests.items():
        _check_file(folder / name, written)
    return result


def unchecked_result(folder: Path) -> RunResult:
    """Read the result of a finished run without looking into its other files."""
    return _read_result(folder)[0]


def _read_result(folder: Path) -> tuple[RunResult, dict[str, str]]:
    """Return the result of a finished run, and the checksums of its files."""
    fault = "holds no finished run" if folder.is_dir() else "is not there"
    missing = ResultError(f"{folder}: {fault}; {_REPAIR}")
    try:
        values = read_json(folder / RESULT, _REPAIR, _STORED)
    except (FileNotFoundError, NotADirectoryError):
        raise missing from None
    if not (folder / HISTORY).exists():
        raise missing
    try:
        return result_from_mapping(values), dict(values["files"])
    except (KeyError, TypeError, ValueError):
        raise DamagedError(str(folder / RESULT), "is of another version", _REPAIR) from None


def write_result(result: RunResult, folder: Path) -> None:
    """Write a result into the folder of its run, with the checksums of the files that are there already."""
    # The log is written until the end.
    files = (file for file in sorted(folder.rglob("*")) if file.is_file() and file.name not in (RESULT, LOG))
    digests = {file.relative_to(folder).as_posix(): file_digest(file) for file in files}
    write_json(folder / RESULT, {**result_mapping(result), "files": digests})


def _check_file(file: Path, written: str) -> None:
    """Refuse a file that is missing or not as it was written."""
    try:
        is_whole = file_digest(file) == written
    except OSError as error:
        raise DamagedError(str(file), f"cannot be read ({error.strerror})", _REPAIR) from None
    if not is_whole:
        raise DamagedError(str(file), "is damaged: its checksum is another", _REPAIR)


def _edge_mapping(edge: EdgeContact | None) -> dict[str, Any] | None:
    return None if edge is None else {"boundary": edge.boundary, "time_s": edge.time, "distance_m": edge.distance}


def _edge_from(values: Mapping[str, Any] | None) -> EdgeContact | None:
    return None if values is None else EdgeContact(values["boundary"], values["time_s"], values["distance_m"])
