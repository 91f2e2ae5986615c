"""Tables as text, Markdown, CSV, JSON and on terminals of any width."""

import csv
import io
import json

import pytest
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


@pytest.mark.parametrize(
    ("column", "cell", "text"),
    [
        # An uncertainty below the last digit is not shown as nothing.
        (Column("time", "s", 3), Measured(1.7046, 0.0002), "1.705 ± <0.001"),
        (Column("time", "s", 0), Measured(1.7046, 0.0002), "2 ± <1"),
        # Negative digits are zeros before the point.
        (Column("time", "ms", -2), 612.3, "600"),
        (Column("time", "ms", -2), Measured(612.3, 7.0), "600 ± <100"),
        (Column("force", significant=4), 0.159664, "0.1597"),
        (Column("force", significant=4), Measured(0.159664, 0.000485523), "0.1597 ± 0.00049"),
        # A rounded zero has no sign.
        (Column("diff.", "ms", 0), -0.4, "0"),
        (Column("diff.", "ms"), -0.0, "0"),
        (Column("diff.", "ms", 0), -0.6, "-1"),
    ],
)
def test_numbers_have_the_digits_of_their_column(column, cell, text):
    assert column.format(cell) == text


def test_reasons_have_texts_of_their_own_units_are_typeset_and_columns_numeric():
    assert len({reason.shown for reason in Missing}) == len({reason.meaning for reason in Missing}) == len(Missing)
    assert "-" not in {reason.shown for reason in Missing}
    assert [typeset(unit) for unit in ("m/s^2", "kg/m^3", "um", "N")] == ["m/s²", "kg/m³", "µm", "N"]
    columns = (Column("time", "s"), Column("name"), Column("mixed"))
    rows = ((Missing.NO_EVENT, Missing.NOT_DEFINED, 1.0), (None, None, Missing.NO_EVENT))
    assert [is_numeric(Table("t", columns, rows), index) for index in range(3)] == [True, False, True]
    table = Table("t", (Column("a"),), ((1,), (None,)))
    assert (table.legend, table.remarks) == ("", ""), "nothing is missing"
    assert to_markdown(table).count("\n") == 4


def test_json_keeps_numbers_and_says_why_values_are_missing():
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
    table = Table("t", (Column("a"),), ((float("nan"),), (Measured(1.0, float("inf")),), (1.5,), (None,)))
    rows = json.loads(json.dumps(to_mapping(table), allow_nan=False))["rows"]
    assert rows == [[None], [{"value": 1.0, "uncertainty": None}], [1.5], [None]], "null for what is no number"


def test_cells_with_bars_and_commas_stay_one_cell_and_missing_values_say_why():
    table = Table("t", (Column("a"), Column("b", "mm", 1)), (("x|y, z", 1.25), (None, None), (True, 2)))
    assert to_markdown(table).splitlines()[2] == "| x\\|y, z | 1.2 |"
    assert list(csv.reader(io.StringIO(to_csv(table)))) == [["a", "b"], ["x|y, z", "1.25"], ["", ""], ["true", "2"]]
    table = Table("t", (Column("time", "s", 3),), ((Measured(1.7046, 0.0056),), (None,)))
    assert to_markdown(table).splitlines()[2:] == ["| 1.705 ± 0.006 |", "|  |"]
    assert is_numeric(table, 0)
    assert list(csv.reader(io.StringIO(to_csv(table))))[1] == ["1.7046"]
    rows = ((1.5,), (Missing.NOT_RECORDED,), (Missing.NO_EVENT,), (Missing.NO_EVENT,))
    table = Table("t", (Column("time", "s", 2),), rows, note="A note.")
    assert to_markdown(table).splitlines()[3:5] == ["| n/r |", "| none |"]
    assert table.legend == "none: the event did not happen; n/r: not recorded in this run"
    assert table.remarks == f"A note. {table.legend}."
    assert to_markdown(table).endswith(f"\n\n{table.legend}.\n")
    assert list(csv.reader(io.StringIO(to_csv(table)))) == [["time"], ["1.5"], [""], [""], [""]]
    assert "none: the event did not happen" in "\n".join(printed(table, 80))


