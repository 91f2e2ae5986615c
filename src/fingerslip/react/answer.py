"""What a map comes to: a sentence, tables, figures, and the folder that holds them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from fingerslip.react.figures import map_figure, margin_figure
from fingerslip.react.mapping import MapResult, Trial, reaction_map, read_reaction_map
from fingerslip.react.reflex import REACTIONS, reaction
from fingerslip.report.figures.style import save_figure
from fingerslip.storage.files import write_text
from fingerslip.tables.table import Cell, Column, Missing, Table, to_csv

__all__ = ["answer", "cell_table", "map_file", "source_table", "trial_table", "write_map"]


def answer(result: MapResult) -> str:
    """Return the answer of a map in a sentence or two."""
    settings, centre = result.settings, result.settings.centre
    critical = result.cell(centre).critical[settings.detector]
    where = f"At friction {centre.friction:g} and {centre.load_rate:g} N/s"
    tried = [trial for trial in result.trials if trial.detector == settings.detector]
    if critical is None:
        return f"{where} no reflex saves the object, however quick."
    if np.isinf(critical):
        return f"{where} the grip holds the object; no reflex is needed."
    longest, lost = 1e3 * critical, 1e3 * (critical + result.cell(centre).error)
    texts = [
        f"{verb} {', '.join(map(_name, trials))}"
        for verb, trials in (("saved by", _of(tried, True)), ("lost by", _of(tried, False)))
        if trials
    ]
    first = f"{where} a grip that rises {longest:.0f} ms after '{settings.detector}' saves the object"
    bar = f"± {1e3 * result.uncertainty:.0f} ms of search, step and mesh"
    return f"{first}, {lost:.0f} ms loses it ({bar}). It is {'; '.join(texts)}."


def _name(trial: Trial) -> str:
    since = " since the load" if reaction(trial.reaction).reflex.since == "load" else ""
    return f"{trial.reaction} ({1e3 * trial.delay:.0f} ms{since})"


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


def _milliseconds(time: float | None) -> Cell:
    if time is None:
        return Missing.NO_EVENT
    return "held" if np.isinf(time) else 1e3 * time


def write_map(result: MapResult, folder: str | Path) -> Path:
    """Write answer, tables and figures of a map into a folder, and return it."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "answer.txt", f"{answer(result)}\n")
    for name, table in (("cells", cell_table(result)), ("trials", trial_table(result)), ("sources", source_table())):
        write_text(folder / f"{name}.csv", to_csv(table))
    save_figure(map_figure(result), folder / "reaction-map.png")
    save_figure(margin_figure(result), folder / "reaction-margin.png")
    return folder


def map_file(path: Path, results: Path, workers: int, progress: Callable[[float], None]) -> tuple[MapResult, Path]:
    """Compute the map of a file and write it into a folder of its name; return it and the folder."""
    result = reaction_map(read_reaction_map(path), workers=workers, progress=progress)
    return result, write_map(result, results / path.stem)
