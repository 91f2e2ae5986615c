"""Tables of slip events, acceleration peaks and published statements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from fingerslip.published import PublishedSet, PublishedValue
from fingerslip.report.tables.table import Cell, Column, Measured, Table
from fingerslip.slip import Events, PeakTable

__all__ = [
    "WAYS",
    "RunEvents",
    "compare_table",
    "events_table",
    "flatten",
    "peaks_table",
    "statements_table",
    "summary_table",
    "ways_table",
]

WAYS: Mapping[str, str] = MappingProxyType(
    {"slip": "accumulated slip", "displacement": "displacement", "acceleration": "acceleration peaks"}
)
_TIMES = ("incipient", "three_quarter", "overall", "latency")


@dataclass(frozen=True)
class RunEvents:
    """The events of one run of a study.

    Parameters
    ----------
    label : str
        Its name.
    swept : mapping of str to object
        The swept values by dotted path; lists and mappings become text, as `1, 0, 1`.
    events : Events
        Its slip events.
    values : mapping of str to object
        All values of the run by dotted path (see :func:`flatten`), for comparison with published values.
    uncertainty : mapping of str to float
        Numerical uncertainty [s] of the events whose convergence was studied, by way and event: `slip.overall`.
    """

    label: str
    swept: Mapping[str, Any]
    events: Events
    values: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    uncertainty: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        object.__setattr__(self, "swept", {path: _scalar(value) for path, value in self.swept.items()})

    def time(self, way: str, event: str, factor: float = 1.0) -> Cell:
        """Return an event's time, or its latency, times `factor`, with its uncertainty where that is known."""
        time: float | None = getattr(getattr(self.events, way), event)
        uncertainty = self.uncertainty.get(f"{way}.{event}")
        if time is None:
            return None
        return factor * time if uncertainty is None else Measured(factor * time, factor * uncertainty)

    @property
    def all_values(self) -> dict[str, Any]:
        """Every known value by dotted path."""
        return {**self.values, **self.swept}