def printed(table, width):
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(to_rich(table, width))
    return console.export_text().splitlines()


WIDE = Table(
    "Checked",
    (Column("study"), Column("run"), *(Column(f"number {n}", "s", 1) for n in range(5)), Column("state")),
    ((("a_long_file_name.yaml"), "variant-flattened_friction-0.4", *(12345.5 + n for n in range(5)), "to do"),) * 2,
    note="What a reader has to know.",
)


PREDICTED = Table(
    "Predicted for friction 0.6",
    tuple(map(Column, ("output", "unit", "predicted", "from", "to", "error", "largest error", "Q²"))),
    (("incipient slip", "s", 0.12345, 0.12123, 0.12567, 0.0011, 0.0023, 0.987),) * 3,
)


@pytest.mark.parametrize("width", [20, 30, 40, 60, 80, 100, 160])
def test_a_terminal_shows_every_cell_whole_whatever_its_width(width):
    lines = printed(WIDE, width)
    assert max(map(len, lines)) <= width
    for number in range(5):
        assert sum(f"{12345.5 + number:.1f}" in line for line in lines) == 2, "numbers are never broken"
    letters = "".join("".join(lines).split())
    assert "…" not in letters
    if width in {20, 160}:
        assert "a_long_file_name.yaml" in letters
        assert "variant-flattened_friction-0.4" in letters
    usual = {word for line in printed(PREDICTED, width) for word in line.split()}
    assert {"incipient", "slip", "predicted", "largest", "error"} <= usual, "usual words are whole"


def test_long_names_break_where_their_parts_meet_and_where_no_table_fits_rows_become_lists():
    lines = [line.rstrip() for line in printed(WIDE, 40)]
    assert lines[0] == "Checked"
    assert "number 0 [s] 12345.5" in lines
    assert lines[-2] == "What a reader has to know."
    columns = tuple(map(Column, ("value", "slope_standard_error", *(f"a rather long heading {n}" for n in range(4)))))
    table = Table("t", columns, (("fingertip.phalanx.sagittal.concavity_depth", *("0.0123456789",) * 5),))
    lines = [line.strip() for line in printed(table, 50)]
    assert "value                   fingertip.phalanx." in lines
    assert "sagittal.concavity_depth" in lines


def test_headings_with_brackets_and_marked_rows_survive_and_long_texts_in_narrow_columns_become_lists():
    text = "\n".join(printed(Table("t [a]", (Column("time", "s", 3),), ((1.0,),), note="[b] stays"), 80))
    assert all(words in text for words in ("t [a]", "[s]", "[b]"))
    assert printed(Table("t", (Column("a"), Column("b")), (), note="Same."), 30) == ["t", "", "Same.", ""]
    table = Table("t", (Column("a"),), (("plain",), ("special",)), marked=(1,))
    console = Console(width=40, force_terminal=True, file=io.StringIO(), record=True)
    console.print(to_rich(table))
    lines = console.export_text(styles=True).splitlines()
    assert [bool("\x1b[1m" in line) for line in lines if "plain" in line or "special" in line] == [False, True]
    quantity = "travel of the plate at overall slip over friction times depth, original (accumulated slip)"
    columns = (*map(Column, ("quantity", "source", "published")), *(Column(f"number {n}", "s", 3) for n in range(4)))
    table = Table("Beside each other", columns, ((quantity, "wang2014, Table 2", "1.71", 1.0, 2.0, 3.0, 4.0),) * 3)
    narrow, wide = printed(table, 50), printed(table, 160)
    assert "number 3 [s] 4.000" in [line.rstrip() for line in narrow]
    assert any(line.split()[-4:] == ["1.000", "2.000", "3.000", "4.000"] for line in wide)
    words = quantity.split()
    assert all(any(word in line.split() for line in narrow) for word in words), "no word is broken"
