"""The table of energies."""

from __future__ import annotations

import pytest

from fingerslip.report.tables.runs import energies_table
from fingerslip.tables.table import Missing
from unit.report.scenes import block_history


def test_the_balance_closes_and_older_histories_say_what_they_lack() -> None:
    history = block_history("Q4")
    table = energies_table({"a": history, "older": history.drop_vars("viscous_dissipation")})
    rows = {str(row[0]): row[2:] for row in table.rows}
    work, *parts = (rows[name][0] for name in list(rows)[:-1])
    assert work == pytest.approx(sum(parts))
    assert rows["largest imbalance over largest work"][0] < 1e-9
    assert rows["relaxation of materials"][1] is Missing.NOT_RECORDED
