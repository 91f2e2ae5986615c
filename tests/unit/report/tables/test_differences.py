"""Values in which two studies differ: what a reader asks for, and the rest in one line."""

from __future__ import annotations

from fingerslip.report.tables.compare import differences_table
from fingerslip.tables.table import Missing, to_markdown


def test_what_differs_is_shown_and_what_is_only_recorded_is_named_below() -> None:
    first = {"time.step": "5 ms", "contact.friction_coefficient": "0.4", "record.snapshots_every": "50 ms"}
    second = {"time.step": "5 ms", "contact.friction_coefficient": "0.6", "damping.mass": "1 1/s"}
    table = differences_table(first, second, same="Same.")
    assert table.rows == (
        ("contact.friction_coefficient", "0.4", "0.6"),
        ("damping.mass", Missing.NOT_DEFINED, "1 1/s"),
    )
    assert table.note == "Recorded differently, too, which moves no slip event: record.snapshots_every."


def test_of_many_records_four_are_named() -> None:
    table = differences_table({f"record.sites.{n}.name": "a" for n in range(7)}, {}, same="Same.")
    assert table.rows == ()
    assert table.note.endswith("record.sites.3.name and 3 more.")


def test_where_nothing_differs_it_says_so() -> None:
    table = differences_table({"a": "1"}, {"a": "1"}, same="Both are the same.", note="A: x; B: y.")
    assert table.note == "A: x; B: y. Both are the same."
    assert to_markdown(table).count("\n") == 2


def test_only_records_differ_is_not_called_the_same() -> None:
    assert "same" not in differences_table({"record.a": "1"}, {"record.a": "2"}, same="the same").note