def _scalar(value: object) -> object:
    """Return numbers and words as they are, and lists and mappings as text that tables and axes can show."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_scalar(part)}" for name, part in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(str(_scalar(part)) for part in value)
    return value


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


def summary_table(runs: Sequence[RunEvents]) -> Table:
    """Put the events of all runs into one table: one row per run, times in seconds.

    The columns are the swept paths, then ``incipient_s, three_quarter_s, overall_s, latency_s`` from accumulated
    slip, and the same four with ``_displacement`` and ``_acceleration``; then the numerical uncertainties that are
    known, such as ``slip_overall_uncertainty_s``.
    """
    paths = _swept_paths(runs)
    names = [f"{time}_s{suffix}" for suffix in ("", "_displacement", "_acceleration") for time in _TIMES]
    known = list(dict.fromkeys(key for run in runs for key in run.uncertainty if key.partition(".")[0] in WAYS))
    errors = [f"{name.replace('.', '_')}_uncertainty_s" for name in known]
    rows = tuple(
        (
            *(run.swept.get(path) for path in paths),
            *_all_times(run.events),
            *(run.uncertainty.get(key) for key in known),
        )
        for run in runs
    )
    return Table("Slip events", tuple(Column(name) for name in (*paths, *names, *errors)), rows)


def events_table(runs: Sequence[RunEvents], way: str = "slip") -> Table:
    """Show the events of all runs, read in one way.

    Parameters
    ----------
    runs : sequence of RunEvents
        The runs.
    way : {'slip', 'displacement', 'acceleration'}
        How events are read.
    """
    columns = (*_swept_columns(runs), *_event_columns())
    rows = tuple((*_swept_cells(run, runs), *_event_cells(run, way)) for run in runs)
    return Table(f"Slip events from {WAYS[way]}", columns, rows, _uncertainty_note(runs))


def ways_table(run: RunEvents, title: str = "Slip events") -> Table:
    """Show the events of one run, a row for each way of reading them."""
    rows = tuple((text, *_event_cells(run, way)) for way, text in WAYS.items())
    return Table(title, (Column("read from"), *_event_columns()), rows, _uncertainty_note([run]))


def peaks_table(peaks: PeakTable, title: str = "Acceleration peaks") -> Table:
    """Show the acceleration peaks of one run, the most prominent first."""
    columns = (
        Column("rank"),
        Column("time", "s", 3),
        Column("height", "m/s²", 3),
        Column("prominence", "m/s²", 3),
        Column("over noise", "", 1),
    )
    spread = peaks.noise_spread
    rows = tuple(
        (rank, peak.time, peak.height, peak.prominence, peak.prominence / spread if spread else None)
        for rank, peak in enumerate(peaks.ranked, start=1)
    )
    note = f"Noise floor {peaks.noise_floor:.3g} m/s², spread {spread:.2g} m/s²; over noise is prominence by spread."
    return Table(title, columns, rows, note)


def compare_table(runs: Sequence[RunEvents], reference: PublishedSet) -> Table:
    """Put events beside published values.

    A published time is shown for every run that meets its conditions, with our time from each way and the difference.

    Parameters
    ----------
    runs : sequence of RunEvents
        The runs; `values` has to hold what the conditions name.
    reference : PublishedSet
        Published values; those that are no event are left out.

    Returns
    -------
    Table
        Times in seconds, differences (ours less published) in milliseconds; without rows where nothing fits.
    """
    columns = (
        *_swept_columns(runs),
        Column("event"),
        Column("published", "s"),
        *(
            Column(heading, unit, digits)
            for heading_of_way in ("slip", "displ.", "peaks")
            for heading, unit, digits in ((heading_of_way, "s", 3), ("diff.", "ms", 0))
        ),
    )
    pairs = [(run, value) for run in runs for value in reference.values if value.holds_for(run.all_values)]
    rows = tuple(
        (*_swept_cells(run, runs), *_comparison(run, value))
        for run, value in pairs
        if value.value is not None and _is_event(value)
    )
    note = (
        "Ours, read from accumulated slip, displacement and acceleration peaks, and how much later than published. "
        f"A dash: the event did not happen. Published: {reference.citation}"
    )
    return Table(reference.title, columns, rows, note)


def statements_table(reference: PublishedSet) -> Table:
    """Show published statements in words, and what number can be held against each."""
    columns = (Column("statement"), Column("what to check"), Column("holds for"))
    rows = tuple(
        (value.statement, value.check, ", ".join(f"{path} = {held}" for path, held in value.conditions.items()))
        for value in reference.values
        if value.statement
    )
    return Table(reference.title, columns, rows, f"Published: {reference.citation}")


def _all_times(events: Events) -> list[float | None]:
    return [getattr(getattr(events, way), time) for way in WAYS for time in _TIMES]


def _event_columns() -> tuple[Column, ...]:
    names = ("incipient", "48 %", "three-quarter", "overall")
    return (*(Column(name, "s", 3) for name in names), Column("latency", "ms", 0))


def _event_cells(run: RunEvents, way: str) -> tuple[Cell, ...]:
    times = (run.time(way, event) for event in ("incipient", "noticed", "three_quarter", "overall"))
    return (*times, run.time(way, "latency", 1e3))


def _uncertainty_note(runs: Sequence[RunEvents]) -> str:
    """Say what stands after the sign; nothing where no uncertainty is known."""
    if not any(run.uncertainty for run in runs):
        return ""
    return "After ±: numerical uncertainty over element sizes, time steps, contact stiffness and numerical damping."


def _short(path: str) -> str:
    return path.removesuffix(".enabled").rsplit(".", 1)[-1].replace("_", " ")


def _swept_paths(runs: Sequence[RunEvents]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(path for run in runs for path in run.swept))


def _swept_columns(runs: Sequence[RunEvents]) -> tuple[Column, ...]:
    paths = _swept_paths(runs)
    shorts = [_short(path) for path in paths]
    names = [short if shorts.count(short) == 1 else path for short, path in zip(shorts, paths, strict=True)]
    return tuple(Column(name) for name in names) or (Column("run"),)


def _swept_cells(run: RunEvents, runs: Sequence[RunEvents]) -> tuple[Cell, ...]:
    return tuple(run.swept.get(path) for path in _swept_paths(runs)) or (run.label,)


def _is_event(value: PublishedValue) -> bool:
    return value.quantity in _TIMES


def _comparison(run: RunEvents, value: PublishedValue) -> tuple[Cell, ...]:
    assert value.value is not None  # held by compare_table
    low, high = value.span or (value.value, value.value)
    ours: list[Cell] = []
    for way in WAYS:
        time = getattr(getattr(run.events, way), value.quantity) if value.way in ("", way) else None
        # Within a published range the difference is zero, outside it is taken to the nearer end.
        nearest = None if time is None else min(max(time, low), high)
        late = None if time is None or nearest is None else 1e3 * (time - nearest)
        ours += [None if time is None else run.time(way, value.quantity), late]
    text = f"{low:.2f}" if low == high else f"{low:.2f} to {high:.2f}"
    return (value.quantity.replace("_", "-"), text, *ours)
