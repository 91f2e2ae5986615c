"""What a run and a study came to: slip events, peaks and measures, as data, and the folder of a run that holds them."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, NotRequired

import pydantic
from typing_extensions import TypedDict

from fingerslip.errors import DamagedError, ResultError
from fingerslip.libraries import xr
from fingerslip.parameters.words import describe_fields
from fingerslip.slip import measures
from fingerslip.slip.events import Events, events_from_mapping, events_mapping, find_slip
from fingerslip.slip.front import EdgeContact, edge_contact
from fingerslip.slip.measures import Number
from fingerslip.slip.receptors import Peak
from fingerslip.slip.windows import READINGS, TIMES, defines_time, event_label
from fingerslip.storage.files import check_digests, digest, file_digest, read_json, write_json
from fingerslip.uncertainty import Convergence

#: What the numbers of a sample and of a repeat are called among the swept values of a run.
SAMPLE, REPEAT = "sample", "repeat"
#: Formats for other programs.
FORMATS = ("csv", "json", "mat", "nwb", "parquet", "vtu")

_EMPTY: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True)
class RunResult:
    """The result of one run of a study."""

    name: str  # name of the run and of its folder
    swept: Mapping[str, Any]  # the swept values by dotted path, as the study file writes them
    events: Events  # its slip events
    peaks: tuple[Peak, ...] = ()  # its acceleration peaks, in order of time
    numbers: Mapping[str, Number] = field(default_factory=lambda: _EMPTY)  # by key of the measure [SI]
    edge: EdgeContact | None = None  # contact that came close to a free edge of its boundary
    doubts: tuple[str, ...] = ()  # what was doubtful in its model, beside what its numbers tell
    identity: str = ""  # hash of its inputs
    mesh_hash: str = ""  # hash of the mesh
    mesh_size: float = 0.0  # representative element size N^(-1/dim) of a mesh of N cells [-]
    seconds: float = 0.0  # wall time of the simulation [s]
    versions: Mapping[str, str] = field(default_factory=lambda: _EMPTY)
    values: Mapping[str, Any] = field(default_factory=lambda: _EMPTY)
    uncertainty: Mapping[str, float] = field(default_factory=lambda: _EMPTY)  # by key of the number [SI]
    convergence: Mapping[str, Convergence] = field(default_factory=lambda: _EMPTY)  # where that is from, by key
    sampled: Mapping[str, Any] = field(default_factory=lambda: _EMPTY)
    derived: Mapping[str, Quantity] = field(default_factory=lambda: _EMPTY)
    reaction: Mapping[str, float | None] = field(default_factory=lambda: _EMPTY)  # times since the load began [s]

    @property
    def all_values(self) -> dict[str, Any]:
        """Every known value by dotted path."""
        return {**self.values, **self.swept, **self.sampled}


def failure_folder(folder: Path) -> Path:
    """Return the folder of what was computed of a run until it failed, beside that of the run itself."""
    return folder.with_name(f"{folder.name}.unfinished")


def result_of(history: xr.Dataset, name: str, swept: Mapping[str, Any]) -> RunResult:
    """Read off a history what is stored beside it."""
    slip = find_slip(history)
    return RunResult(
        name=name,
        swept=swept,
        events=slip.events,
        peaks=slip.peaks.peaks,
        numbers=measures.read_measures(history, slip=slip),
        edge=edge_contact(history),
    )


@dataclass(frozen=True)
class RefusedRun:
    """A sample whose values do not fit together, so that it was not computed."""

    name: str  # name of the run
    swept: Mapping[str, Any]  # its values by dotted path, as those of a :class:`RunResult`
    sampled: Mapping[str, Any]  # its values by dotted path, as those of a :class:`RunResult`
    reason: str  # what is wrong


@describe_fields
@dataclass(frozen=True)
class StudyResult:
    """The results of a study.

    Examples
    --------
    When each run of a study slips as a whole::

        for run in fs.read_study("results/wang2014_table2").runs:
            print(run.name, run.events.slip.overall)
    """

    folder: Annotated[Path, "The folder of the results."]
    compare: Annotated[tuple[str, ...], "Names of the published sets that they are shown beside."]
    runs: Annotated[tuple[RunResult, ...], "The finished runs."]
    computed: Annotated[tuple[str, ...], "Names of the runs that were computed."] = ()
    unchanged: Annotated[tuple[str, ...], "Names of the runs that were there already."] = ()
    title: Annotated[str, "What the study shows."] = ""
    description: Annotated[str, "The question that it answers."] = ""
    ranges: Annotated[
        Mapping[str, tuple[Any, ...]],
        "Smallest and largest value of what was sampled, by dotted path, if anything was.",
    ] = field(default_factory=lambda: _EMPTY)
    refused: Annotated[tuple[RefusedRun, ...], "Samples that were not computed."] = ()
    design: Annotated[
        Mapping[str, Any], "How samples were drawn, if they were: `method`, `count`, `seed` and `paths`."
    ] = field(default_factory=lambda: _EMPTY)


@dataclass(frozen=True)
class Quantity:
    """One number of a run."""

    label: str  # its name in words
    unit: str  # SI unit
    value: float | None  # the number


def quantities(result: RunResult) -> dict[str, Quantity]:
    """Return the numbers of mechanics of a run, or the times of its reactions, whose convergence is studied."""
    if result.reaction:
        return {f"reaction.{name}": Quantity(name, "s", time) for name, time in result.reaction.items()}
    times = {
        f"{reading}.{time}": Quantity(f"{event_label(time)} ({words})", "s", result.events.reading(reading).time(time))
        for reading, words in READINGS.items()
        for time in TIMES
        if defines_time(reading, time) and result.events.reading(reading).recorded
    }
    numbers = {}
    for measure in measures.MEASURES:
        if measure.mechanical and (not measure.reading or result.events.reading(measure.reading).recorded):
            number, unit = result.numbers.get(measure.key), measure.unit.si if measure.unit else ""
            numbers[measure.key] = Quantity(measure.label, unit, None if number is None else float(number))
    return {**times, **numbers}


#: Files in the folder of a run.
HISTORY, RESULT, RUN, LOG = "history.nc", "events.json", "run.yaml", "log.txt"
#: Folder of a fit in the results of its study, its table of values in it, and of which runs it is, with notes.
FIT, SUMMARY, ABOUT = "fit", "fit/summary.csv", "fit/about.json"

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
    doubts: NotRequired[list[str]]
    reaction_s: NotRequired[dict[str, pydantic.FiniteFloat | None]]
    mesh_hash: str
    mesh_size: pydantic.FiniteFloat
    wall_time_s: pydantic.FiniteFloat
    versions: dict[str, str]
    files: dict[str, str]


_STORED: pydantic.TypeAdapter[Any] = pydantic.TypeAdapter(_Stored)


def result_mapping(result: RunResult) -> dict[str, Any]:
    """Return a result as plain data for JSON, without what other files hold: its values and uncertainties."""
    edge = result.edge
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
        "edge_contact": edge and {"boundary": edge.boundary, "time_s": edge.time, "distance_m": edge.distance},
        **({"doubts": list(result.doubts)} if result.doubts else {}),
        **({"reaction_s": dict(result.reaction)} if result.reaction else {}),
        "mesh_hash": result.mesh_hash,
        "mesh_size": result.mesh_size,
        "wall_time_s": round(result.seconds, 3),
        "versions": dict(result.versions),
    }


def result_from_mapping(values: Mapping[str, Any]) -> RunResult:
    """Read a result back from plain data: the inverse of :func:`result_mapping`."""
    edge = values["edge_contact"]
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
        edge=edge and EdgeContact(edge["boundary"], edge["time_s"], edge["distance_m"]),
        doubts=tuple(values.get("doubts", ())),
        identity=values["identity"],
        mesh_hash=values["mesh_hash"],
        mesh_size=values["mesh_size"],
        seconds=values["wall_time_s"],
        versions=dict(values["versions"]),
        sampled=dict(values.get("sampled", {})),
        reaction=dict(values.get("reaction_s", {})),
    )


def read_result(folder: Path, *, is_whole: bool = False) -> RunResult | None:
    """Read a result as :func:`stored_result` does; None where there is none, or a damaged one."""
    try:
        return stored_result(folder, is_whole=is_whole)
    except ResultError:
        return None


def stored_result(folder: Path, *, is_whole: bool = False) -> RunResult:
    """Read the result of a finished run from its folder, without its values and uncertainties.

    Its other files are checked unless they are known to be whole.
    """
    lacks = f"holds no finished run, needs the folder of a run or a study; {_REPAIR}"
    missing = ResultError(f"{folder}: {without_results(folder, lacks)}")
    try:
        values = read_json(folder / RESULT, _REPAIR, _STORED)
    except FileNotFoundError:
        raise missing from None
    if not (folder / HISTORY).exists():
        raise missing
    try:
        result, digests = result_from_mapping(values), dict(values["files"])
    except (KeyError, TypeError, ValueError):
        raise DamagedError(str(folder / RESULT), "is of another version", _REPAIR) from None
    if not is_whole:
        check_digests(folder, digests, "is damaged: its checksum is another", _REPAIR)
    return result


def stored_fit(study: StudyResult) -> dict[str, Any]:
    """Read what is stored about the fit of a study; refuse a fit of other runs."""
    try:
        about = read_json(study.folder / ABOUT, "fit again")
    except FileNotFoundError:
        raise ResultError(f"{study.folder}: holds no fit; run fingerslip fit with its study") from None
    if about.get("runs") != digest([run.identity for run in study.runs]):
        fault = f"is of other runs, needs those of {study.folder}; run fingerslip fit again"
        raise ResultError(f"{study.folder / FIT}: {fault}")
    return about


def without_results(folder: Path, lacks: str) -> str:
    """Say why a path has no results: what the folder lacks, that it is a file, or what has a similar name."""
    if folder.is_dir():
        return lacks
    if folder.exists():
        return "is a file; needs a folder that fingerslip run wrote"
    beside = [str(other) for other in folder.parent.glob("*") if other.is_dir()]
    near = difflib.get_close_matches(str(folder), beside, 3)
    return f"is not there; {_REPAIR}" + (f", or name {' or '.join(near)}" if near else "")


def write_result(result: RunResult, folder: Path) -> None:
    """Write a result into the folder of its run, with the checksums of the files that are there already."""
    # The log is written until the end.
    files = (file for file in sorted(folder.rglob("*")) if file.is_file() and file.name not in (RESULT, LOG))
    digests = {file.relative_to(folder).as_posix(): file_digest(file) for file in files}
    write_json(folder / RESULT, {**result_mapping(result), "files": digests})
