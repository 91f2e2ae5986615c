"""What came of the reactions of the runs of a study: data in the folders of the runs, sentences, and tables."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.errors import DamagedError
from fingerslip.react.reflex import REACTIONS
from fingerslip.react.settings import ReactionSettings
from fingerslip.report.labels import run_title
from fingerslip.report.tables.runs import swept_cells, swept_columns
from fingerslip.results import RunResult, StudyResult
from fingerslip.storage.files import write_text
from fingerslip.tables.table import Cell, Column, Missing, Table
from fingerslip.units import unit_suffix

#: Files in the folder of a run: what came of its reactions, and the film of two of them with its last frame.
RESULT, FILM, STILL = "reactions.json", "reaction-film.mp4", "reaction-film.png"


@dataclass(frozen=True)
class Trial:
    """What came of one reaction after one detector."""

    reaction: str
    detector: str
    delay: float  # from the alarm, or the load, to the first change of the force [s]
    since_load: bool  # whether the delay counts from the start of the load
    force_rate: float  # of the grip at most [N/s]
    critical: float | None  # the longest such delay that saves the object [s]
    chance: float | None  # share of trials that save it, by the jitter of the reflex [-]
    saved: bool
    travel: float  # largest [m]
    slip: float  # largest of a node [m]
    grip_added: float  # [N]
    false_grip: bool  # whether the object would have been held without it

    @property
    def since(self) -> str:
        """Since when the delay counts, in words where that is not the alarm."""
        return " after the load" if self.since_load else ""

    @property
    def spare(self) -> float | None:
        """How much longer the delay may be [s]."""
        return None if self.critical is None else self.critical - self.delay


@dataclass(frozen=True)
class ReactionResult:
    """What came of the reactions of a run; times count from the start of the load [s]."""

    friction: float  # friction coefficient [-]
    load_rate: float | None  # of a ramp [N/s]
    grip: float  # first grip force [N]
    alarms: Mapping[str, float | None]  # of each detector
    gross: float | None  # when all of the contact slips
    lost: float | None  # when the object is lost without a reaction
    critical: Mapping[str, float | None]  # critical latency after each alarm; None: even none is too much, or not lost
    error: float  # how much longer they may be
    trials: tuple[Trial, ...] = ()
    travels: Mapping[float, float] = pydantic.Field(default_factory=dict)  # largest travel [m] by latency [s]

    def latency(self, detector: str) -> float:
        """Return the critical latency [s] after a detector's alarm: NaN where none saves, inf where none is needed."""
        value = self.critical[detector]
        return np.inf if self.lost is None else np.nan if value is None else value

    @property
    def times(self) -> dict[str, float | None]:
        """Its times by what they are called in tables [s]."""
        critical = {f"critical latency after {name}": value for name, value in self.critical.items()}
        return {"gross slip": self.gross, "lost": self.lost, **self.alarms, **critical}


_STORED: pydantic.TypeAdapter[ReactionResult] = pydantic.TypeAdapter(ReactionResult)


def read_reactions(folder: Path) -> ReactionResult:
    """Read what came of the reactions of a finished run."""
    try:
        return _STORED.validate_json((folder / RESULT).read_bytes())
    except (OSError, pydantic.ValidationError) as error:
        raise DamagedError(str(folder / RESULT), f"cannot be read ({error})", "run the study again") from None


def write_reactions(result: ReactionResult, folder: Path) -> None:
    """Write what came of the reactions of a run into its folder."""
    write_text(folder / RESULT, _STORED.dump_json(result, indent=1).decode())


# Swept values that are axes of the map.
_AXES = ("contact.friction_coefficient", "contact.friction.coulomb.coefficient", "reaction.load.ramp_load.rate")


