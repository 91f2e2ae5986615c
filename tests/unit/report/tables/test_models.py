"""The table of models as they were computed."""

from __future__ import annotations

from fingerslip.report.tables.parameters import models_table
from fingerslip.tables.table import texts
from unit.report.scenes import block_history
from unit.synthetic import Process, make


def test_sizes_contact_stiffness_and_solver_are_those_of_the_history() -> None:
    history = block_history("Q4")
    table = models_table({"one": history, "bare": make(Process())})
    rows = {row[0]: row[1:] for row in texts(table)}
    assert rows["element"] == ["Q4", "n/r"]
    assert rows["nodes"][0] == str(history.sizes["node"])
    assert rows["contact candidates"][0] == str(history.sizes["contact_node"])
    assert rows["mean normal penalty [Pa/m]"][0] == f"{history.attrs['normal_penalty']:.3g}"
    assert rows["linear solver"][0] == history.attrs["linear_solver"]


def test_there_are_no_rows_where_no_history_says_it() -> None:
    assert models_table({"bare": make(Process())}).rows == ()
