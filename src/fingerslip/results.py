"""What a run and a study came to: slip events, peaks and measures, and what made them, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fingerslip.slip import measures
from fingerslip.slip.events import Events
from fingerslip.slip.finding import find_slip
from fingerslip.slip.front import EdgeContact, edge_contact
from fingerslip.slip.measures import Number
from fingerslip.slip.peaks import Peak
from fingerslip.slip.windows import READINGS, TIMES, defines_time, event_label

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

    Arrays: numbers  [SI]; uncertainty  [SI].
    """

    name: str  # name of the run and of its folder
    swept: Mapping[str, Any]  # the swept values by dotted path, as the study file writes them
    events: Events  # its slip events
    peaks: tuple[Peak, ...] = ()  # its acceleration peaks, in order of time
    numbers: Mapping[str, Number] = field(default_factory=lambda: _EMPTY)
    edge: EdgeContact | None = None  # contact that came close to a free edge of its boundary
    identity: str = ""  # hash of its inputs
    mesh_hash: str = ""  # hash of the mesh
    mesh_size: float = 0.0  # representative element size N^(-1/dim) of a mesh of N cells [-]
    seconds: float = 0.0  # wall time of the simulation [s]
    versions: Mapping[str, str] = field(default_factory=lambda: _EMPTY)
    values: Mapping[str, Any] = field(default_factory=lambda: _EMPTY)
    uncertainty: Mapping[str, float] = field(default_factory=lambda: _EMPTY)
    sampled: Mapping[str, Any] = field(default_factory=lambda: _EMPTY)
    derived: Mapping[str, Quantity] = field(default_factory=lambda: _EMPTY)

    @property
    def all_values(self) -> dict[str, Any]:
        """Every known value by dotted path."""
        return {**self.values, **self.swept, **self.sampled}


def result_of(history: xr.Dataset, name: str, swept: Mapping[str, Any]) -> RunResult:
    """Read off a history what is stored beside it."""
    # What is read off is looked up many times, each time with all coordinates that fit: without any that is faster.
    history = history.reset_coords()
    slip = find_slip(history)
    return RunResult(
        name=name,
        swept=swept,
        events=slip.events,
        peaks=slip.peaks.peaks,
        numbers=measures.read_measures(history, found=slip),
        edge=edge_contact(history),
    )


@dataclass(frozen=True)
class RefusedRun:
    """A sample whose values do not fit together, so that it was not computed."""

    name: str  # name of the run
    swept: Mapping[str, Any]  # its values by dotted path, as those of a :class:`RunResult`
    sampled: Mapping[str, Any]  # its values by dotted path, as those of a :class:`RunResult`
    reason: str  # what is wrong


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
    """One number of a run."""

    label: str  # its name in words
    unit: str  # SI unit
    value: float | None  # the number


def quantities(result: RunResult) -> dict[str, Quantity]:
    """Return the numbers of mechanics of a run, whose convergence is studied."""
    times = {
        f"{reading}.{time}": Quantity(f"{event_label(time)} ({words})", "s", result.events.reading(reading).time(time))
        for reading, words in READINGS.items()
        for time in TIMES
        if defines_time(reading, time) and result.events.reading(reading).recorded
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
