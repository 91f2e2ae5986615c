"""Tables as data, in Markdown, as CSV and for JSON."""

from __future__ import annotations

import csv
import io
import json

from rich.console import Console

from fingerslip.tables.table import (
    Column,
    Measured,
    Missing,
    Table,
    is_numeric,
    to_csv,
    to_mapping,
    to_markdown,
    to_rich,
    typeset,
)


def test_cells_with_bars_and_commas_stay_one_cell() -> None:
    table = Table("t", (Column("a"), Column("b", "mm", 1)), (("x|y, z", 1.25), (None, None), (True, 2)))
    assert to_markdown(table).splitlines()[2] == "| x\\|y, z | 1.2 |"
    assert list(csv.reader(io.StringIO(to_csv(table)))) == [["a", "b"], ["x|y, z", "1.25"], ["", ""], ["true", "2"]]


def test_a_measured_number_shows_its_uncertainty_and_stays_a_number() -> None:
    table = Table("t", (Column("time", "s", 3),), ((Measured(1.7046, 0.0056),), (None,)))
    assert to_markdown(table).splitlines()[2:] == ["| 1.705 ± 0.006 |", "|  |"]
    assert is_numeric(table, 0)
    assert list(csv.reader(io.StringIO(to_csv(table))))[1] == ["1.7046"]


def test_an_uncertainty_below_the_last_digit_is_not_shown_as_nothing() -> None:
    shown = (Column("time", "s", digits) for digits in (3, 0))
    assert [column.format(Measured(1.7046, 0.0002)) for column in shown] == ["1.705 ± <0.001", "2 ± <1"]


def test_negative_digits_are_zeros_before_the_point() -> None:
    column = Column("time", "ms", -2)
    assert (column.format(612.3), column.format(Measured(612.3, 7.0))) == ("600", "600 ± <100")


def test_reasons_have_texts_of_their_own() -> None:
    assert len({reason.shown for reason in Missing}) == len({reason.meaning for reason in Missing}) == len(Missing)
    assert "-" not in {reason.shown for reason in Missing}


def test_a_table_without_missing_values_has_no_legend() -> None:
    table = Table("t", (Column("a"),), ((1,), (None,)))
    assert (table.legend, table.remarks) == ("", "")
    assert to_markdown(table).count("\n") == 4


def test_columns_of_missing_numbers_are_columns_of_numbers() -> None:
    columns = (Column("time", "s"), Column("name"), Column("mixed"))
    rows = ((Missing.NO_EVENT, Missing.NOT_DEFINED, 1.0), (None, None, Missing.NO_EVENT))
    assert [is_numeric(Table("t", columns, rows), index) for index in range(3)] == [True, False, True]


def test_significant_digits_are_those_of_the_column() -> None:
    column = Column("force", significant=4)
    assert (column.format(0.159664), column.format(Measured(0.159664, 0.000485523))) == ("0.1597", "0.1597 ± 0.00049")


def test_units_are_typeset() -> None:
    assert [typeset(unit) for unit in ("m/s^2", "kg/m^3", "um", "N")] == ["m/s²", "kg/m³", "µm", "N"]


def test_a_rounded_zero_has_no_sign() -> None:
    assert Column("diff.", "ms", 0).format(-0.4) == "0"
    assert Column("diff.", "ms").format(-0.0) == "0"
    assert Column("diff.", "ms", 0).format(-0.6) == "-1"


def test_json_keeps_numbers_and_says_why_values_are_missing() -> None:
    columns = (Column("run"), Column("time", "s", 3))
    rows = (("a", Measured(1.70461, 0.0056)), ("b", Missing.NO_EVENT), ("c", None))
    found = json.loads(json.dumps(to_mapping(Table("t", columns, rows, "a note"))))
    assert found == {
        "title": "t",
        "columns": [{"name": "run", "unit": ""}, {"name": "time", "unit": "s"}],
        "rows": [
            ["a", {"value": 1.70461, "uncertainty": 0.0056}],
            ["b", {"missing": "the event did not happen"}],
            ["c", None],
        ],
        "note": "a note",
    }


def test_json_has_null_for_what_is_no_number() -> None:
    table = Table("t", (Column("a"),), ((float("nan"),), (Measured(1.0, float("inf")),), (1.5,), (None,)))
    rows = json.loads(json.dumps(to_mapping(table), allow_nan=False))["rows"]
    assert rows == [[None], [{"value": 1.0, "uncertainty": None}], [1.5], [None]]


def test_a_missing_value_says_why_and_the_legend_explains_what_is_there() -> None:
    rows = ((1.5,), (Missing.NOT_RECORDED,), (Missing.NO_EVENT,), (Missing.NO_EVENT,))
    table = Table("t", (Column("time", "s", 2),), rows, note="A note.")
    assert to_markdown(table).splitlines()[3:5] == ["| n/r |", "| none |"]
    assert table.legend == "none: the event did not happen; n/r: not recorded in this run"
    assert table.remarks == f"A note. {table.legend}."
    assert to_markdown(table).endswith(f"\n\n{table.legend}.\n")
    assert list(csv.reader(io.StringIO(to_csv(table)))) == [["time"], ["1.5"], [""], [""], [""]]
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(to_rich(table))
    assert "none: the event did not happen" in console.export_text()
