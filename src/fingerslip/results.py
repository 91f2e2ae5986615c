"""The result of a run: its slip events, peaks and measures, and what made them; as data, as JSON, and read back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fingerslip.digest import file_digest
from fingerslip.errors import DamagedError, ResultError, warn_renamed
from fingerslip.files import read_json, write_json
from fingerslip.slip import measures
from fingerslip.slip.events import Events, events_from_mapping, events_mapping, find_events
from fingerslip.slip.free_edge import EdgeContact, edge_contact
from fingerslip.slip.measures import Number
from fingerslip.slip.names import READINGS, TIMES, event_label, is_defined
from fingerslip.slip.peaks import Peak, acceleration_peaks

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "HISTORY",
    "LOG",
    "REPEAT",
    "RESULT",
    "RUN",
    "SAMPLE",
    "Quantity",
    "RefusedRun",
    "RunResult",
    "StudyResult",
    "flatten",
    "quantities",
    "read_result",
    "result_from_mapping",
    "result_mapping",
    "result_of",
    "stored_result",
    "unchecked_result",
    "write_result",
]

#: Files in the folder of a run.
HISTORY, RESULT, RUN, LOG = "history.nc", "events.json", "run.yaml", "log.txt"

#: What the numbers of a sample and of a repeat are called among the swept values of a run.
SAMPLE, REPEAT = "sample", "repeat"

_REPAIR = "run the study again"

_EMPTY: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True)
class RunResult:
    """The result of one run of a study.

    Parameters
    ----------
    name : str
        Name of the run and of its folder.
    swept : mapping of str to object
        The swept values by dotted path, as the study file writes them; the number of a sample under ``sample``.
    events : Events
        Its slip events.
    peaks : tuple of Peak
        Its acceleration peaks, in order of time.
    numbers : mapping of str to float, int or None
        Its measures [SI] by key (:data:`~fingerslip.slip.MEASURES`); None for one that does not exist.
    edge : EdgeContact, optional
        Contact that came close to a free edge of its boundary; None where it kept away.
    identity : str
        Hash of its inputs.
    mesh_hash : str
        Hash of the mesh.
    mesh_size : float
        Representative element size N^(-1/dim) of a mesh of N cells [-].
    seconds : float
        Wall time of the simulation [s].
    versions : mapping of str to str
        Versions of the programs that made it.
    values : mapping of str to object
        All values of its ``run.yaml`` by dotted path (see :func:`flatten`).
    uncertainty : mapping of str to float
        Numerical uncertainty of its times and numbers [SI], as far as it was studied, by key: ``slip.overall``, or the
        key of a measure.
    sampled : mapping of str to object
        The values of its sample or of its repeat by dotted path; empty in a study without them.
    derived : mapping of str to Quantity
        Derived quantities by name, as the study file defines them.
    """

    name: str
    swept: Mapping[str, Any]
    events: Events
    peaks: tuple[Peak, ...] = ()
    numbers: Mapping[str, Number] = field(default_factory=lambda: _EMPTY)
    edge: EdgeContact | None = None
    identity: str = ""
    mesh_hash: str = ""
    mesh_size: float = 0.0
    seconds: float = 0.0
    versions: Mapping[str, str] = field(default_factory=lambda: _EMPTY)
    values: Mapping[str, Any] = field(default_factory=lambda: _EMPTY)
    uncertainty: Mapping[str, float] = field(default_factory=lambda: _EMPTY)
    sampled: Mapping[str, Any] = field(default_factory=lambda: _EMPTY)
    derived: Mapping[str, Quantity] = field(default_factory=lambda: _EMPTY)

    @property
    def label(self) -> str:
        """Old name of `name`."""
        warn_renamed("label", "name")
        return self.name

    @property
    def all_values(self) -> dict[str, Any]:
        """Every known value by dotted path."""
        return {**self.values, **self.swept, **self.sampled}


def result_of(history: xr.Dataset, name: str, swept: Mapping[str, Any]) -> RunResult:
    """Read off a history what is stored beside it.

    Parameters
    ----------
    history : xarray.Dataset
        What ``simulate`` returned.
    name : str
        Name of the run.
    swept : mapping of str to object
        The swept values by dotted path.
    """
    return RunResult(
        name=name,
        swept=swept,
        events=find_events(history),
        peaks=acceleration_peaks(history).peaks,
        numbers=measures.read_measures(history),
        edge=edge_contact(history),
    )


@dataclass(frozen=True)
class RefusedRun:
    """A sample whose values do not fit together, so that it was not computed.

    Parameters
    ----------
    name : str
        Name of the run.
    swept, sampled : mapping of str to object
        Its values by dotted path, as those of a :class:`RunResult`.
    reason : str
        What is wrong.
    """

    name: str
    swept: Mapping[str, Any]
    sampled: Mapping[str, Any]
    reason: str


@dataclass(frozen=True)
class StudyResult:
    """The results of a study.

    Parameters
    ----------
    folder : Path
        The folder of the results.
    compare : tuple of str
        Names of the published sets that they are shown beside.
    runs : tuple of RunResult
        The finished runs.
    computed, unchanged : tuple of str
        Names of the runs that were computed, and of those that were there already.
    title, description : str
        What the study shows, and the question that it answers.
    ranges : mapping of str to tuple
        Smallest and largest value of what was sampled, by dotted path; empty in a study without samples.
    refused : tuple of RefusedRun
        Samples that were not computed.
    design : mapping of str to object
        How the samples were drawn: `method`, `count`, `seed` and `paths`; empty in a study without samples.
    """

    folder: Path
    compare: tuple[str, ...]
    runs: tuple[RunResult, ...]
    computed: tuple[str, ...] = ()
    unchanged: tuple[str, ...] = ()
    title: str = ""
    description: str = ""
    ranges: Mapping[str, tuple[Any, ...]] = field(default_factory=lambda: _EMPTY)
    refused: tuple[RefusedRun, ...] = ()
    design: Mapping[str, Any] = field(default_factory=lambda: _EMPTY)


@dataclass(frozen=True)
class Quantity:
    """One number of a run.

    Parameters
    ----------
    label : str
        Its name in words.
    unit : str
        SI unit; empty for a pure number.
    value : float or None
        The number; None for one that does not exist.
    """

    label: str
    unit: str
    value: float | None


def quantities(result: RunResult) -> dict[str, Quantity]:
    """Return the numbers of mechanics of a run, whose convergence is studied.

    Parameters
    ----------
    result : RunResult
        The run.

    Returns
    -------
    dict
        The times of every recorded reading by ``reading.event``, such as ``slip.overall``, and the measures by key.
    """
    times = {
        f"{reading}.{time}": Quantity(f"{event_label(time)} ({words})", "s", result.events.reading(reading).time(time))
        for reading, words in READINGS.items()
        for time in TIMES
        if is_defined(reading, time) and result.events.reading(reading).recorded
    }
    numbers = {
        measure.key: Quantity(measure.label, measure.unit.si if measure.unit else "", _float(result, measure.key))
        for measure in measures.MEASURES
        if measure.mechanical and (not measure.reading or result.events.reading(measure.reading).recorded)
    }
    return {**times, **numbers}


def _float(result: RunResult, key: str) -> float | None:
    value = result.numbers.get(key)
    return None if value is None else float(value)


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
    """Read a result back from plain data: the inverse of :func:`result_mapping`.

    Raises
    ------
    KeyError, TypeError
        Where something is missing, or of another kind.
    """
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


def read_result(folder: Path) -> RunResult | None:
    """Read the result of a finished run from its folder, without its values and uncertainties.

    Parameters
    ----------
    folder : Path
        Folder of a run.

    Returns
    -------
    RunResult or None
        None where there is no finished run: no history beside the result, or a result that is damaged or incomplete.
    """
    try:
        return stored_result(folder)
    except ResultError:
        return None


def stored_result(folder: Path) -> RunResult:
    """Read the result of a finished run as :func:`read_result` does, and say what is wrong with a damaged one.

    Parameters
    ----------
    folder : Path
        Folder of a run.

    Raises
    ------
    DamagedError
        Where one of its files is not as it was written.
    ResultError
        Where there is no finished run.
    """
    result, digests = _stored(folder)
    for name, written in digests.items():
        _check_file(folder / name, written)
    return result


def unchecked_result(folder: Path) -> RunResult:
    """Read the result of a finished run without looking into its other files.

    Parameters
    ----------
    folder : Path
        Folder of a run.

    Raises
    ------
    DamagedError
        Where the file of its events is not as it was written.
    ResultError
        Where there is no finished run.
    """
    return _stored(folder)[0]


def _stored(folder: Path) -> tuple[RunResult, dict[str, str]]:
    """Return the result of a finished run, and the checksums of its files."""
    missing = ResultError(f"{folder}: holds no finished run; {_REPAIR}")
    try:
        values = read_json(folder / RESULT, _REPAIR)
    except (FileNotFoundError, NotADirectoryError):
        raise missing from None
    if not (folder / HISTORY).exists():
        raise missing
    try:
        return result_from_mapping(values), dict(values["files"])
    except (KeyError, TypeError, ValueError):
        raise DamagedError(str(folder / RESULT), "is of another version", _REPAIR) from None


def write_result(result: RunResult, folder: Path) -> None:
    """Write a result into the folder of its run, with the checksums of the files that are there already.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    # The log is written until the end.
    own = (file for file in sorted(folder.rglob("*")) if file.is_file() and file.name not in (RESULT, LOG))
    digests = {file.relative_to(folder).as_posix(): file_digest(file) for file in own}
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


def flatten(mapping: Mapping[str, Any]) -> dict[str, Any]:
    """Turn nested plain data into values by dotted path.

    Examples
    --------
    >>> flatten({"contact": {"friction_coefficient": 0.6}, "programme": [{"hold": 1}]})
    {'contact.friction_coefficient': 0.6, 'programme.0.hold': 1}
    """
    flat: dict[str, Any] = {}
    for key, value in mapping.items():
        inner = dict(enumerate(value)) if isinstance(value, list | tuple) else value
        if isinstance(inner, Mapping) and inner:
            flat |= {f"{key}.{path}": leaf for path, leaf in flatten({str(k): v for k, v in inner.items()}).items()}
        else:
            flat[key] = value
    return flat
