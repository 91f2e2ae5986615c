"""What a map comes to: sentences, and tables."""

from __future__ import annotations

import numpy as np

from fingerslip.react.mapping import MapResult, Trial
from fingerslip.react.reflex import REACTIONS, reaction
from fingerslip.tables.table import Cell, Column, Missing, Table

__all__ = ["answer", "cell_table", "error_table", "paper_table", "source_table", "trial_table"]


def answer(result: MapResult) -> tuple[str, ...]:
    """Return the answer of a map in a few sentences."""
    settings, centre = result.settings, result.settings.centre
    critical = result.cell(centre).critical[settings.detector]
    where = f"At friction {centre.friction:g} and {centre.load_rate:g} N/s"
    tried = [trial for trial in result.trials if trial.detector == settings.detector]
    if critical is None:
        return (f"{where} no reflex saves the object, however quick.",)
    if np.isinf(critical):
        return (f"{where} the grip holds the object; no reflex is needed.",)
    longest, lost = 1e3 * critical, 1e3 * (critical + result.cell(centre).error)
    first = f"{where} a grip that rises as that of {settings.reaction} from {longest:.0f} ms after"
    bar = f"± {1e3 * result.uncertainty:.0f} ms of search, step and mesh"
    texts = [
        f"{verb} {', '.join(map(_name, trials))}"
        for verb, trials in (("saved by", _of(tried, True)), ("lost by", _of(tried, False)))
        if trials
    ]
    said = "The grip of each reaction has its own rate, so each has its own longest latency, which stands second:"
    return (
        f"{first} '{settings.detector}' on saves the object, {lost:.0f} ms loses it ({bar}).",
        *((f"{said} {'; '.join(texts)}.",) if texts else ()),
    )


def _name(trial: Trial) -> str:
    """Return a reaction with its latency and the longest that its grip allows."""
    delay = f"{1e3 * trial.delay:.0f}"
    allowed = (
        f"{delay} ms, none is short enough" if trial.critical is None else f"{delay} of {1e3 * trial.critical:.0f} ms"
    )
    return f"{trial.reaction} ({allowed}{' since the load' if trial.since_load else ''})"


def _of(trials: list[Trial], saved: bool) -> list[Trial]:
    """Return those that saved the object, or lost it, the quickest first."""
    return sorted((trial for trial in trials if trial.outcome.saved == saved), key=lambda trial: trial.delay)


def trial_table(result: MapResult) -> Table:
    """Return every reaction at the centre after every detector."""
    columns = (
        *(Column("reaction"), Column("detector"), Column("delay", "ms", 0), Column("critical", "ms", 0)),
        *(Column("saved"), Column("chance", "%", 0), Column("travel", "mm", 1), Column("slip", "mm", 1)),
        *(Column("grip added", "N", 1), Column("false grip")),
    )
    rows = tuple(
        (
            *(trial.reaction, trial.detector, 1e3 * trial.delay, _milliseconds(trial.critical)),
            *(trial.outcome.saved, _chance(trial), 1e3 * trial.outcome.travel, 1e3 * trial.outcome.largest_slip),
            *(trial.outcome.grip_added, trial.outcome.false_grip),
        )
        for trial in result.trials
    )
    centre = result.settings.centre
    title = f"Reactions at friction {centre.friction:g}, {centre.load_rate:g} N/s, {centre.phalanx} phalanx"
    note = "delay: from the alarm, or the load, to the first change of the force; chance: by the jitter of the reflex."
    return Table(title, columns, rows, note)


def _chance(trial: Trial) -> Cell:
    """Return the share of trials that save the object [%]."""
    if trial.critical is None:
        return 0.0
    tried = reaction(trial.reaction)
    return 100.0 * tried.reflex.share_within(trial.critical - tried.actuator.dead_time)


def cell_table(result: MapResult) -> Table:
    """Return every cell of a map."""
    detectors = tuple(result.settings.detectors)
    columns = (
        *(Column("phalanx"), Column("friction"), Column("load rate", "N/s"), Column("grip", "N", 2)),
        *(Column(f"{name}", "ms", 0) for name in detectors),
        *(Column("gross slip", "ms", 0), Column("lost", "ms", 0)),
        *(Column(f"critical, {name}", "ms", 0) for name in detectors),
        Column("error", "ms", 1),
    )
    rows = tuple(
        (
            *(cell.at.phalanx, cell.at.friction, cell.at.load_rate, cell.grip),
            *(_milliseconds(cell.alarms[name]) for name in detectors),
            *(_milliseconds(cell.gross), _milliseconds(cell.lost)),
            *(_milliseconds(cell.critical[name]) for name in detectors),
            1e3 * cell.error,
        )
        for cell in result.cells
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
    headers = {name: REACTIONS.header(name) for name in REACTIONS.names}
    rows = tuple(
        (name, *(header[key] for key in ("citation", "published", "claims_not"))) for name, header in headers.items()
    )
    return Table("Where they come from", tuple(map(Column, ("reaction", "citation", "published", "not claimed"))), rows)


def error_table(result: MapResult) -> Table:
    """Return the numerical uncertainty of the answer, cause by cause."""
    settings = result.settings
    centre = result.cell(settings.centre)
    critical = centre.critical[settings.detector]
    rows = (
        ("as computed", _milliseconds(critical), 1e3 * centre.error),
        *((f"with {name}", _milliseconds(value), None) for name, value in result.refined.items()),
        ("all together", _milliseconds(critical), 1e3 * result.uncertainty),
    )
    columns = (Column("critical latency"), Column("value", "ms", 1), Column("may be longer by", "ms", 1))
    return Table(f"After '{settings.detector}'", columns, rows)


def _milliseconds(time: float | None) -> Cell:
    if time is None:
        return Missing.NO_EVENT
    return "held" if np.isinf(time) else 1e3 * time