@dataclass(frozen=True)
class Reactions:
    """The finished runs of a study with the block `reaction`."""

    runs: tuple[RunResult, ...]
    results: tuple[ReactionResult, ...]  # what came of each
    settings: ReactionSettings  # of the centre

    @cached_property
    def centre(self) -> int:
        """Number of the centre among the runs."""
        return centre_of(self.results)

    @property
    def result(self) -> ReactionResult:
        """What came of the centre."""
        return self.results[self.centre]

    @property
    def where(self) -> str:
        """The centre in words."""
        rate = f" and {self.result.load_rate:g} N/s" if self.result.load_rate else ""
        return f"friction {self.result.friction:g}{rate}"

    @property
    def uncertainty(self) -> tuple[float, str]:
        """How much longer the critical latency of the centre may be [s], and of what that is the error."""
        refined = self.runs[self.centre].uncertainty.get(f"reaction.critical latency after {self.settings.detector}")
        return self.result.error + (refined or 0.0), "search" if refined is None else "search, step and mesh"

    @cached_property
    def frictions(self) -> tuple[float, ...]:
        """Friction coefficients, ascending."""
        return tuple(sorted({result.friction for result in self.results}))

    @cached_property
    def load_rates(self) -> tuple[float, ...]:
        """Rates of the load [N/s], ascending."""
        return tuple(sorted({result.load_rate for result in self.results if result.load_rate}))

    def panels(self, detector: str) -> dict[str, Floats]:
        """Return critical latencies [s], (n_frictions, n_rates), by what else is swept, where all of them are known."""
        cells = dict[str, dict[tuple[float, float], float]]()
        for run, result in zip(self.runs, self.results, strict=True):
            others = {path: value for path, value in run.swept.items() if path not in _AXES}
            title = run_title(dataclasses.replace(run, swept=others), "") if others else ""
            if result.load_rate is not None:
                cells.setdefault(title, {})[result.friction, result.load_rate] = result.latency(detector)
        return {
            title: np.array([[panel[friction, rate] for rate in self.load_rates] for friction in self.frictions])
            for title, panel in cells.items()
            if len(panel) == len(self.frictions) * len(self.load_rates)
        }


def centre_of(results: Sequence[ReactionResult]) -> int:
    """Return which of some runs the answer is about: the first one at which most was tried."""
    return max(range(len(results)), key=lambda number: len(results[number].trials) + len(results[number].travels))


def answer(reactions: Reactions) -> tuple[str, ...]:
    """Return the answer of the runs, at the centre, in a few sentences; of samples, which have none, over all."""
    settings, result = reactions.settings, reactions.result
    if any(run.sampled for run in reactions.runs):
        return _answer_of_samples(reactions)
    critical, where = result.latency(settings.detector), f"At {reactions.where}"
    if np.isnan(critical):
        return (f"{where} no reflex saves the object, however quick.",)
    if np.isinf(critical):
        return (f"{where} the grip holds the object; no reflex is needed.",)
    error, of = reactions.uncertainty
    longest, lost = 1e3 * critical, 1e3 * (critical + result.error)
    first = f"{where} a grip that rises at {settings.actuator.force_rate:g} N/s from {longest:.0f} ms after"
    tried = [trial for trial in result.trials if trial.detector == settings.detector]
    texts = []
    for verb, saved in (("saved by", True), ("lost by", False)):
        trials = sorted((trial for trial in tried if trial.saved == saved), key=lambda trial: trial.delay)
        if trials:
            texts.append(f"{verb} {', '.join(map(_name, trials))}")
    said = "The grip of each reaction has its own rate, so each has its own longest latency, which stands second:"
    return (
        f"{first} '{settings.detector}' on saves the object, {lost:.0f} ms loses it (± {1e3 * error:.0f} ms of {of}).",
        *((f"{said} {'; '.join(texts)}.",) if texts else ()),
    )


def _answer_of_samples(reactions: Reactions) -> tuple[str, ...]:
    settings, lost = reactions.settings, [result for result in reactions.results if result.lost is not None]
    first = f"{len(lost)} of {len(reactions.results)} objects are lost without a reaction."
    latencies = [1e3 * value for result in lost if (value := result.critical[settings.detector]) is not None]
    if not latencies:
        return (first,)
    rise = f"A grip that rises at {settings.actuator.force_rate:g} N/s saves {len(latencies)} of them"
    span = f"{min(latencies):.0f} to {max(latencies):.0f} ms after '{settings.detector}'"
    return first, f"{rise} where it begins in time: {span}, {np.median(latencies):.0f} ms in the middle."


