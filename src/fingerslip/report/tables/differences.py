"""The values in which two runs or studies differ, as far as a reader asks for them."""

from __future__ import annotations

from collections.abc import Mapping

from fingerslip.report.tables.parameters import group_of
from fingerslip.report.tables.table import Column, Missing, Table

__all__ = ["differences_table"]

# What is only kept or filmed differs between most studies, and moves no slip event.
_ASIDE = "Recording"
_MOST_NAMED = 4


def differences_table(first: Mapping[str, str], second: Mapping[str, str], *, same: str, note: str = "") -> Table:
    """Put the values that differ into a table; values that only say what is recorded are named below it.

    Examples
    --------
    >>> table = differences_table({"a": "1", "record.c": "2"}, {"a": "3"}, same="Same.")
    >>> table.rows
    (('a', '1', '3'),)
    """
    paths = [path for path in dict.fromkeys((*first, *second)) if first.get(path) != second.get(path)]
    shown = [path for path in paths if group_of(path) != _ASIDE]
    rows = tuple((path, *(own.get(path, Missing.NOT_DEFINED) for own in (first, second))) for path in shown)
    said = (note, "" if paths else same, _aside([path for path in paths if path not in shown]))
    return Table("Values that differ", (Column("value"), Column("A"), Column("B")), rows, " ".join(filter(None, said)))


def _aside(paths: list[str]) -> str:
    if not paths:
        return ""
    more = f" and {len(paths) - _MOST_NAMED} more" if len(paths) > _MOST_NAMED else ""
    return f"Recorded differently, too, which moves no slip event: {', '.join(paths[:_MOST_NAMED])}{more}."
