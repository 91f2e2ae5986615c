"""Tables of the values that runs were made with: unit, source and group of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fingerslip.report.tables.table import Column, Table

__all__ = ["ASSUMED", "COLUMNS", "GROUPS", "NOT_USED", "ShownValue", "group_of", "value_tables"]

#: Sources that set the order of tables: assumed values come first, those that a run does not use last.
ASSUMED, NOT_USED = "assumed", "not used"

#: The columns of a table of values.
COLUMNS = (Column("parameter"), Column("value"), Column("source"), Column("note"))
#: The groups in the order of tables, with the leading parts of the dotted paths of their values.
GROUPS: dict[str, tuple[str, ...]] = {
    "Materials and damping": ("fingertip.materials", "materials", "damping"),
    "Specimen": ("fingertip",),
    "Mesh and formulation": ("mesh", "formulation", "depth", "integration", "kinematics"),
    "Contact and friction": ("contact", "contacts"),
    "Programme": ("programme",),
    "Supports and loads": ("supports", "tractions", "gravity", "initial_velocity"),
    "Time": ("time", "dynamics"),
    "Recording": ("record",),
    "Other values": (),
}


@dataclass(frozen=True)
class ShownValue:
    """One value of a run as a reader needs it."""

    path: str  # dotted path in the study file
    value: str  # the value with its unit
    source: str  # key of the reference that it is from, ``assumed``, ``study file``, ``default`` or ``not used``
    note: str = ""  # what the value rests on


def group_of(path: str) -> str:
    """Return the group of a value.

    Examples
    --------
    >>> group_of("fingertip.materials.dermis.density"), group_of("fingertip.depth"), group_of("contact.normal.0")
    ('Materials and damping', 'Specimen', 'Contact and friction')
    """
    return next(
        (group for group, parts in GROUPS.items() if any(f"{path}.".startswith(f"{part}.") for part in parts)),
        list(GROUPS)[-1],
    )


def value_tables(values: Sequence[ShownValue]) -> tuple[Table, ...]:
    """Show values in a table for each group: the assumed ones first and marked, those that are not used last."""
    grouped = {group: [value for value in values if group_of(value.path) == group] for group in GROUPS}
    return tuple(_table(group, members) for group, members in grouped.items() if members)


def _table(title: str, values: Sequence[ShownValue]) -> Table:
    ordered = sorted(values, key=lambda value: (value.source == NOT_USED, value.source != ASSUMED))
    assumed = sum(value.source == ASSUMED for value in values)
    note = f"{assumed} of {len(values)} values are assumed: the sources do not give them." if assumed else ""
    rows = tuple((value.path, value.value, value.source, value.note) for value in ordered)
    return Table(title, COLUMNS, rows, note, marked=tuple(range(assumed)))