def _name(trial: Trial) -> str:
    """Return a reaction with its latency and the longest that its grip allows."""
    longest = " ms, none is short enough" if trial.critical is None else f" of {1e3 * trial.critical:.0f} ms"
    return f"{trial.reaction} ({1e3 * trial.delay:.0f}{longest}{trial.since})"


def trial_table(reactions: Reactions) -> Table:
    """Return every reaction at the centre after every detector."""
    columns = (
        *(Column("reaction"), Column("detector"), Column("delay", "ms", 0), Column("critical", "ms", 0)),
        *(Column("saved"), Column("chance", "%", 0), Column("travel", "mm", 1), Column("slip", "mm", 1)),
        *(Column("grip added", "N", 1), Column("false grip")),
    )
    is_held, rows = reactions.result.lost is None, []
    for trial in reactions.result.trials:
        times = 1e3 * trial.delay, _milliseconds(trial.critical, is_held)
        chance, ways = 100.0 * (is_held or trial.chance or 0.0), (1e3 * trial.travel, 1e3 * trial.slip)
        grip = trial.grip_added, trial.false_grip
        rows.append((trial.reaction, trial.detector, *times, trial.saved, chance, *ways, *grip))
    note = "delay: from the alarm, or the load, to the first change of the force; chance: by the jitter of the reflex."
    return Table(f"Reactions at {reactions.where}", columns, tuple(rows), note)


_UNITS = {"delay": "s", "force_rate": "N/s", "critical": "s", "travel": "m", "slip": "m", "grip_added": "N"}


def all_trials_table(study: StudyResult) -> Table:
    """Return every reaction after every detector in every run, in SI units, as other programs take it."""
    names = [field.name for field in dataclasses.fields(Trial)]
    columns = (Column(f"{name}_{unit_suffix(_UNITS[name])}" if name in _UNITS else name) for name in names)
    trials = ((run.name, trial) for run in study.runs for trial in read_reactions(study.folder / run.name).trials)
    rows = tuple((name, *vars(trial).values()) for name, trial in trials)
    return Table("Reactions", (Column("run"), *columns), rows)


def cell_table(reactions: Reactions) -> Table:
    """Return every run."""
    runs, detectors = reactions.runs, tuple(reactions.settings.detectors)
    columns = (
        *(*swept_columns(runs), Column("grip", "N", 2)),
        *(Column(f"{name}", "ms", 0) for name in detectors),
        *(Column("gross slip", "ms", 0), Column("lost", "ms", 0)),
        *(Column(f"critical, {name}", "ms", 0) for name in detectors),
        Column("error", "ms", 1),
    )
    rows = tuple(
        (
            *(*swept_cells(run, runs), result.grip),
            *(_milliseconds(result.alarms[name]) for name in detectors),
            *(_milliseconds(result.gross), _milliseconds(result.lost)),
            *(_milliseconds(result.critical[name], result.lost is None) for name in detectors),
            1e3 * result.error,
        )
        for run, result in zip(runs, reactions.results, strict=True)
    )
    note = "Times since the load began; critical: the longest latency after each alarm that saves the object."
    return Table("Critical latencies", columns, rows, note)


def source_table() -> Table:
    """Return every value of the reactions with its source, the assumed ones first."""
    rows = tuple(
        (name, row.path, row.value, row.source, row.note) for name in REACTIONS.names for row in REACTIONS.table(name)
    )
    return Table("Reactions", tuple(map(Column, ("reaction", "value of", "value", "source", "note"))), rows, "")


def paper_table() -> Table:
    """Return where each reaction comes from, and what it does not claim."""
    keys = ("citation", "published", "claims_not")
    rows = tuple((name, *map(REACTIONS.header(name).get, keys)) for name in REACTIONS.names)
    return Table("Where they come from", tuple(map(Column, ("reaction", "citation", "published", "not claimed"))), rows)


def _milliseconds(time: float | None, is_held: bool = False) -> Cell:
    return "held" if is_held else Missing.NO_EVENT if time is None else 1e3 * time
