"""Tables as data, for the terminal, in Markdown and as CSV."""

from __future__ import annotations

import csv
import io

from rich.console import Console

from fingerslip.report.tables.table import Column, Measured, Table, is_numeric, to_csv, to_markdown, to_rich


def test_cells_with_bars_and_commas_stay_one_cell() -> None:
    table = Table("t", (Column("a"), Column("b", "mm", 1)), (("x|y, z", 1.25), (None, None), (True, 2)))
    assert to_markdown(table).splitlines()[2] == "| x\\|y, z | 1.2 |"
    assert list(csv.reader(io.StringIO(to_csv(table)))) == [["a", "b"], ["x|y, z", "1.25"], ["", ""], ["true", "2"]]


def test_a_measured_number_shows_its_uncertainty_and_stays_a_number() -> None:
    table = Table("t", (Column("time", "s", 3),), ((Measured(1.7046, 0.0056),), (None,)))
    assert to_markdown(table).splitlines()[2:] == ["| 1.705 ± 0.006 |", "| - |"]
    assert is_numeric(table, 0)
    assert list(csv.reader(io.StringIO(to_csv(table))))[1] == ["1.7046"]


def test_a_heading_with_brackets_survives_the_terminal() -> None:
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(to_rich(Table("t [a]", (Column("time", "s", 3),), ((1.0,),), note="[b] stays")))
    text = console.export_text()
    assert "t [a]" in text
    assert "[s]" in text
    assert "[b]" in text
