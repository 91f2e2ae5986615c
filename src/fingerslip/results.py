"""What a run and a study came to: slip events, peaks and measures, and what made them, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fingerslip.errors import warn_renamed
from fingerslip.slip import measures
from fingerslip.slip.events import Events
from fingerslip.slip.finding import find_slip
from fingerslip.slip.free_edge import EdgeContact, edge_contact
from fingerslip.slip.measures import Number
from fingerslip.slip.names import READINGS, TIMES, event_label, is_defined
from fingerslip.slip.peaks import Peak

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "REPEAT",
    "SAMPLE",
    "Quantity",
    "RefusedRun",
    "RunResult",
    "StudyResult",
    "quantities",
    "result_of",
]

#: What the numbers of a sample and of a repeat are called among the swept values of a run.
SAMPLE, REPEAT = "sample", "repeat"

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
        All values of its ``run.yaml`` by dotted path (see :func:`~fingerslip.parameters.dotted.flatten`).
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
    # What is read off is looked up many times, each time with all coordinates that fit: without any that is faster.
    history = history.reset_coords()
    found = find_slip(history)
    return RunResult(
        name=name,
        swept=swept,
        events=found.events,
        peaks=found.peaks.peaks,
        numbers=measures.read_measures(history, found=found),
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
