"""Tables of the values that runs were made with: unit, source and group of each."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fingerslip.libraries import xr
from fingerslip.report.labels import groups
from fingerslip.tables.table import Column, Missing, Table

#: Sources: assumed values come first in tables, those that a run does not use last; the study file says no defaults.
ASSUMED, NOT_USED, DEFAULT = "assumed", "not used", "default"

#: The columns of a table of values.
COLUMNS = (Column("parameter"), Column("value"), Column("source"), Column("note"))
#: The groups in the order of tables, with the leading parts of the dotted paths of their values.
GROUPS: Mapping[str, Sequence[str]] = groups()["value_groups"]


@dataclass(frozen=True)
class ShownValue:
    """One value of a run as a reader needs it."""

    path: str  # dotted path in the study file
    value: str  # the value with its unit
    source: str  # key of the reference that it is from, ``assumed``, ``study file``, ``default`` or ``not used``
    note: str = ""  # what the value rests on


def group_of(path: str) -> str:
    """Return the group of a value."""
    return next(
        (group for group, keys in GROUPS.items() if any(f"{path}.".startswith(f"{part}.") for part in keys)),
        list(GROUPS)[-1],
    )


def value_tables(values: Sequence[ShownValue]) -> tuple[Table, ...]:
    """Show values in a table for each group: the assumed ones first and marked, those that are not used last."""
    ordered = sorted(values, key=lambda value: (value.source == NOT_USED, value.source != ASSUMED))
    tables = []
    for group in GROUPS:
        members = [value for value in ordered if group_of(value.path) == group]
        assumed = sum(value.source == ASSUMED for value in members)
        note = f"{assumed} of {len(members)} values are assumed: the sources do not give them." if assumed else ""
        rows = tuple((value.path, value.value, value.source, value.note) for value in members)
        tables.append(Table(group, COLUMNS, rows, note, marked=tuple(range(assumed))))
    return tuple(table for table in tables if table.rows)


def models_table(histories: Mapping[str, xr.Dataset]) -> Table:
    """Show how runs were computed, as their histories say: a row for each property, a column for each run."""
    columns = (Column("property"), *(Column(title, significant=3) for title in histories))
    # Numbers of NumPy become Python's.
    attributes = [
        {name: value.item() if isinstance(value, np.generic) else value for name, value in history.attrs.items()}
        for history in histories.values()
    ]
    rows = tuple(
        (words, *(values.get(name, Missing.NOT_RECORDED) for values in attributes))
        for name, words in groups()["attributes"].items()
        if any(name in values for values in attributes)
    )
    return Table("Models as computed", columns, rows)


def conditions_table(values: Sequence[ShownValue], histories: Mapping[str, xr.Dataset]) -> Table:
    """Show the conditions of runs: specimen, materials, friction, motion, mesh, time, and all that was changed."""
    named = [(words, value) for value in values if value.source != NOT_USED and (words := _words(value))]
    ordered = sorted(named, key=lambda pair: pair[0][0])
    rows = [(text, value.value, value.source, value.note) for (_, text), value in ordered]
    marked = tuple(number for number, (_, value) in enumerate(ordered) if value.source == ASSUMED)
    columns = (Column("condition"), *COLUMNS[1:])
    note = "Assumed values are marked: no source gives them." if marked else ""
    for name, what in {"n_nodes": "mesh: nodes", "n_contact_candidates": "mesh: nodes that may touch"}.items():
        sizes = sorted({int(history.attrs[name]) for history in histories.values() if name in history.attrs})
        if sizes:
            rows.append((what, " to ".join(dict.fromkeys((str(sizes[0]), str(sizes[-1])))), "as computed", ""))
    return Table("What was run", columns, tuple(rows), note, marked)


def _words(value: ShownValue) -> tuple[int, str] | None:
    """Return the number of the pattern of a condition and its words; None for a value that the table leaves out."""
    conditions = groups()["conditions"]
    for number, (pattern, words) in enumerate(conditions.items()):
        match = re.fullmatch(pattern, value.path)
        if match:
            return number, words.format(*(part.replace("_", " ") for part in match.groups()))
    is_set = value.source.startswith("study file") and not value.path.startswith("record.")
    return (len(conditions) - 1, value.path) if is_set else None
